// The unit of a movement to canvas units (100 wide, 75 high, y up), to pixels, and back: the only arithmetic on positions in the page.

export const WIDTH = 100;
export const HEIGHT = 75;

/** A canvas element whose pixels match the screen, with its context in CSS pixels. */
export function fitCanvas(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  const ratio = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, scale: width / WIDTH };
}

const AS_IT_IS = { scale: 1, shift: [0, 0] };
let shown = AS_IT_IS; // where the selected movement, which has a unit of its own, is put

/** All that follows speaks of a movement from this origin; null: drawn on the canvas. */
export const showFrom = (origin) => (shown = origin ?? AS_IT_IS);

export const toCanvas = ([x, y]) => [shown.scale * x + shown.shift[0], shown.scale * y + shown.shift[1]];

/** A thousandth of a canvas unit is noise. */
export function fromCanvas(point) {
  const [x, y] = point.map((value, d) => (Number(value.toFixed(3)) - shown.shift[d]) / shown.scale);
  return shown === AS_IT_IS ? [x, y] : [x, y].map((value) => Number(value.toPrecision(8)));
}

export const canvasToPixels = ([x, y], scale) => [x * scale, (HEIGHT - y) * scale];

export const toPixels = (point, scale) => canvasToPixels(toCanvas(point), scale);

/** A length in pixels. */
export const lengthToPixels = (length, scale) => length * shown.scale * scale;

/** Where a pointer event is. */
export function toUnits(event, box) {
  const scale = box.width / WIDTH;
  return fromCanvas([(event.clientX - box.left) / scale, HEIGHT - (event.clientY - box.top) / scale]);
}
