// Canvas units (100 wide, 75 high, y up) to pixels and back: the only arithmetic on positions in the page.

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

export const toPixels = ([x, y], scale) => [x * scale, (HEIGHT - y) * scale];

/** Where a pointer event is, in canvas units. */
export function toUnits(event, box) {
  const scale = box.width / WIDTH;
  return [(event.clientX - box.left) / scale, HEIGHT - (event.clientY - box.top) / scale];
}
