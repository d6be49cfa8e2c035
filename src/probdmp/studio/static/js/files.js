// Files in, by dropping them anywhere or by choosing them; files out, as links.

import { emit, on } from "./bus.js";
import { byId, make } from "./dom.js";
import { session, strokesOf } from "./session.js";
import { send } from "./socket.js";

const LARGEST = 64 * 1024 * 1024;
const FETCHED = 60000; // ms after which a file that was saved is surely on its way to the disk
const DOWNLOADS = [
  ["demonstrations.npz", "demonstrations, as probdmp and NumPy read them; those from files in their own unit and place"],
  ["demonstrations.csv", "demonstrations, for spreadsheets"],
  ["model.probdmp", "what was learned, with its failure detector"],
  ["picture.svg", "the band as a picture that scales"],
  ["picture.png", "the band as a picture"],
  ["session.zip", "all of these that there are, with the commands"],
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

const describe = (labels) => Object.entries(labels ?? {}).map(([name, count]) => `${name} (${count || "learned"})`).join(", ");

/** Saves a file; what the server says against it is shown, which a plain link would hide. */
async function download(name) {
  try {
    const reply = await fetch(`/download/${session.id}/${name}`);
    if (!reply.ok) throw (await reply.json()).error;
    const link = make("a", { href: URL.createObjectURL(await reply.blob()), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), FETCHED);
  } catch (error) {
    byId("files").close(); // it would cover what is said
    const lost = { expected: "an answer of the server", got: "none", hint: `${name} was not saved: is the server still running?` };
    emit("error", error.expected ? error : lost);
  }
}

function saved([name, what]) {
  const missing = name.startsWith("picture") ? session.state.pictures_missing : "";
  const link = make("a", missing ? { role: "link", "aria-disabled": "true", text: name } : { href: `/download/${session.id}/${name}`, download: name, text: name });
  link.addEventListener("click", (event) => {
    event.preventDefault();
    if (!missing) download(name);
  });
  return make("li", {}, link, ` ${what}${missing && `. ${missing}`}`);
}

/** Forgets what came from a file: recordings, and letters that there were none of before. */
function takeBack({ labels, first }) {
  for (const [label, count] of Object.entries(labels)) {
    if (first[label] === 0 && strokesOf(label).length === count) send("delete_label", { label });
    else for (let k = first[label] + count - 1; k >= first[label]; k -= 1) send("delete_stroke", { label, index: k });
  }
}

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
    byId("downloads").replaceChildren(...DOWNLOADS.map(saved));
    byId("files").showModal();
  });
  on("uploaded", ({ name, execution, imported }) => {
    const note = imported?.note ? ` ${imported.note}` : "";
    const taught = Object.values(imported?.labels ?? {}).some(Boolean);
    const use = execution ? " as executions to replay" : taught ? " as demonstrations" : "";
    const undo = execution ? {} : { action: "Undo", act: () => takeBack(imported) };
    emit("toast", { text: `${name} was opened${use}: ${describe(imported?.labels)}.${note}`, stays: Boolean(note), ...undo });
  });
}
