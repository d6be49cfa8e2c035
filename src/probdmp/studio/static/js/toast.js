// A line at the foot of the page: what happened, what went wrong and what to do, perhaps with a way back.

import { on } from "./bus.js";
import { byId, make } from "./dom.js";

const LASTS = 6000; // ms; errors, and what happened while nobody looked, stay until they are dismissed
let timer = null;

function show({ text, action, act, stays = false }) {
  const toast = byId("toast");
  clearTimeout(timer);
  const hide = () => (toast.hidden = true);
  const buttons = action ? [make("button", { type: "button", class: "quiet", text: action, onclick: () => {
    act();
    hide();
  } })] : [];
  buttons.push(make("button", { type: "button", class: "quiet", text: "Dismiss", onclick: hide }));
  toast.replaceChildren(make("span", { text }), ...buttons);
  toast.hidden = false;
  if (!stays) timer = setTimeout(hide, LASTS);
}

const words = ({ expected, got, hint }) => [expected && `Expected ${expected}`, got && `got ${got}`].filter(Boolean).join(", ") + (hint ? `. ${hint}` : "");

export function startToast() {
  on("toast", show);
  on("error", (error) => show({ text: words(error), stays: true }));
  on("learning_failed", ({ label, error }) => show({ text: `${label} was not learned. ${words(error)}`, stays: true }));
}
