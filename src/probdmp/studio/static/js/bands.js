// What was learned, over time: mean and two standard deviations of position, velocity, acceleration and forcing term.

import { on } from "./bus.js";
import { makeChart } from "./chart.js";
import { onScheme } from "./colours.js";
import { byId, make } from "./dom.js";
import { band } from "./session.js";
import { tab } from "./tabs.js";

const TITLES = {
  position: (name, units) => `Position ${name} [${units}] over time [s]`,
  velocity: (name, units) => `Velocity ${name} [${units}/s] over time [s]`,
  acceleration: (name, units) => `Acceleration ${name} [${units}/s²] over time [s]`,
  forcing: (name) => `Forcing term ${name} over the phase`,
};
const LINES = [
  { label: "mean − 2σ", color: "--tube-edge", width: 1 },
  { label: "mean + 2σ", color: "--tube-edge", width: 1 },
  { label: "mean", color: "--accent", width: 2 },
];

let charts = [];
let titles = ""; // of the charts that are shown
let shownTab = null;

/** As many lines as LINES, of one degree of freedom, or of a channel that has but one. */
const lines = ({ lower, upper, mean }, d = 0) => [lower, upper, mean].map((rows) => rows.map((row) => [row].flat()[d]));

/** What the tab shows: a title, and horizontal values with the lines over them, of each chart. */
function panels(shown) {
  const of = tab === "position" ? shown.path : shown[tab];
  const across = tab === "forcing" ? of.phase : shown.times;
  const order = across[0] > across.at(-1) ? (values) => [...values].reverse() : (values) => values; // a phase that decays
  const axes = of.mean[0].map((_, d) => [TITLES[tab](shown.names[d], shown.units || "units"), lines(of, d)]);
  const felt = tab === "position" ? Object.entries(shown.channels ?? {}) : [];
  const channels = felt.map(([name, one]) => [`${name} over time [s]`, lines(one)]);
  return [...axes, ...channels].map(([title, drawn]) => ({ title, data: [across, ...drawn].map(order) }));
}

function clear() {
  for (const chart of charts) chart.remove();
  charts = [];
}

function draw() {
  if (tab === "live") {
    clear();
    shownTab = tab;
    return;
  }
  const shown = band();
  if (shownTab !== tab || !shown) {
    clear();
    byId("charts").replaceChildren();
    shownTab = tab;
  }
  if (!shown) {
    byId("charts").append(make("p", { class: "said", text: "Bands over time appear here, as soon as something is taught." }));
    return;
  }
  const wanted = panels(shown);
  const wantedTitles = JSON.stringify(wanted.map(({ title }) => title));
  if (titles !== wantedTitles || charts.length !== wanted.length) {
    clear();
    byId("charts").replaceChildren();
    charts = wanted.map(({ title }) => makeChart(byId("charts"), { title, series: LINES, between: [2, 1] }));
    titles = wantedTitles;
  }
  wanted.forEach(({ data }, k) => charts[k].set(data));
}

export function startBands() {
  on("changed tab", draw);
  onScheme(() => charts.forEach((chart) => chart.redraw()));
}
