// The server's one stream of events, and whether the server is there at all.
// The stream rests while the page is hidden, because browsers share few connections among all tabs.

/** @typedef {"connecting"|"live"|"asking"|"gone"} Connection asking: the server is there but has no stream to spare */

const RETRY_SECONDS = [1, 1, 2, 4, 8];
const KINDS = ["chain", "scenario", "scenario-deleted", "samples"];
const listeners = Object.fromEntries([...KINDS, "connection", "resync"].map((kind) => [kind, new Set()]));

let source = null;
let retry = 0;
let attempt = 0;
let missed = false;
/** @type {Connection} */
let connection = "connecting";

/**
 * `chain`, `scenario`, `scenario-deleted` and `samples` give the event's data, `connection` a Connection; `resync`
 * says that events may have been missed and everything shown should be asked for again.
 * @param {string} kind @param {(data: any) => void} listener
 * @returns {() => void} ends it
 */
export function on(kind, listener) {
  listeners[kind].add(listener);
  return () => listeners[kind].delete(listener);
}

function tell(kind, data) {
  for (const listener of listeners[kind]) listener(data);
}

function become(next) {
  if (next === connection) return;
  connection = next;
  tell("connection", next);
}

function connect() {
  clearTimeout(retry);
  source?.close();
  source = new EventSource("/v1/events");
  source.addEventListener("open", () => {
    attempt = 0;
    become("live");
    if (missed) tell("resync");
    missed = true;
  });
  for (const kind of KINDS) source.addEventListener(kind, (event) => tell(kind, JSON.parse(event.data)));
  source.addEventListener("error", lose);
}

async function lose({ target }) {
  target.close();
  missed = true;
  const there = await fetch("/healthz", { cache: "no-store" }).then((answer) => answer.ok, () => false);
  if (target !== source) return;
  become(there ? "asking" : "gone");
  if (there) tell("resync");
  const seconds = RETRY_SECONDS[Math.min(attempt++, RETRY_SECONDS.length - 1)];
  retry = setTimeout(connect, seconds * 1000);
}

/** Connects, and keeps connecting. */
export function startLive() {
  document.addEventListener("visibilitychange", () => {
    if (document.hidden) {
      clearTimeout(retry);
      source?.close();
      source = null;
    } else if (!source) {
      connect();
    }
  });
  addEventListener("pagehide", () => source?.close());
  addEventListener("online", connect);
  if (!document.hidden) connect();
}
