// The page's session as a command line and as Python, to copy.

import { emit, on } from "./bus.js";
import { byId, setText } from "./dom.js";
import { send } from "./socket.js";

/** Without a secure context there is no clipboard; then the text is selected, to be copied by hand. */
async function copy(element) {
  try {
    await navigator.clipboard.writeText(element.textContent);
    emit("toast", { text: "Copied." });
  } catch {
    getSelection().selectAllChildren(element);
    emit("toast", { text: "Selected: copy it with Ctrl+C." });
  }
}

export function startCommands() {
  byId("open-commands").addEventListener("click", () => {
    send("export_commands");
    byId("commands").showModal();
  });
  on("commands", ({ shell, python }) => {
    setText(byId("commands-shell"), shell);
    setText(byId("commands-python"), python);
  });
  for (const button of document.querySelectorAll("[data-copy]")) {
    button.addEventListener("click", () => copy(byId(button.dataset.copy)));
  }
}
