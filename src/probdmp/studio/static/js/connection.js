// The banner when the server is away, and the way back: strokes are taught again to a server that was started anew.

import { emit, on } from "./bus.js";
import { byId, setText } from "./dom.js";
import { again } from "./ink.js";
import { connect, send } from "./socket.js";

let before = null; // the last state of the session that this page showed

function show(text, action, act) {
  byId("banner").hidden = !text;
  setText(byId("banner-text"), text);
  const button = byId("banner-action");
  button.hidden = !action;
  if (action) button.textContent = action;
  button.onclick = act;
}

function teachAgain(state) {
  for (const { name, strokes, origin } of state.labels) {
    for (const { points } of strokes) send("stroke", { label: name, points: again(points), origin });
  }
  if (state.selected) send("select", { label: state.selected });
}

export function startConnection() {
  on("connected", () => show(""));
  on("disconnected", () => {
    document.body.dataset.connected = "no";
    show("The connection to the server is lost. Trying again …", "Try now", connect);
  });
  on("taken_over", () => show("This session is open in another tab.", "Use it here", connect));
  on("state", (state) => {
    document.body.dataset.connected = "yes";
    const lost = before?.labels.reduce((sum, one) => sum + one.strokes.length, 0) ?? 0;
    if (before && before.session !== state.session && lost && !state.labels.some((one) => one.strokes.length)) {
      const strokes = before;
      emit("toast", { text: `The server was started again; your ${lost} strokes were taught to it again.`, stays: true });
      before = state;
      teachAgain(strokes);
      return;
    }
    before = state;
  });
  connect();
}
