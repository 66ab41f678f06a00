// Numbers and wishes in words.

/** A value as it is read: yes or no, a list, or a number with at most `digits` significant ones. @param {any} value */
export function number(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (Array.isArray(value)) return value.length ? value.map((each) => number(each, digits)).join(", ") : "none";
  if (typeof value !== "number") return String(value);
  if (value !== 0 && (Math.abs(value) < 1e-5 || Math.abs(value) >= 1e6)) return value.toExponential(Math.min(digits, 3) - 1);
  return String(Number(value.toPrecision(digits)));
}

/** @param {number} value */
export const count = (value) => Math.round(value).toLocaleString("en-US");

/** How many a second. @param {number} value */
export const pace = (value) => (value < 1000 ? number(value, 3) : count(Number(value.toPrecision(3))));

/** @param {number} part @param {number} whole */
export const percent = (part, whole) => (whole > 0 ? `${number((100 * part) / whole, part / whole < 0.1 ? 2 : 3)} %` : "–");

/** @param {number} value [s] */
export function seconds(value) {
  if (value === null || value === undefined) return "–";
  if (value < 0.001) return "under 1 ms";
  if (value < 1) return `${Math.round(value * 1000)} ms`;
  if (value < 120) return `${value.toFixed(value < 10 ? 2 : 1)} s`;
  return `${Math.floor(value / 60)} min ${Math.round(value % 60)} s`;
}

/** "rest_x" as people read it: "rest x". @param {string} name */
export const spaced = (name) => name.replaceAll("_", " ");

/** "friction" as a title: "Friction". @param {string} text */
export const capital = (text) => `${text[0].toUpperCase()}${text.slice(1)}`;

const degrees = (value) => `${((180 * value) / Math.PI).toFixed(1)}°`;
const unit = (name, scale = 1) => (value) => `${number(value * scale, 3)} ${name}`;

/** How a measure reads whose name ends like this; any other is a bare number. @type {Object<string, (value: number) => string>} */
const UNITS = { speed: unit("m/s"), angle: degrees, offset: unit("cm", 100), contact: unit("s"), time: unit("s"), miss: unit("mm", 1000) };
/** What a second wish of a kind says: "miss_2". */
const AGAIN = /_\d+$/;

function unitOf(name) {
  const last = name.replace(AGAIN, "").split("_").at(-1);
  return Object.hasOwn(UNITS, last) ? UNITS[last] : null;
}

/** The value of a measure with the unit that its name tells of. @param {string} name @param {any} value */
export const measure = (name, value, digits = 4) => (typeof value === "number" && unitOf(name)?.(value)) || number(value, digits);

const list = (items) => (items.length < 2 ? items.join("") : `${items.slice(0, -1).join(", ")} and ${items.at(-1)}`);

const metres = (place) => `(${place.map((value) => number(value)).join(", ")}) m`;

/** What a term is about. @param {{body?: string}} term */
const bodyOf = (term) => (term.body ? spaced(term.body) : "it");

/** Between whom a contact is. @param {{body: string, with?: string}} contact */
function meeting(contact) {
  const [one, other] = [contact.body ?? "any", contact.with ?? "any"];
  if (one === "any" && other === "any") return "a contact";
  if (one === "any" || other === "any") return `a contact of ${spaced(one === "any" ? other : one)}`;
  return `a contact of ${spaced(one)} and ${spaced(other)}`;
}

/** An event of an order. @param {{kind: string, body: string, with?: string}} event */
function happening(event) {
  if (event.kind === "contact") return event.with && event.with !== "any" ? `${spaced(event.body)} touches ${spaced(event.with)}` : `${spaced(event.body)} touches something`;
  return `${spaced(event.body)} ${event.kind === "rest" ? "comes to rest" : "falls"}`;
}

