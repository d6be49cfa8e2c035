// Play, and what disturbs: the pointer on the canvas, a button for those without one, and faults.

import { show } from "./board.js";
import { emit, on } from "./bus.js";
import { byId, setChoices, setText } from "./dom.js";
import { toUnits } from "./geometry.js";
import { band, selected, session } from "./session.js";
import { send } from "./socket.js";

let last = null; // the last frame
let pull = null; // where the pen is held, or drawn to, while it is disturbed
let asked = false;

function disturb(at) {
  if (Boolean(pull) !== Boolean(at)) emit("held", { held: Boolean(at) });
  pull = at;
  show({ pull });
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    const [x, y] = pull ?? [0, 0];
    send("pointer", { mode: pull ? byId("pointer-mode").value : "none", x, y });
  });
}

function press(held) {
  byId("hold").setAttribute("aria-pressed", held);
  setText(byId("hold"), held ? "Let go" : "Hold the pen");
}

function startPointer() {
  const surface = byId("ink");
  let pointer = null;
  let grip = [0, 0]; // from the pointer to the pen that it holds: pressing anywhere stops the pen where it is
  const reach = (event) => toUnits(event, surface.getBoundingClientRect()).map((value, d) => value + grip[d]);
  surface.addEventListener("pointerdown", (event) => {
    if (!session.playing || event.button !== 0) return;
    pointer = event.pointerId;
    surface.setPointerCapture(pointer);
    event.preventDefault();
    grip = [0, 0];
    const at = reach(event);
    if (last && byId("pointer-mode").value === "hold") grip = at.map((value, d) => last.measured[d] - value);
    disturb(reach(event));
  });
  surface.addEventListener("pointermove", (event) => {
    if (event.pointerId === pointer) disturb(reach(event));
  });
  const letGo = (event) => {
    if (event.pointerId !== pointer) return;
    pointer = null;
    if (session.playing) disturb(null);
  };
  surface.addEventListener("pointerup", letGo);
  surface.addEventListener("pointercancel", letGo);
}

function update() {
  const playing = session.playing !== null;
  byId("play").disabled = !band();
  setText(byId("play"), playing ? "Stop" : "Play");
  byId("hold").disabled = !playing;
  if (!playing) {
    pull = null;
    press(false);
  }
  document.body.dataset.playing = playing ? "yes" : "no";
}

function play() {
  if (session.playing) {
    send("stop");
    return;
  }
  send("play", { label: selected(), fault: byId("fault").value || null, speed: Number(byId("speed").value) });
}

/** Where the pen was, and when: read by tests. */
export const lastFrame = () => last;

export function startPlaying() {
  startPointer();
  byId("play").addEventListener("click", play);
  byId("hold").addEventListener("click", () => {
    if (!session.playing || !last) return;
    const held = byId("hold").getAttribute("aria-pressed") !== "true";
    press(held);
    if (held) byId("pointer-mode").value = "hold";
    disturb(held ? last.measured.slice(0, 2) : null);
  });
  on("frame", (frame) => (last = frame.kind === "playing" ? frame : null));
  on("changed playing played", update);
  on("disconnected", () => {
    if (session.playing) emit("played", { completed: false });
  });
  on("changed", () => setChoices(byId("fault"), [["", "none"], ...session.state.faults.map((name) => [name, name.replaceAll("_", " ")])]));
}
