// Where a movement begins and ends, what it passes, and how long it takes: handles on the canvas, by pointer and by keyboard.

import { on } from "./bus.js";
import { byId, make, setText } from "./dom.js";
import { fromCanvas, HEIGHT, toCanvas, toUnits, WIDTH } from "./geometry.js";
import { band, selected, session } from "./session.js";
import { send } from "./socket.js";

const STEP = 1; // canvas units that an arrow key moves; five times as many with Shift
const PATIENCE = 1000; // ms until an answer is given up for lost
const ARROWS = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };

const nothing = () => ({ start: null, goal: null, via: [], duration: null });
let task = nothing();
let asked = 0; // when the task was sent that has no answer yet; 0 if there is none
let newer = false;

/** The newest task is sent when the one before is answered, so that dragging never queues. */
function sendTask() {
  if (asked && performance.now() - asked < PATIENCE) {
    newer = true;
    return;
  }
  newer = false;
  asked = performance.now();
  send("task", { ...task, label: selected() });
}

function answered() {
  asked = 0;
  if (newer) sendTask();
}

const within = ([x, y]) => [Math.min(WIDTH, Math.max(0, x)), Math.min(HEIGHT, Math.max(0, y))];
const short = (value) => String(Number(value.toPrecision(3)));
const sampleAt = (path, phase) => path[Math.round(phase * (path.length - 1))];

/** The handles that there are: a key, a name for people, where it is, and what moving or removing it does. */
function handles() {
  const mean = band().path.mean;
  const ends = [["start", "Start", mean[0]], ["goal", "Goal", mean.at(-1)]].map(([key, name, learned]) => ({
    key, name, at: task[key] ?? learned, move: (to) => (task[key] = to), remove: () => (task[key] = null),
  }));
  const via = task.via.map(([phase, x, y], k) => ({
    key: `via-${k}`, name: `Via-point ${k + 1}`, at: [x, y],
    move: (to) => (task.via[k] = [phase, ...to]), remove: () => task.via.splice(k, 1),
  }));
  return [...ends, ...via];
}

function place(button, { name, at }) {
  const [[x, y], [left, bottom]] = [at, toCanvas(at)];
  button.style.left = `${(left / WIDTH) * 100}%`;
  button.style.top = `${(1 - bottom / HEIGHT) * 100}%`;
  button.setAttribute("aria-label", `${name} at ${short(x)}, ${short(y)}; arrow keys move it`);
  button.title = `${name}: drag it, or use the arrow keys`;
}

const now = (key) => handles().find((one) => one.key === key);

function makeHandle(key) {
  const button = make("button", { type: "button", class: "handle", "data-key": key });
  const moveTo = (to) => {
    now(key).move(fromCanvas(within(to)));
    place(button, now(key));
    sendTask();
  };
  button.addEventListener("pointerdown", (event) => {
    button.setPointerCapture(event.pointerId);
    event.stopPropagation();
  });
  button.addEventListener("pointermove", (event) => {
    if (button.hasPointerCapture(event.pointerId)) moveTo(toCanvas(toUnits(event, byId("board").getBoundingClientRect())));
  });
  button.addEventListener("keydown", (event) => {
    const by = ARROWS[event.key];
    const gone = event.key === "Delete" || event.key === "Backspace";
    if (!by && !gone) return;
    event.preventDefault();
    if (gone) {
      now(key).remove();
      sendTask();
      drawHandles();
      return;
    }
    const [x, y] = toCanvas(now(key).at);
    const far = event.shiftKey ? 5 : 1;
    moveTo([x + far * by[0], y + far * by[1]]);
  });
  return button;
}

function drawHandles() {
  const group = byId("handles");
  const shown = band() && session.mode === "play" && !session.playing ? handles() : [];
  const known = new Map([...group.children].map((button) => [button.dataset.key, button]));
  for (const one of shown) {
    if (!known.has(one.key)) group.append(makeHandle(one.key));
    place(group.querySelector(`[data-key="${one.key}"]`), one);
  }
  for (const [key, button] of known) if (!shown.some((one) => one.key === key)) button.remove();
}

function drawVia() {
  const rows = task.via.map(([phase], k) => {
    const name = make("output", { text: `${Math.round(100 * phase)} %` });
    const range = make("input", { type: "range", min: 0.02, max: 0.98, step: 0.02, value: phase, "aria-label": `When it passes via-point ${k + 1}` });
    range.addEventListener("input", () => {
      task.via[k][0] = Number(range.value);
      setText(name, `${Math.round(100 * task.via[k][0])} %`);
      sendTask();
    });
    const remove = make("button", { type: "button", class: "quiet", text: "Remove", "aria-label": `Remove via-point ${k + 1}`, onclick: () => {
      task.via.splice(k, 1);
      sendTask();
      drawVia();
      drawHandles();
    } });
    return make("div", { class: "via" }, `Via-point ${k + 1} after `, name, range, remove);
  });
  byId("via-list").replaceChildren(...rows);
}

/** A further via-point lies on the path where none is yet: half-way, then a quarter, … */
function addVia() {
  const phase = [0.5, 0.25, 0.75, 0.4, 0.6].find((one) => !task.via.some(([taken]) => taken === one));
  if (phase === undefined || !band()) return;
  task.via.push([phase, ...sampleAt(band().path.mean, phase).slice(0, 2)]);
  sendTask();
  drawVia();
  drawHandles();
  byId("handles").lastElementChild?.focus();
}

function showDuration(seconds) {
  setText(byId("duration-text"), `${seconds.toFixed(2)} s`);
  byId("duration").value = seconds;
}

function adopt(from) {
  task = from ? { start: from.start, goal: from.goal, via: from.via ?? [], duration: from.duration } : nothing();
}

export function startTask() {
  let shown = null; // session and letter that the handles belong to
  on("band", (message) => {
    if (message.label !== selected()) return;
    answered();
    if (!document.activeElement?.matches("#duration")) showDuration(message.times.at(-1));
  });
  on("changed mode playing played", () => {
    const key = `${session.id} ${selected()}`;
    if (shown !== key) {
      shown = key;
      adopt(session.state.task);
      drawVia();
    }
    if (band()) byId("duration").disabled = false;
    drawHandles();
  });
  byId("add-via").addEventListener("click", addVia);
  byId("duration").addEventListener("input", (event) => {
    task.duration = Number(event.target.value);
    showDuration(task.duration);
    sendTask();
  });
  byId("reset-task").addEventListener("click", () => {
    task = nothing();
    sendTask();
    drawVia();
    drawHandles();
  });
}
