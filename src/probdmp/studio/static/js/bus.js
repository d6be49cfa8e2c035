// Who wants to know of what: messages of the server by their type, and a few events of the page itself.

const listeners = new Map();

/** Calls `listener` with the message whenever one of `types` (separated by spaces) arrives. */
export function on(types, listener) {
  for (const type of types.split(" ")) {
    if (!listeners.has(type)) listeners.set(type, []);
    listeners.get(type).push(listener);
  }
}

export function emit(type, message = {}) {
  for (const listener of listeners.get(type) ?? []) listener(message);
}
