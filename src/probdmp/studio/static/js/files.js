// Files in, by dropping them anywhere or by choosing them; files out, as links.

import { emit, on } from "./bus.js";
import { byId, make } from "./dom.js";
import { session } from "./session.js";

const LARGEST = 64 * 1024 * 1024;
const DOWNLOADS = [
  ["demonstrations.npz", "demonstrations, as probdmp and NumPy read them"],
  ["demonstrations.csv", "demonstrations, for spreadsheets"],
  ["model.probdmp", "what was learned, with its failure detector"],
  ["picture.svg", "the band as a picture that scales"],
  ["picture.png", "the band as a picture"],
  ["session.zip", "all of these, with the commands"],
];

async function upload(file, execution) {
  if (file.size > LARGEST) {
    emit("error", { expected: "a file of at most 64 MB", got: `${file.name}, which is larger`, hint: "probdmp reads it from the command line" });
    return;
  }
  const query = new URLSearchParams({ name: file.name, ...(execution ? { as: "execution" } : {}) });
  try {
    const reply = await fetch(`/upload/${session.id}?${query}`, { method: "POST", body: file });
    const answer = await reply.json();
    if (reply.ok) emit("uploaded", { name: file.name, execution, ...answer });
    else emit("error", answer.error);
  } catch {
    emit("error", { expected: "an answer of the server", got: "none", hint: `${file.name} was not opened: is the server still running?` });
  }
}

async function openAll(files, execution) {
  for (const file of files) await upload(file, execution);
}

const describe = (labels) => Object.entries(labels ?? {}).map(([name, count]) => `${name} (${count})`).join(", ");

function startDropping() {
  const zone = byId("dropzone");
  let depth = 0;
  const carriesFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  addEventListener("dragenter", (event) => {
    if (!carriesFiles(event)) return;
    depth += 1;
    zone.hidden = false;
  });
  addEventListener("dragleave", () => {
    depth = Math.max(0, depth - 1);
    if (!depth) zone.hidden = true;
  });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    depth = 0;
    zone.hidden = true;
    openAll([...(event.dataTransfer?.files ?? [])], session.mode === "replay");
  });
}

export function startFiles() {
  startDropping();
  for (const [id, execution] of [["file", false], ["file-execution", true]]) {
    byId(id).addEventListener("change", async (event) => {
      byId("files").close();
      await openAll([...event.target.files], execution);
      event.target.value = "";
    });
  }
  byId("open-files").addEventListener("click", () => {
    const links = DOWNLOADS.map(([name, what]) => make("li", {},
      make("a", { href: `/download/${session.id}/${name}`, download: name, text: name }), ` ${what}`));
    byId("downloads").replaceChildren(...links);
    byId("files").showModal();
  });
  on("uploaded", ({ name, execution, imported }) => {
    emit("toast", { text: `${name} was opened: ${describe(imported?.labels)}${execution ? ", to replay" : ""}.` });
  });
}
