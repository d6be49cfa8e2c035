// The websocket: messages out, messages and frames in, and coming back after a loss with the same session.

import { emit } from "./bus.js";
import { decodeFrame } from "./frames.js";

const FIRST_WAIT = 500; // ms; doubles up to LONGEST_WAIT
const TAKEN_OVER = 4001; // another page has this session now
const LONGEST_WAIT = 2000;

let socket = null;
let wait = FIRST_WAIT;
let timer = null;

const address = () => {
  const id = sessionStorage.getItem("session");
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  return `${scheme}//${location.host}/ws${id ? `?session=${encodeURIComponent(id)}` : ""}`;
};

function receive(event) {
  if (event.data instanceof ArrayBuffer) {
    emit("frame", decodeFrame(event.data));
    return;
  }
  const message = JSON.parse(event.data);
  if (message.type === "state") sessionStorage.setItem("session", message.session);
  emit(message.type, message);
}

export function connect() {
  clearTimeout(timer);
  socket?.close();
  const opened = new WebSocket(address());
  socket = opened;
  opened.binaryType = "arraybuffer";
  opened.onmessage = receive;
  opened.onopen = () => {
    wait = FIRST_WAIT;
    send("hello");
    emit("connected");
  };
  opened.onclose = ({ code }) => {
    if (opened !== socket) return;
    if (code === TAKEN_OVER) {
      emit("taken_over");
      return;
    }
    emit("disconnected", { wait });
    timer = setTimeout(connect, wait);
    wait = Math.min(2 * wait, LONGEST_WAIT);
  };
}

/** True if it could be sent; a message is never kept for later, as what it refers to may be gone by then. */
export function send(type, fields = {}) {
  if (socket?.readyState !== WebSocket.OPEN) return false;
  socket.send(JSON.stringify({ type, ...fields }));
  return true;
}
