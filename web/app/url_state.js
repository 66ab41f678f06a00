// The state of the page, all of it, in the query of its address. Nothing else in the page remembers where it is.

/** How fast the large view can play, times the usual. */
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

const anything = () => true;
const oneOf = (...words) => (value) => words.includes(value);
const isTime = (value) => /\d/.test(value) && Number.isFinite(Number(value)) && Number(value) >= 0;
const isCamera = (value) => {
  const parts = value.split(",");
  return parts.length === 6 && parts.every((part) => part.trim() && Number.isFinite(Number(part))) && Number(parts[2]) > 0;
};

/** Each parameter: what a missing one means, and what else it may say. What only the server can judge may be anything. */
const PARAMETERS = {
  scenario: ["", anything], // id; empty: the first screen
  together: ["", anything], // ids of the scenarios that are shown together, with commas between them
  takes: ["", anything], // ids of the samples shown of them, in their order; empty: fresh ones
  choose: ["", oneOf("on")], // on: the list offers to choose scenarios that are shown together
  tab: ["animations", oneOf("chains")],
  order: ["newest", oneOf("oldest", "likely")],
  play: ["", oneOf("on", "off")], // whether all tiles play; empty: on unless the reader wants less motion
  sample: ["", anything], // id of the sample in the large view
  t: ["", isTime], // its time in seconds where it stands still; empty: it plays
  speed: ["1", oneOf(...SPEEDS.map(String))],
  loop: ["on", oneOf("off")],
  path: ["on", oneOf("off")],
  color: ["", anything], // what the ground is coloured by, a name of the keyframe document; empty: nothing
  camera: ["", isCamera], // azimuth,elevation,distance,x,y,z; empty: framed by itself
  chain: ["", anything], // id of the chain whose trace is drawn; empty: the first
  quantity: ["", anything], // which of its arrays
  quantities: ["worst", oneOf("all")], // which rows of the table of independent values
  start: ["", oneOf("on")], // on: the form that starts chains is open
  create: ["", anything], // name of the world in the open form for a new scenario; "any" for the first
  theme: ["", oneOf("light", "dark")], // empty: as last chosen, else as the system wishes
};
/** @typedef {{[Name in keyof typeof PARAMETERS]: string}} Place */

/** What makes a place another one; every other parameter is a detail of it. */
const WHERE = ["scenario", "together", "choose", "tab", "order", "sample", "start", "create"];

const listeners = new Set();
/** @type {[string, string][]} names and values */
const misread = [];
/** Where a step back is leading just now, with the details to note there. @type {Place|null} */
let returning = null;
let current = read();

/** @returns {Place} */
function read() {
  const query = new URLSearchParams(location.search);
  return Object.fromEntries(Object.entries(PARAMETERS).map(([name, [missing, allows]]) => {
    const value = query.get(name) ?? missing;
    if (value === missing || allows(value)) return [name, value];
    misread.push([name, value]);
    return [name, missing];
  }));
}

/** What the address said that has no meaning, once: names and values. The address no longer says it then. */
export function takeMisread() {
  if (misread.length) history.replaceState(history.state, "", address({}));
  return misread.splice(0);
}

/** The address of the present place with `changes`. @param {Partial<Place>} changes */
export function address(changes) {
  const query = new URLSearchParams();
  for (const [name, value] of Object.entries({ ...current, ...changes })) {
    if (value !== PARAMETERS[name][0]) query.set(name, value);
  }
  const text = query.toString();
  return text ? `/?${text}` : "/";
}

/** @returns {Place} */
export const place = () => current;

/** Goes to another place; the back button comes back. @param {Partial<Place>} changes */
export function go(changes) {
  move(changes, () => history.pushState({ before: current }, "", address(changes)));
}

/** Notes a detail of the present place, without a step in the history. @param {Partial<Place>} changes */
export function settle(changes) {
  move(changes, () => history.replaceState(history.state, "", address(changes)));
}

/**
 * Leaves what lies over the place with `changes`. Where that place was one step ago it goes back there, so that what
 * was closed is not met again on the way back; details that were chosen meanwhile stay.
 * @param {Partial<Place>} changes
 */
export function leave(changes) {
  const there = { ...current, ...changes };
  if (returning || same(there, current, Object.keys(there))) return;
  if (!history.state?.before || !same(there, history.state.before, WHERE)) return settle(changes);
  returning = there;
  history.back();
}

/**
 * Calls `listener(now, before)` whenever the place changes.
 * @param {(now: Place, before: Place) => void} listener @returns {() => void} ends it
 */
export function onPlace(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

const same = (one, other, names) => names.every((name) => one[name] === other[name]);

function move(changes, write) {
  const next = { ...current, ...changes };
  if (same(next, current, Object.keys(next))) return;
  write();
  arrive(next);
}

function arrive(next) {
  const before = current;
  current = next;
  for (const listener of listeners) listener(current, before);
}

addEventListener("popstate", () => {
  const there = returning;
  returning = null;
  arrive(read());
  if (there && same(there, current, WHERE)) settle(there);
});
