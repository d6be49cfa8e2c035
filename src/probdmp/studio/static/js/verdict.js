// The verdict in words: what, where, since when, and which letter fits better. A sign goes with every colour.

import { on } from "./bus.js";
import { byId, make } from "./dom.js";

const SIGNS = { watching: "◌", fine: "✓", failed: "✕" };

function card(kind, headline, rows = [], more = []) {
  const place = byId("verdict");
  place.dataset.kind = kind;
  const known = rows.filter(([, value]) => value !== null && value !== undefined && value !== "");
  place.replaceChildren(
    make("p", { class: "headline" }, ...(SIGNS[kind] ? [make("span", { class: "sign", "aria-hidden": "true", text: SIGNS[kind] })] : []), headline),
    make("dl", {}, ...known.flatMap(([name, value]) => [make("dt", { text: name }), make("dd", { text: value })])),
    ...more,
  );
}

let duration = null; // seconds that the movement takes undisturbed

const when = (time) => {
  if (time === null || time === undefined) return null;
  const share = duration ? `, ${Math.round((100 * time) / duration)} % of the way` : "";
  return `${time.toFixed(2)} s${share}`;
};

const SIDES = { "−x": "x, to the left", "+x": "x, to the right", "−y": "y, downwards", "+y": "y, upwards" };

/** Signs are sides on a canvas. */
const where = (blamed) => [blamed ?? []].flat().map((name) => SIDES[name] ?? name).join("; ");

function show(verdict) {
  if (!verdict.failed) {
    card("fine", "As taught", [["", verdict.text]]);
    return;
  }
  const place = byId("verdict");
  Object.assign(place.dataset, { time: verdict.time ?? "", share: duration && verdict.time ? verdict.time / duration : "" });
  card("failed", "Something is wrong", [
    ["What", [verdict.kind, verdict.cause].filter(Boolean).join(": ")],
    ["Where", where(verdict.blamed)],
    ["Since", when(verdict.time)],
    ["Fits better", verdict.better],
  ], [make("p", { class: "said", text: verdict.text })]);
}

/** Log density per sample of each letter, the likeliest first. */
function showScores({ label, scores }) {
  const ranked = Object.entries(scores).sort(([, a], [, b]) => b - a);
  const [best, worst] = [ranked[0]?.[1], ranked.at(-1)?.[1]];
  const rows = ranked.slice(0, 6).map(([name, score]) => {
    const meter = make("meter", { min: Math.min(worst, best - 1), max: best, value: score, "aria-label": `${name}: ${score.toFixed(1)} nats per sample` });
    return make("li", { class: name === label ? "best" : null }, make("span", { text: name }), meter, make("span", { text: score.toFixed(1) }));
  });
  byId("scores").hidden = false;
  byId("scores").replaceChildren(make("p", { class: "headline", text: `Looks like ${label}` }), make("ol", {}, ...rows));
}

export function startVerdict() {
  on("playing", (message) => {
    duration = message.duration;
    card("watching", "Watching …");
  });
  on("tracing", ({ label }) => {
    duration = null;
    if (label) card("watching", "Watching …");
    else card("none", "Without a letter to score it as, there is no verdict.");
  });
  on("mode", ({ mode }) => (byId("scores").hidden ||= mode !== "trace"));
  on("verdict", show);
  on("recognised", showScores);
  on("replayed", ({ times, verdict }) => {
    duration = times.at(-1);
    if (verdict) show(verdict);
  });
  on("changed", () => {
    if (!byId("verdict").childElementCount) card("none", "What the detector says will stand here.");
  });
}
