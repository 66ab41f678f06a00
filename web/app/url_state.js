// The state of the page, all of it, in the query of its address. Nothing else in the page remembers where it is.

/** What a missing parameter means. */
const DEFAULTS = {
  scenario: "", // id; empty: the first of the list
  together: "", // ids of the scenarios that are shown together, with commas between them
  takes: "", // ids of the samples shown of them, in their order; empty: fresh ones
  choose: "", // on: the list offers to choose scenarios that are shown together
  tab: "animations", // animations | chains
  order: "newest", // newest | oldest | likely
  play: "", // on | off: whether all tiles play; empty: on unless the reader wants less motion
  sample: "", // id of the sample in the large view
  t: "", // its time in seconds where it stands still; empty: it plays
  speed: "1",
  loop: "on",
  path: "on",
  color: "", // what the ground is coloured by, a name of the keyframe document; empty: nothing
  camera: "", // azimuth,elevation,distance,x,y,z; empty: framed by itself
  chain: "", // id of the chain whose trace is drawn; empty: the first
  quantity: "", // which of its arrays
  quantities: "worst", // worst | all: which rows of the table of independent values
  start: "", // on: the form that starts chains is open
  create: "", // name of the world in the open form for a new scenario; "any" for the first
  theme: "", // light | dark; empty: as last chosen, else as the system wishes
};
/** @typedef {typeof DEFAULTS} Place */

const listeners = new Set();
let current = read();

/** @returns {Place} */
function read() {
  const query = new URLSearchParams(location.search);
  return Object.fromEntries(Object.entries(DEFAULTS).map(([key, value]) => [key, query.get(key) ?? value]));
}

/** The address of the present place with `changes`. @param {Partial<Place>} changes */
export function address(changes) {
  const query = new URLSearchParams();
  for (const [key, value] of Object.entries({ ...current, ...changes })) {
    if (value !== DEFAULTS[key]) query.set(key, value);
  }
  const text = query.toString();
  return text ? `/?${text}` : "/";
}

/** @returns {Place} */
export const place = () => current;

/** Goes to another place; the back button comes back. @param {Partial<Place>} changes */
export function go(changes) {
  move(changes, "pushState");
}

/** Notes a detail of the present place, without a step in the history. @param {Partial<Place>} changes */
export function settle(changes) {
  move(changes, "replaceState");
}

/**
 * Calls `listener(now, before)` whenever the place changes.
 * @param {(now: Place, before: Place) => void} listener @returns {() => void} ends it
 */
export function onPlace(listener) {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

function move(changes, method) {
  const next = { ...current, ...changes };
  if (Object.keys(next).every((key) => next[key] === current[key])) return;
  history[method](null, "", address(changes));
  arrive(next);
}

function arrive(next) {
  const before = current;
  current = next;
  for (const listener of listeners) listener(current, before);
}

addEventListener("popstate", () => arrive(read()));
