// The layer of the canvas that changes with every frame: the ink under the pointer, the pen, its trail and where it may be.

import { on } from "./bus.js";
import { colour } from "./colours.js";
import { byId } from "./dom.js";
import { fitCanvas, toPixels } from "./geometry.js";
import { stroke } from "./paper.js";
import { session } from "./session.js";

const board = { ink: [], trail: [], frame: null, alarm: null, pull: null, mark: null };
let asked = false;

/** Draws at the next frame of the screen, once, however often it is asked. */
function refresh() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    draw();
  });
}

/** Changes what is shown: ink and trail are paths, pull is where the pointer is, mark is a point of a replay. */
export function show(changes) {
  Object.assign(board, changes);
  refresh();
}

function drawPen(context, scale, frame) {
  const tone = colour(frame.failed ? "--alarm" : "--accent");
  const [x, y] = toPixels(frame.desired, scale);
  const [right, top] = toPixels(frame.upper, scale);
  context.beginPath();
  context.ellipse(x, y, Math.max(2, right - x), Math.max(2, y - top), 0, 0, 2 * Math.PI);
  context.fillStyle = colour("--tube");
  context.fill();
  context.strokeStyle = tone;
  context.lineWidth = 1.5;
  context.stroke();
  dot(context, toPixels(frame.measured, scale), 6.5, tone);
}

/** Where it was noticed: a cross, so that it is not told by colour alone. */
function drawAlarm(context, [x, y]) {
  context.strokeStyle = colour("--alarm");
  context.lineWidth = 3;
  context.beginPath();
  for (const side of [-1, 1]) {
    context.moveTo(x - 11, y - 11 * side);
    context.lineTo(x + 11, y + 11 * side);
  }
  context.stroke();
}

function dot(context, [x, y], radius, color) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
}

function draw() {
  const { context, scale } = fitCanvas(byId("ink"));
  if (board.ink.length > 1) stroke(context, board.ink.map(([, x, y]) => [x, y]), scale, { color: colour("--ink"), width: 2.5 });
  if (board.trail.length > 1) stroke(context, board.trail, scale, { color: colour("--ink"), width: 2.5 });
  if (board.pull && board.frame) {
    stroke(context, [board.frame.measured, board.pull], scale, { color: colour("--alarm"), width: 1.5, dash: [4, 4] });
    dot(context, toPixels(board.pull, scale), 4, colour("--alarm"));
  }
  if (board.frame?.kind === "playing") drawPen(context, scale, board.frame);
  if (board.alarm) drawAlarm(context, toPixels(board.alarm, scale));
  if (board.mark) dot(context, toPixels(board.mark, scale), 6.5, colour("--accent"));
}

export function startBoard() {
  on("playing", () => show({ trail: [], ink: [], frame: null, alarm: null, mark: null }));
  on("frame", (frame) => {
    if (frame.kind === "playing" && session.mode !== "play") return; // it is being stopped
    if (frame.kind === "playing") board.trail.push(frame.measured.slice(0, 2));
    if (frame.kind === "playing" && frame.failed) board.alarm ??= frame.measured;
    show({ frame });
  });
  on("played", () => show({ pull: null, frame: null }));
  on("mode", () => show({ ink: [], trail: [], frame: null, alarm: null, pull: null, mark: null }));
  on("changed", () => show({}));
  new ResizeObserver(refresh).observe(byId("board"));
}
