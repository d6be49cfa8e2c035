// Teach, play, trace or replay: which tools stand under the canvas.

import { on } from "./bus.js";
import { byId } from "./dom.js";
import { session, setMode } from "./session.js";
import { send } from "./socket.js";

export function startModes() {
  byId("modes").addEventListener("change", (event) => {
    if (session.playing) send("stop");
    setMode(event.target.value);
  });
  const update = () => {
    document.body.dataset.mode = session.mode;
    for (const tools of document.querySelectorAll(".tools")) tools.hidden = tools.dataset.mode !== session.mode;
    document.querySelector(`#modes [value="${session.mode}"]`).checked = true;
  };
  on("mode", update);
  update();
}
