// An execution as recorded, as the filter had it while it went on, and in hindsight: over time, with two standard deviations.

import { makeChart } from "./chart.js";

const LINES = [
  { label: "smoothed − 2σ", color: "--tube-edge", width: 1 },
  { label: "smoothed + 2σ", color: "--tube-edge", width: 1 },
  { label: "smoothed", color: "--accent", width: 2 },
  { label: "filtered", color: "--muted", dash: [6, 4] },
  { label: "recorded", color: "--ink", dash: [1, 3] },
];

/** A chart for each degree of freedom, in `place`. */
export function makeCompared(place, { times, recorded, filtered, smoothed }) {
  return recorded[0].map((_, d) => {
    const title = `${"xy"[d] ?? d + 1}: recorded (dotted), filtered (dashed), smoothed with its band; over time [s]`;
    const chart = makeChart(place, { title, series: LINES, between: [2, 1], height: 170 });
    const lines = [smoothed.lower, smoothed.upper, smoothed.mean, filtered.mean, recorded];
    chart.set([times, ...lines.map((rows) => rows.map((row) => row[d]))]);
    return chart;
  });
}
