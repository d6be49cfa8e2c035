// Which charts are shown: a list of tabs that arrow keys walk.

import { emit } from "./bus.js";
import { byId, make } from "./dom.js";

const TABS = [["position", "Position"], ["velocity", "Velocity"], ["acceleration", "Acceleration"], ["forcing", "Forcing"], ["live", "Live"]];

export let tab = "position";

export function showTab(name) {
  tab = name;
  for (const button of byId("tabs").children) {
    const chosen = button.dataset.tab === name;
    button.setAttribute("aria-selected", chosen);
    button.tabIndex = chosen ? 0 : -1;
  }
  byId("charts").setAttribute("aria-labelledby", `tab-${name}`);
  emit("tab", { tab });
}

export function startTabs() {
  for (const [name, text] of TABS) {
    const button = make("button", { type: "button", role: "tab", id: `tab-${name}`, "data-tab": name, "aria-controls": "charts", text });
    button.addEventListener("click", () => showTab(name));
    byId("tabs").append(button);
  }
  byId("tabs").addEventListener("keydown", (event) => {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!by) return;
    const at = TABS.findIndex(([name]) => name === tab);
    const next = TABS[(at + by + TABS.length) % TABS.length][0];
    showTab(next);
    byId(`tab-${next}`).focus();
  });
  showTab("position");
}
