// What the detector sees, as it happens: log-likelihood, test ratio against its threshold, contribution of each degree of freedom.

import { on } from "./bus.js";
import { makeChart } from "./chart.js";
import { makeCompared } from "./compared.js";
import { onScheme } from "./colours.js";
import { byId, make, setText } from "./dom.js";
import { band } from "./session.js";
import { showTab, tab } from "./tabs.js";

const ROOM = 6; // the vertical axis of the test ratio ends here, so that the threshold stays in sight
const DASHES = [undefined, [6, 4], [2, 3]];
const TONES = ["--accent", "--ink", "--muted"];

let names = ["x", "y"];
let threshold = 1;
let duration = 1;
let seen = empty();
let charts = [];
let compared = null; // shown in the place of streams, if it was asked for last
let tally = { first: 0, frames: 0, dropped: 0, last: null };
let asked = false;

function empty() {
  return { times: [], logLikelihood: [], testRatio: [], contributions: [] };
}

const finite = (value) => (Number.isFinite(value) ? value : null);

function clear() {
  for (const chart of charts) chart.remove();
  charts = [];
}

function build() {
  clear();
  const place = byId("charts");
  place.replaceChildren();
  if (compared) {
    charts = makeCompared(place, compared);
    return;
  }
  const xRange = () => [0, Math.max(duration, seen.times.at(-1) ?? 0)];
  charts = [
    makeChart(place, {
      title: "Test ratio over time [s]; above the dashed line is an alarm", xRange, height: 130,
      series: [{ label: "threshold", color: "--alarm", dash: [8, 5] }, { label: "test ratio", color: "--accent", width: 2 }],
      range: (_, greatest) => [0, Math.min(ROOM, Math.max(1.5, 1.1 * (greatest ?? 0)))],
    }),
    makeChart(place, { title: "Log-likelihood per sample", xRange, height: 104, series: [{ label: "log-likelihood", color: "--accent" }] }),
    makeChart(place, {
      title: `Contribution of ${names.map((name, d) => `${name} (${["solid", "dashed", "dotted"][d] ?? "solid"})`).join(", ")}`,
      xRange, height: 104, series: names.map((name, d) => ({ label: name, color: TONES[d % 3], dash: DASHES[d % 3] })),
    }),
  ];
  place.append(make("p", { id: "tally", class: "said" }));
  draw();
}

function draw() {
  if (tab !== "live" || !charts.length || compared) return;
  charts[0].set([seen.times, seen.times.map(() => threshold), seen.testRatio]);
  charts[1].set([seen.times, seen.logLikelihood]);
  charts[2].set([seen.times, ...names.map((_, d) => seen.contributions.map((row) => finite(row[d])))]);
  const isSlow = tally.dropped > 0.1 * tally.frames;
  setText(byId("tally"), isSlow ? `${tally.dropped} of ${tally.frames + tally.dropped} moments left out: the connection is slow.` : "");
}

function refresh() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    draw();
  });
}

let sequence = null; // of the last frame

function count(frame) {
  const time = performance.now();
  if (tally.frames === 0) tally.first = time;
  else tally.dropped += Math.max(0, frame.sequence - sequence - 1);
  sequence = frame.sequence;
  tally.frames += 1;
  tally.last = time;
}

function add(frame) {
  count(frame);
  if (seen.times.length && frame.time <= seen.times.at(-1)) return;
  seen.times.push(frame.time);
  seen.logLikelihood.push(finite(frame.logLikelihood));
  seen.testRatio.push(finite(frame.testRatio));
  seen.contributions.push(frame.contributions);
  refresh();
}

function open() {
  if (tab === "live") build();
  else showTab("live");
}

function begin(message) {
  names = message.names ?? names;
  threshold = message.threshold ?? 1;
  duration = message.duration ?? 1;
  compared = null;
  seen = empty();
  tally = { first: 0, frames: 0, dropped: 0, last: null };
  open();
}

/** How many frames came since playing began, how many were left out, and for how long (ms): read by benchmarks/studio.py. */
export const tallied = () => ({ ...tally });

/** Points at a moment of a replay. */
export function pointAt(time) {
  if (compared) {
    compared = null;
    open();
  }
  for (const chart of charts) chart.point(time);
}

export function startStreams() {
  on("playing", begin);
  on("tracing", ({ label }) => label && begin({ duration: band()?.times.at(-1) }));
  on("frame", add);
  on("replayed", (message) => {
    begin({ ...message, duration: message.times.at(-1), threshold: 1 });
    seen = {
      times: message.times,
      logLikelihood: message.log_likelihoods.map(finite),
      testRatio: message.times.map((_, k) => finite(message.test_ratios?.[k])),
      contributions: message.contributions,
    };
    draw();
  });
  on("compared", (message) => {
    compared = message;
    open();
  });
  on("tab", () => (tab === "live" ? build() : clear()));
  onScheme(() => charts.forEach((chart) => chart.redraw()));
}
