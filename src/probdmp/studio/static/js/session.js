// What the page knows: the newest state of the server, the band of each letter, and the mode of the canvas.

import { emit, on } from "./bus.js";
import { showFrom } from "./geometry.js";

export const session = {
  id: null,
  state: null, // as the server sent it
  bands: new Map(), // label -> band
  mode: "teach",
  playing: null, // the message "playing", while it plays
};

const movement = (label) => session.state?.labels.find((one) => one.name === label);
export const strokesOf = (label) => movement(label)?.strokes ?? [];
/** Of what kind its recordings are, and how they are shown; null of those that were drawn. */
export const originOf = (label) => movement(label)?.origin ?? null;
export const selected = () => session.state?.selected ?? "a";
export const band = () => session.bands.get(selected()) ?? null;

export function setMode(mode) {
  if (session.mode === mode) return;
  session.mode = mode;
  emit("mode", { mode });
}

on("state", (state) => {
  session.state = state;
  session.id = state.session;
  showFrom(originOf(selected()));
  const names = new Set(state.labels.map((one) => one.name));
  for (const label of session.bands.keys()) if (!names.has(label)) session.bands.delete(label);
  emit("changed");
});
on("band", (message) => {
  session.bands.set(message.label, message);
  emit("changed");
});
on("playing", (message) => {
  session.playing = message;
});
on("played", () => {
  session.playing = null;
});
