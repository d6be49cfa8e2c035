// What is learned with, and how many false alarms are allowed.

import { on } from "./bus.js";
import { byId, setChoices, setText } from "./dom.js";
import { session } from "./session.js";
import { send } from "./socket.js";

const RATES = [0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3];
const CHOSEN = ["weight_model", "discretization", "variant"];

const words = (name) => name.replaceAll("_", " ");
const nearest = (rate) => RATES.reduce((best, one, k) => (Math.abs(one - rate) < Math.abs(RATES[best] - rate) ? k : best), 0);
const percent = (rate) => `${Number((100 * rate).toPrecision(2))} in 100 executions`;

function show() {
  const { settings, choices, calibration } = session.state;
  for (const name of CHOSEN) {
    setChoices(byId(name), choices[name].map((one) => [one, words(one)]));
    byId(name).value = settings[name];
  }
  [byId("n_basis").min, byId("n_basis").max] = choices.n_basis;
  byId("n_basis").value = settings.n_basis;
  setText(byId("n-basis-text"), settings.n_basis);
  byId("use_pressure").checked = settings.use_pressure;
  if (document.activeElement !== byId("alpha")) byId("alpha").value = nearest(settings.alpha);
  setText(byId("alpha-text"), percent(RATES[byId("alpha").value]));
  byId("calibration").hidden = !calibration;
  if (calibration) setText(byId("calibration-text"), `${sentence(calibration, settings.alpha)} ${calibration.note}`.trim());
}

function sentence({ n, attainable, text }, alpha) {
  if (!attainable) return text;
  const known = `Calibrated on ${n} demonstrations, which can vouch for ${percent(attainable)} at best`;
  return attainable > alpha ? `${known}: draw more, or allow more.` : `${known}.`;
}

export function startSettings() {
  byId("alpha").max = RATES.length - 1;
  on("changed", show);
  for (const name of CHOSEN) byId(name).addEventListener("change", (event) => send("settings", { [name]: event.target.value }));
  byId("n_basis").addEventListener("input", (event) => setText(byId("n-basis-text"), event.target.value));
  byId("n_basis").addEventListener("change", (event) => send("settings", { n_basis: Number(event.target.value) }));
  byId("use_pressure").addEventListener("change", (event) => send("settings", { use_pressure: event.target.checked }));
  byId("alpha").addEventListener("input", (event) => {
    const alpha = RATES[event.target.value];
    setText(byId("alpha-text"), percent(alpha));
    event.target.setAttribute("aria-valuetext", percent(alpha));
  });
  byId("alpha").addEventListener("change", (event) => send("settings", { alpha: RATES[event.target.value] }));
  byId("open-model").addEventListener("click", () => byId("model").showModal());
}
