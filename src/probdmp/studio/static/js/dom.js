// Elements from plain values. Text is always text: nothing here parses HTML, so names from files and people cannot become markup.

export const byId = (id) => document.getElementById(id);

/** A new element; `attributes` may hold text, listeners ("onclick") and anything setAttribute takes. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name === "text") element.textContent = value;
    else if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

/** Options of a select become `choices`, [value, text] each, keeping what was chosen where it is still there. */
export function setChoices(select, choices) {
  const wanted = JSON.stringify(choices);
  if (select.dataset.choices === wanted) return;
  const chosen = select.value;
  select.replaceChildren(...choices.map(([value, text]) => make("option", { value, text })));
  select.dataset.choices = wanted;
  if (choices.some(([value]) => value === chosen)) select.value = chosen;
}

/** Text that changes only when it differs, so that screen readers do not repeat it. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const SVG = "http://www.w3.org/2000/svg";

/** A stroke as a small picture; places are (x, y) in canvas units. */
export function thumbnail(places) {
  const svg = document.createElementNS(SVG, "svg");
  const [xs, ys] = [places.map(([x]) => x), places.map(([, y]) => 75 - y)];
  const [left, top] = [Math.min(...xs) - 3, Math.min(...ys) - 3];
  svg.setAttribute("viewBox", `${left} ${top} ${Math.max(...xs) + 3 - left} ${Math.max(...ys) + 3 - top}`);
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS(SVG, "polyline");
  line.setAttribute("vector-effect", "non-scaling-stroke");
  line.setAttribute("points", places.map(([x, y]) => `${x},${75 - y}`).join(" "));
  svg.append(line);
  return svg;
}