/** How each kind of constraint term reads. @type {Object<string, (term: any, model: any) => string>} */
const TERMS = {
  rest_position(term) {
    const where = ["x", "y", "z"].filter((axis) => typeof term[axis] === "number").map((axis) => `${axis} = ${number(term[axis])} m`);
    const within = typeof term.tolerance === "number" ? `, within ${number(term.tolerance)} m` : "";
    return `${bodyOf(term)} comes to rest at ${list(where)}${within}`;
  },
  state_at(term) {
    const place = term.position?.length ? ` is at ${metres(term.position)}` : "";
    const speed = term.velocity?.length ? ` moves by ${metres(term.velocity)}/s` : "";
    return `${bodyOf(term)}${place}${place && speed ? " and" : ""}${speed} after ${number(term.time)} s`;
  },
  contact_at(term) {
    const within = typeof term.tolerance === "number" ? `, within ${seconds(term.tolerance)}` : "";
    if (term.times?.length) return `there is ${meeting(term)} at ${list(term.times.map((time) => `${number(time)} s`))}${within}`;
    const all = meeting(term).replace(/^a contact/, "every contact");
    return `${all} is on the beat, ${number(term.bpm)} a minute${within}`;
  },
  order: ({ events = [] }) => events.map(happening).join(", then "),
  inside(term) {
    const box = term.box ? ` between ${metres(term.box.low)} and ${metres(term.box.high)}` : " in its box";
    const until = term.to < 3600 ? ` to ${number(term.to)} s` : " on";
    return `${bodyOf(term)} stays${box}${term.from > 0 || term.to < 3600 ? ` from ${number(term.from ?? 0)} s${until}` : ""}`;
  },
  pins({ down = [] }, { rack = [] }) {
    const stay = rack.filter((pin) => !down.includes(pin));
    const pins = (some) => `${some.length === 1 ? "pin" : "pins"} ${list(some.map(String))}`;
    const one = (some, verb) => (some.length === 1 ? `${verb}s` : verb);
    if (!down.length) return "every pin stays up";
    if (!stay.length) return down.length > 2 ? `all ${down.length} pins go down` : `${pins(down)} ${down.length === 1 ? "goes" : "go"} down`;
    if (stay.length <= down.length) return `${pins(stay)} ${one(stay, "stay")} up, and every other goes down`;
    return `${pins(down)} ${down.length === 1 ? "goes" : "go"} down, and no other`;
  },
  spell: (term) => `the marbles spell “${term.text}”`,
  total: (term) => `the dice show ${term.sum} together`,
  bins: () => "the marbles fill the marked bins, and no other",
  face_up: (term) => `${term.body ? `${spaced(term.body)} shows` : "it shows"} face ${term.face}`,
};

/** A scenario's document as text, its keys in the order in which people think, a list of numbers on one line.
 * @param {object} scenario */
export function documentText({ world, title, model, constraints = [], ...rest }) {
  const ordered = { world, title, model, constraints: constraints.map(({ kind, ...term }) => ({ kind, ...term })), ...rest };
  // Strings hold no line breaks of their own, so this is never inside one.
  return JSON.stringify(ordered, null, 2).replace(/\[\n[-+.,\deE\s]*\]/g, (list) => list.replace(/\s+/g, " ").replace("[ ", "[").replace(" ]", "]"));
}

/** The wish of a scenario as a sentence. @param {{constraints: object[]}} scenario */
export function wish(scenario) {
  if (!scenario.constraints?.length) return "No wish: whatever may happen, as often as it may happen.";
  const parts = scenario.constraints.map((term) => {
    const words = TERMS[term.kind]?.(term, scenario.model ?? {});
    if (words) return words;
    const { kind, ...rest } = term;
    return `${spaced(kind)} (${Object.entries(rest).map(([key, value]) => `${spaced(key)} ${JSON.stringify(value)}`).join(", ")})`;
  });
  return `${capital(list(parts))}.`;
}

/** What a wish or a duration says already. */
const SAID = new Set(["active_balls", "filled_bins", "stray_balls", "settling_time", "face"]);

/** What a tile says of its sample: the first measures that are numbers, those with a unit before all others. A word
 * that a name begins with like the one before it is not said again.
 * @param {{measures: object}} sample */
export function gist(sample, most = 2) {
  const numbers = Object.entries(sample.measures ?? {}).filter(([name, value]) => typeof value === "number" && !SAID.has(name) && !AGAIN.test(name));
  const rank = ([name]) => (unitOf(name) ? Object.values(UNITS).indexOf(unitOf(name)) : Infinity);
  return numbers
    .sort((a, b) => (rank(a) === rank(b) ? 0 : rank(a) - rank(b)))
    .slice(0, most)
    .map(([name, value], at, all) => {
      const [first, ...rest] = name.split("_");
      const again = rest.length && at > 0 && all[at - 1][0].split("_")[0] === first;
      return `${again ? rest.join(" ") : spaced(name)} ${measure(name, value, 3)}`;
    })
    .join(" · ");
}

/** How a number reads that has this unit; any other unit stands behind it as it is. @type {Object<string, (value: number, digits: number) => string>} */
const TOLD_UNITS = {
  m: (value, digits) => scaled(value, digits, [[0.01, 1000, "mm"], [1, 100, "cm"]], "m"),
  s: (value, digits) => scaled(value, digits, [[0.1, 1000, "ms"]], "s"),
  rad: (value, digits) => `${number((180 * value) / Math.PI, digits)}°`,
  "rad/s": (value, digits) => `${number((180 * value) / Math.PI, digits)} °/s`,
};

/** In the first of some smaller units below whose limit the value is, given as [limit, factor, name]. */
function scaled(value, digits, smaller, usual) {
  const [, factor, name] = smaller.find(([limit]) => value !== 0 && Math.abs(value) < limit) ?? [0, 1, usual];
  return `${number(value * factor, digits)} ${name}`;
}

/** A value or a list of them with its unit, as the server tells it: 0.0216 "s" is "21.6 ms". @param {any} value @param {string} [unit] */
export function quantity(value, unit = "", digits = 4) {
  if (Array.isArray(value)) return value.length ? value.map((each) => quantity(each, unit, digits)).join(", ") : "none";
  if (!unit || typeof value !== "number") return number(value, digits);
  return TOLD_UNITS[unit]?.(value, digits) ?? `${number(value, digits)} ${unit}`;
}

