// The letters that are taught, and the strokes of the one that is selected.

import { emit, on } from "./bus.js";
import { byId, make, setChoices, setText, thumbnail } from "./dom.js";
import { toCanvas } from "./geometry.js";
import { again } from "./ink.js";
import { originOf, selected, session, strokesOf } from "./session.js";
import { send } from "./socket.js";

let renaming = null; // the label whose name is being written

function renameForm(name) {
  const input = make("input", { value: name, maxlength: 40, "aria-label": `New name of ${name}` });
  const form = make("form", { class: "rename" }, input, make("button", { text: "Rename" }));
  const done = () => {
    renaming = null;
    drawLabels();
  };
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (input.value.trim() && input.value !== name) send("rename_label", { label: name, to: input.value.trim() });
    done();
  });
  form.addEventListener("keydown", (event) => {
    if (event.key === "Escape") done();
  });
  queueMicrotask(() => input.select());
  return form;
}

function labelRow({ name, strokes, learned }) {
  if (renaming === name) return make("li", {}, renameForm(name));
  const chosen = name === selected();
  const taught = `${strokes.length} stroke${strokes.length === 1 ? "" : "s"}${learned ? ", learned" : ""}`;
  const count = learned && !strokes.length ? "learned from a file" : taught;
  const choose = make("button", { type: "button", class: "label", "aria-pressed": String(chosen), onclick: () => send("select", { label: name }) },
    make("span", { class: "name", text: name }), make("span", { class: "count", text: count }));
  const row = make("li", { "data-label": name }, choose);
  if (chosen) {
    row.append(make("div", { class: "row" },
      make("button", { type: "button", class: "quiet", text: "Rename", "aria-label": `Rename ${name}`, onclick: () => {
        renaming = name;
        drawLabels();
      } }),
      make("button", { type: "button", class: "quiet", text: "Delete", "aria-label": `Delete ${name} and its strokes`, onclick: () => deleteLabel(name) })));
  }
  return row;
}

function deleteLabel(name) {
  const [strokes, origin] = [strokesOf(name), originOf(name)];
  send("delete_label", { label: name });
  if (!strokes.length) return;
  const undo = () => strokes.forEach(({ points }) => send("stroke", { label: name, points: again(points), origin }));
  emit("toast", { text: `${name} is deleted.`, action: "Undo", act: undo });
}

function deleteStroke(label, index) {
  const { points } = strokesOf(label)[index];
  send("delete_stroke", { label, index });
  const origin = originOf(label);
  const undo = () => send("stroke", { label, points: again(points), origin });
  emit("toast", { text: `Stroke ${index + 1} of ${label} is deleted.`, action: "Undo", act: undo });
}

function drawLabels() {
  byId("labels").replaceChildren(...session.state.labels.map(labelRow));
}

function drawStrokes() {
  const label = selected();
  const strokes = strokesOf(label);
  setText(byId("strokes-title"), strokes.length ? `Strokes of ${label}` : "Strokes");
  byId("strokes").replaceChildren(...strokes.map(({ points, duration }, index) => make("li", {},
    thumbnail(points.map(([, x, y]) => toCanvas([x, y]))),
    make("span", { text: `${duration.toFixed(1)} s` }),
    make("button", { type: "button", class: "remove", text: "×", title: "Delete this stroke", "aria-label": `Delete stroke ${index + 1} of ${label}`,
      onclick: () => deleteStroke(label, index) }))));
}

/** Focus stays where it was when the list is drawn again. */
function keepFocus(draw) {
  const name = document.activeElement?.getAttribute("aria-label") ?? document.activeElement?.closest("[data-label]")?.dataset.label;
  const inside = byId("library").contains(document.activeElement);
  draw();
  if (!inside || !name) return;
  const again = [...byId("library").querySelectorAll("button")];
  (again.find((one) => one.getAttribute("aria-label") === name) ?? again.find((one) => one.closest("[data-label]")?.dataset.label === name))?.focus();
}

export function startLibrary() {
  let drawn = null;
  on("changed", () => {
    if (drawn === session.state) return;
    drawn = session.state;
    keepFocus(() => {
      drawLabels();
      drawStrokes();
    });
    setChoices(byId("example"), session.state.examples.map((name) => [name, name]));
  });
  byId("add-label").addEventListener("submit", (event) => {
    event.preventDefault();
    const name = byId("new-label").value.trim();
    if (!name) return;
    send("add_label", { label: name });
    byId("new-label").value = "";
  });
  byId("add-example").addEventListener("submit", (event) => {
    event.preventDefault();
    if (byId("example").value) send("example", { name: byId("example").value });
  });
}
