// The layer of the canvas that changes seldom: grid, demonstrations, the tube and the mean path.

import { on } from "./bus.js";
import { colour, onScheme } from "./colours.js";
import { byId } from "./dom.js";
import { canvasToPixels, fitCanvas, HEIGHT, lengthToPixels, toPixels, WIDTH } from "./geometry.js";
import { band, selected, session, strokesOf } from "./session.js";

let overlay = null; // recorded, filtered and smoothed, or a replayed path

export function trace(context, points, scale) {
  context.beginPath();
  let begun = false; // a missing sample leaves a gap
  for (const point of points) {
    const [x, y] = toPixels(point, scale);
    if (!Number.isFinite(x + y) || point[0] === null) begun = false;
    else if (begun) context.lineTo(x, y);
    else {
      context.moveTo(x, y);
      begun = true;
    }
  }
}

export function stroke(context, points, scale, { color, width, dash = [], alpha = 1 }) {
  context.save();
  Object.assign(context, { strokeStyle: color, lineWidth: width, lineJoin: "round", lineCap: "round", globalAlpha: alpha });
  context.setLineDash(dash);
  trace(context, points, scale);
  context.stroke();
  context.restore();
}

function drawGrid(context, scale) {
  context.fillStyle = colour("--dot");
  for (let x = 12.5; x < WIDTH; x += 12.5) {
    for (let y = 12.5; y < HEIGHT; y += 12.5) context.fillRect(...canvasToPixels([x, y], scale), 1.5, 1.5);
  }
}

/** One shape from an outline of points, or from ellipses (x, y, radius, radius, angle) laid over one another. */
function drawTube(context, tube, scale) {
  if (!tube?.length) return;
  context.beginPath();
  for (const part of tube) {
    const [x, y] = toPixels(part, scale);
    if (part.length < 5) context.lineTo(x, y);
    else {
      const [, , rx, ry, angle] = part;
      context.moveTo(x, y);
      context.ellipse(x, y, lengthToPixels(rx, scale), lengthToPixels(ry, scale), -angle, 0, 2 * Math.PI);
    }
  }
  context.fillStyle = colour("--tube");
  context.fill();
}

/** What is asked for, faintly, while nothing is drawn. */
function drawWish(context, scale) {
  context.save();
  Object.assign(context, { fillStyle: colour("--dot"), globalAlpha: 0.55, textAlign: "center", textBaseline: "middle" });
  context.font = `italic 300 ${46 * scale}px Georgia, "Times New Roman", serif`;
  context.fillText(selected(), ...canvasToPixels([WIDTH / 2, HEIGHT / 2 + 3], scale), 80 * scale);
  context.restore();
}

function drawEnds(context, mean, scale) {
  const [start, goal] = [toPixels(mean[0], scale), toPixels(mean.at(-1), scale)];
  context.fillStyle = colour("--accent");
  context.beginPath();
  context.arc(...start, 4, 0, 2 * Math.PI);
  context.fill();
  context.fillRect(goal[0] - 4, goal[1] - 4, 8, 8);
}

function describe(shown, strokes) {
  const count = `${strokes.length} stroke${strokes.length === 1 ? "" : "s"} of ${selected()}`;
  const taught = strokes.length ? count : `${selected()}, learned from a file`;
  return shown ? `${taught}; the mean path with its band of two standard deviations` : strokes.length ? taught : "Empty canvas";
}

const OVERLAYS = {
  smoothed: { color: "--tube-edge", width: 6 },
  filtered: { color: "--muted", width: 2, dash: [7, 5] },
  recorded: { color: "--ink", width: 1.75, dash: [1, 4] },
};

function drawOverlay(context, scale) {
  for (const [name, look] of Object.entries(OVERLAYS)) {
    const path = overlay[name]?.mean ?? overlay[name];
    if (path) stroke(context, path, scale, { ...look, color: colour(look.color) });
  }
}

export function drawPaper() {
  const { context, scale } = fitCanvas(byId("paper"));
  drawGrid(context, scale);
  const shown = band();
  const strokes = strokesOf(selected());
  if (!shown && !strokes.length && session.mode === "teach") drawWish(context, scale);
  if (shown) drawTube(context, shown.tube, scale);
  const isReplay = overlay !== null && session.mode === "replay";
  for (const { points } of isReplay ? [] : strokes) {
    const look = { color: colour("--ink"), width: 1.25, alpha: shown ? 0.2 : 0.75 };
    stroke(context, points.map(([, x, y]) => [x, y]), scale, look);
  }
  if (shown) {
    stroke(context, shown.path.mean, scale, { color: colour("--accent"), width: isReplay ? 1 : 2.5, alpha: isReplay ? 0.5 : 1 });
    drawEnds(context, shown.path.mean, scale);
  }
  if (isReplay) drawOverlay(context, scale);
  byId("legend").hidden = !(isReplay && overlay.smoothed);
  byId("paper").setAttribute("aria-label", describe(shown, strokes));
}

export function startPaper() {
  on("changed mode", drawPaper);
  on("band", measureBand);
  on("compared", (message) => setOverlay(message));
  on("replayed", (message) => setOverlay({ recorded: message.positions }));
  onScheme(drawPaper);
  new ResizeObserver(drawPaper).observe(byId("board"));
}

export function setOverlay(paths) {
  overlay = paths;
  drawPaper();
}

/** From the end of a stroke to its band on the screen, for whoever measures (benchmarks/studio.py). */
function measureBand() {
  if (!performance.getEntriesByName("stroke").length) return;
  requestAnimationFrame(() => {
    performance.measure("stroke-to-band", "stroke");
    performance.clearMarks("stroke");
  });
}
