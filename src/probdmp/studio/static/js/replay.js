// A recorded execution once more: through the detector, with a scrubber; or as recorded, filtered and smoothed.

import { show } from "./board.js";
import { on } from "./bus.js";
import { byId, setChoices, setText } from "./dom.js";
import { selected, session, setMode } from "./session.js";
import { send } from "./socket.js";
import { pointAt } from "./streams.js";

let replayed = null;
let opened = null; // place of the first execution that was just opened, until it is chosen

function recordings() {
  const strokes = session.state.labels.flatMap(({ name, strokes, learned }) =>
    learned ? strokes.map((_, k) => [JSON.stringify({ label: name, index: k }), `${name}, stroke ${k + 1}`]) : []);
  const imported = session.state.imported.map(({ name, label }, k) =>
    [JSON.stringify({ label, index: k, imported: true }), `${name ?? "opened"}: ${label}`]);
  return [...imported, ...strokes];
}

function chooseOpened() {
  const one = session.state.imported[opened];
  if (!one) return; // the state that has it is on its way
  byId("recording").value = JSON.stringify({ label: one.label, index: opened, imported: true });
  opened = null;
}

/** Asks for the recording that is chosen; its letter is selected, so that the canvas shows what it is compared with. */
function ask(type) {
  const { label, index, imported } = JSON.parse(byId("recording").value);
  if (label !== selected() && session.state.labels.some((one) => one.name === label)) send("select", { label });
  send(type, { label: imported ? "imported" : label, index });
}

function scrubTo(k) {
  const time = replayed.times[k];
  const place = replayed.positions[k];
  const ratio = replayed.test_ratios?.[k];
  const text = `${time.toFixed(2)} s${Number.isFinite(ratio) ? `, test ratio ${ratio.toFixed(2)}${ratio > 1 ? " (alarm)" : ""}` : ""}`;
  setText(byId("scrub-text"), text);
  byId("scrub").setAttribute("aria-valuetext", text);
  show({ mark: place.slice(0, 2), frame: null });
  pointAt(time);
}

export function startReplay() {
  on("changed", () => {
    const all = recordings();
    setChoices(byId("recording"), all.length ? all : [["", "nothing recorded yet"]]);
    byId("replay").disabled = byId("compare").disabled = !all.length;
    if (opened !== null) chooseOpened();
  });
  on("uploaded", ({ execution, imported }) => {
    if (!execution) return;
    opened = imported.first.imported;
    chooseOpened();
  });
  on("replayed", (message) => {
    replayed = message;
    setMode("replay");
    const scrub = byId("scrub");
    scrub.disabled = false;
    scrub.max = message.times.length - 1;
    scrub.value = scrub.max;
    scrubTo(message.times.length - 1);
  });
  byId("replay").addEventListener("click", () => ask("replay"));
  byId("compare").addEventListener("click", () => ask("compare"));
  byId("scrub").addEventListener("input", (event) => replayed && scrubTo(Number(event.target.value)));
}
