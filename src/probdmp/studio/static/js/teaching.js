// Teach and trace: what is drawn on the canvas becomes a demonstration, or is scored while it is drawn.

import { show } from "./board.js";
import { emit, on } from "./bus.js";
import { byId, setChoices, setText } from "./dom.js";
import { felt, fitting, followPointer } from "./ink.js";
import { band, selected, session, setMode } from "./session.js";
import { send } from "./socket.js";

const FEWEST = 3;

let waiting = []; // samples of a trace that were not sent yet
let asked = false; // whether they will be, at the next frame of the screen

function sendTrace() {
  asked = false;
  if (waiting.length) send("trace", { points: waiting });
  waiting = [];
}

function begin(points) {
  if (session.mode !== "teach" && session.mode !== "trace") return false;
  if (session.mode === "trace") {
    const label = byId("trace-label").value || null;
    send("trace_begin", { label });
    emit("tracing", { label });
    waiting = [...points];
  }
  show({ ink: points, frame: null });
  return true;
}

function move(fresh) {
  if (session.mode === "trace") {
    waiting.push(...fresh);
    if (!asked) requestAnimationFrame(sendTrace);
    asked = true;
  }
  show({});
}

function end(points) {
  if (session.mode === "trace") {
    sendTrace();
    send("trace_end");
    emit("traced");
    return;
  }
  show({ ink: [] });
  if (points.length < FEWEST) return; // a tap
  performance.mark("stroke");
  send("stroke", { label: selected(), points: felt(fitting(points)) });
}

/** True if `begin` and the rest belong to teaching; playing has its own pointer. */
export function startTeaching() {
  let suggested = null; // the letter that was selected when it was suggested to be traced
  followPointer(byId("ink"), { begin, move, end });
  byId("teach-play").addEventListener("click", () => {
    setMode("play");
    byId("play").click();
    byId("play").focus();
  });
  byId("try-example").addEventListener("click", () => {
    send("example", { name: session.state.examples[0] });
    byId("teach-play").focus();
  });
  byId("trace-label").addEventListener("change", ({ target: { value } }) => value && value !== selected() && send("select", { label: value }));
  on("changed", () => {
    byId("teach-play").disabled = !band();
    const isBegun = session.state.labels.some((one) => one.strokes.length || one.learned);
    byId("teach-play").hidden = !isBegun;
    byId("try-example").hidden = isBegun || !session.state.examples.length;
    setText(byId("try-example"), `Or take a ready-made ${session.state.examples[0] ?? ""}`);
    setText(byId("change"), band()?.change ?? "");
    const names = session.state.labels.filter((one) => one.learned).map((one) => [one.name, one.name]);
    setChoices(byId("trace-label"), [...names, ["", "nothing yet: say which it is"]]);
    const learned = names.some(([name]) => name === selected());
    if (suggested !== selected() && learned) byId("trace-label").value = suggested = selected();
  });
}
