// What was learned, over time: mean and two standard deviations of position, velocity, acceleration and forcing term.

import { on } from "./bus.js";
import { makeChart } from "./chart.js";
import { onScheme } from "./colours.js";
import { byId, make } from "./dom.js";
import { band } from "./session.js";
import { tab } from "./tabs.js";

const AXES = ["x", "y", "pressure"];
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

/** The quantity of the tab, as (horizontal values, means, stds). */
function quantity(shown) {
  if (tab === "forcing") return [shown.forcing.phase, shown.forcing.mean, shown.forcing.std];
  const of = tab === "position" ? shown.path : shown[tab];
  return [shown.times, of.mean, of.std];
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
  const [across, means, stds] = quantity(shown);
  const size = means[0].length;
  if (charts.length !== size) {
    clear();
    byId("charts").replaceChildren();
    for (let d = 0; d < size; d++) {
      charts.push(makeChart(byId("charts"), { title: TITLES[tab](AXES[d] ?? d + 1), series: LINES, between: [2, 1] }));
    }
  }
  for (let d = 0; d < size; d++) {
    const [mean, std] = [column(means, d), column(stds, d)];
    const edge = (side) => mean.map((value, k) => value + 2 * side * std[k]);
    const order = across[0] > across.at(-1) ? (values) => [...values].reverse() : (values) => values; // a phase that decays
    charts[d].set([across, edge(-1), edge(1), mean].map(order));
  }
}

export function startBands() {
  on("changed tab", draw);
  onScheme(() => charts.forEach((chart) => chart.redraw()));
}
