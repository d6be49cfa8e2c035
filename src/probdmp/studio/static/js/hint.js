// One sentence: what to do next.

import { on } from "./bus.js";
import { byId, setText } from "./dom.js";
import { band, selected, session, strokesOf } from "./session.js";

const ENOUGH = 3;

let outcome = null; // of the last execution: "failed" or "fine"
let traced = false;
let learning = false;
let held = false; // the pen, by the pointer or the button

/** A single letter is spoken with its article: an a, a b. */
const withArticle = (name) => (/^[a-z]$/i.test(name) ? `${/[aefhilmnorsx]/i.test(name) ? "an" : "a"} ${name}` : name);

function teach() {
  const strokes = strokesOf(selected()).length;
  const name = selected();
  if (!strokes && band()) return "It knows the movement. Press Play.";
  if (!strokes) return `Draw ${withArticle(name)}, in one stroke, three times.`;
  if (strokes < ENOUGH) return ENOUGH - strokes === 1 ? "Once more." : "Again, twice more: it learns how you vary.";
  if (!band()) return learning ? "Learning …" : "Draw it once more.";
  return "It knows the movement. Press Play.";
}

function play() {
  if (!band()) return "First teach it a letter.";
  if (session.playing && outcome === "failed") return held ? "It noticed. Let go." : "It noticed. Let it arrive, or stop it.";
  if (session.playing) return "Now press on the canvas and hold the pen while it moves.";
  if (outcome === "failed") return "It noticed. Drag the start or the goal, and play again.";
  if (outcome === "fine") return "That was as taught. Play again, and hold the pen while it moves.";
  return "Press Play.";
}

function sentence() {
  if (!session.state) return "Connecting …";
  if (session.mode === "teach") return teach();
  if (session.mode === "play") return play();
  if (session.mode === "trace") return traced ? "Try it faster, or draw something else." : `Draw ${selected()} yourself: you are scored as you go.`;
  return session.state.labels.some((one) => one.learned) ? "Choose a recording, and move through it." : "First teach it a letter, or drop a file.";
}

export function startHint() {
  const update = () => setText(byId("hint"), sentence());
  on("learning", () => (learning = true));
  on("band learning_failed", () => (learning = false));
  on("playing", () => (outcome = null));
  on("held", (message) => (held = message.held));
  on("playing played", () => (held = false));
  on("traced", () => (traced = true));
  on("verdict", ({ failed, final }) => {
    if (failed || final) outcome = failed ? "failed" : "fine";
  });
  on("changed mode learning learning_failed playing held verdict traced played", update);
}
