// What was learned, over time: mean and two standard deviations of position, velocity, acceleration and forcing term.

import { on } from "./bus.js";
import { makeChart } from "./chart.js";
import { onScheme } from "./colours.js";
import { byId, make } from "./dom.js";
import { band } from "./session.js";
import { tab } from "./tabs.js";

const AXES = ["x", "y"];
const TITLES = {
  position: (name) => `Position ${name} [units] over time [s]`,
  velocity: (name) => `Velocity ${name} [units/s] over time [s]`,
  acceleration: (name) => `Acceleration ${name} [units/s²] over time [s]`,
  forcing: (name) => `Forcing term ${name} over the phase`,
};
const LINES = [
  { label: "mean − 2σ", color: "--tube-edge", width: 1 },
  { label: "mean + 2σ", color: "--tube-edge", width: 1 },
  { label: "mean", color: "--accent", width: 2 },
];

let charts = [];
let shownTab = null;

const column = (rows, d) => rows.map((row) => row[d]);

/** What the tab shows: a title, horizontal values, means and stds of each chart. */
function panels(shown) {
  const of = tab === "position" ? shown.path : shown[tab];
  const across = tab === "forcing" ? of.phase : shown.times;
  const order = across[0] > across.at(-1) ? (values) => [...values].reverse() : (values) => values; // a phase that decays
  const axes = of.mean[0].map((_, d) => [TITLES[tab](AXES[d]), column(of.mean, d), column(of.std, d)]);
  const felt = tab === "position" ? Object.entries(shown.channels ?? {}) : [];
  const channels = felt.map(([name, { mean, std }]) => [`${name} over time [s]`, mean.flat(), std.flat()]);
  return [...axes, ...channels].map(([title, mean, std]) => ({ title, across: order(across), mean: order(mean), std: order(std) }));
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
  if (charts.length !== wanted.length) {
    clear();
    byId("charts").replaceChildren();
    charts = wanted.map(({ title }) => makeChart(byId("charts"), { title, series: LINES, between: [2, 1] }));
  }
  wanted.forEach(({ across, mean, std }, k) => {
    const edge = (side) => mean.map((value, i) => value + 2 * side * std[i]);
    charts[k].set([across, edge(-1), edge(1), mean]);
  });
}

export function startBands() {
  on("changed tab", draw);
  onScheme(() => charts.forEach((chart) => chart.redraw()));
}
