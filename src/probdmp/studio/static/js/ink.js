// Strokes from mouse, pen and touch: every sample that the device made, with its own time and, where there is one, its pressure.

import { toUnits } from "./geometry.js";

const SHORTEST = 0.5; // ms: two samples of one time would have no speed
const MOST = 6000; // points of one message

/** Digits beyond a tenth of a millisecond, and of a pressure, are noise. */
const rounded = (value, digits) => Number(value.toFixed(digits));

/** Every second point, as often as it takes for a stroke to fit into one message: the server takes a hundred a second. */
export function fitting(points) {
  return points.length <= MOST ? points : fitting(points.filter((_, k) => k % 2 === 0));
}

/** Mice report 0.5 whatever happens. */
const pressureOf = (event) => (event.pointerType === "mouse" ? null : rounded(event.pressure, 4));

/** Without pressure where it never varied: then the device does not feel it. */
export function felt(points) {
  return points.some((point) => point[3] !== points[0][3]) ? points : points.map(([t, x, y]) => [t, x, y, null]);
}

/** A stroke that the server has shown, as it is sent to be taught again. */
export const again = (points) => points.map(([t, x, y, pressure = null]) => [t, x, y, pressure]);

/**
 * Follows one pointer at a time on `surface`: begin(points, event), then move(new points, event), then end(all points, event).
 * Points are (seconds from the first, x, y, pressure or null). `begin` may return false to leave the pointer alone.
 */
export function followPointer(surface, { begin, move, end }) {
  let pointer = null;
  let box = null;
  let points = [];
  let first = 0;

  const sample = (event) => {
    const previous = points.at(-1);
    const time = (event.timeStamp - first) / 1000;
    if (previous && time < previous[0] + SHORTEST / 1000) return null;
    const point = [rounded(time, 4), ...toUnits(event, box), pressureOf(event)];
    points.push(point);
    return point;
  };

  surface.addEventListener("pointerdown", (event) => {
    if (pointer !== null || event.button !== 0) return;
    box = surface.getBoundingClientRect();
    points = [];
    first = event.timeStamp;
    sample(event);
    if (begin(points, event) === false) return;
    pointer = event.pointerId;
    surface.setPointerCapture(pointer);
    event.preventDefault();
  });
  surface.addEventListener("pointermove", (event) => {
    if (event.pointerId !== pointer) return;
    const events = event.getCoalescedEvents?.() ?? [];
    const fresh = (events.length ? events : [event]).map(sample).filter(Boolean);
    if (fresh.length) move(fresh, event);
  });
  const finish = (event) => {
    if (event.pointerId !== pointer) return;
    pointer = null;
    end(points, event);
  };
  surface.addEventListener("pointerup", finish);
  surface.addEventListener("pointercancel", finish);
}
