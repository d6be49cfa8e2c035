// One small chart: uPlot with the colours of the style sheet, a table-like legend in words, and no time zones.

import uPlot from "../vendor/uplot/uPlot.esm.js";
import { colour } from "./colours.js";
import { make } from "./dom.js";

const axis = (size, extra = {}) => ({
  size,
  stroke: () => colour("--muted"),
  grid: { stroke: () => colour("--line"), width: 1 },
  ticks: { show: false },
  font: "11px system-ui, sans-serif",
  ...extra,
});

/**
 * Lines over time. `series` are {label, color, dash, width, points}; `between` names two of them (from 1) that bound a band.
 * `range` may be a function of (least, greatest) that gives the limits of the vertical axis.
 */
export function makeChart(place, { title, series, between, range, xRange, height = 128 }) {
  const figure = make("figure", { class: "chart" }, make("figcaption", { text: title }));
  const body = make("div");
  figure.append(body);
  place.append(figure);
  const options = {
    width: Math.max(160, figure.clientWidth),
    height,
    legend: { show: false },
    cursor: { show: true, y: false, points: { show: false }, drag: { x: false, y: false } },
    scales: {
      x: { time: false, ...(xRange ? { range: xRange } : {}) },
      y: range ? { range: (_, least, greatest) => range(least, greatest) } : {},
    },
    axes: [axis(26), axis(44)],
    series: [{}, ...series.map(({ label, color, dash, width = 1.5, points = false }) => ({
      label, dash, width, points: { show: points, size: 3 }, spanGaps: false, stroke: () => colour(color),
    }))],
    bands: between ? [{ series: between, fill: () => colour("--tube") }] : [],
    padding: [8, 8, 0, 0],
  };
  const plot = new uPlot(options, [[], ...series.map(() => [])], body);
  new ResizeObserver(() => {
    const width = Math.floor(figure.clientWidth);
    if (width > 0 && width !== plot.width) plot.setSize({ width, height });
  }).observe(figure);
  return {
    set: (data) => plot.setData(data),
    redraw: () => plot.redraw(false, true),
    point: (time) => plot.setCursor({ left: plot.valToPos(time, "x"), top: 0 }),
    remove: () => {
      plot.destroy();
      figure.remove();
    },
  };
}
