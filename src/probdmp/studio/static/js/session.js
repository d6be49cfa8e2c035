// What the page knows: the newest state of the server, the band of each letter, and the mode of the canvas.

import { emit, on } from "./bus.js";

export const session = {
  id: null,
  state: null, // as the server sent it
  bands: new Map(), // label -> band
  mode: "teach",
  playing: null, // the message "playing", while it plays
};

export const strokesOf = (label) => session.state?.labels.find((one) => one.name === label)?.strokes ?? [];
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
