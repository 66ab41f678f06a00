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

const list = (items) => (items.length < 2 ? items.join("") : `${items.slice(0, -1).join(", ")} and ${items.at(-1)}`);

/** How each kind of constraint term reads. @type {Object<string, (term: any) => string>} */
const TERMS = {
  rest_position(term) {
    const where = ["x", "y", "z"].filter((axis) => typeof term[axis] === "number").map((axis) => `${axis} = ${number(term[axis])} m`);
    const within = typeof term.tolerance === "number" ? `, within ${number(term.tolerance)} m` : "";
    return `it comes to rest at ${list(where)}${within}`;
  },
  pins: (term) => (term.down?.length ? `pins ${list(term.down.map(String))} go down, and no other` : "every pin stays up"),
  spell: (term) => `the marbles spell “${term.text}”`,
  bins: () => "the marbles fill the marked bins, and no other",
  face_up: (term) => `face ${term.face} ends up`,
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
    const words = TERMS[term.kind]?.(term);
    if (words) return words;
    const { kind, ...rest } = term;
    return `${spaced(kind)} (${Object.entries(rest).map(([key, value]) => `${spaced(key)} ${JSON.stringify(value)}`).join(", ")})`;
  });
  const sentence = list(parts);
  return `${sentence[0].toUpperCase()}${sentence.slice(1)}.`;
}

/** What a tile says of its sample: the first measures. @param {{measures: object}} sample */
export function gist(sample, most = 2) {
  return Object.entries(sample.measures ?? {})
    .slice(0, most)
    .map(([name, value]) => `${spaced(name)} ${number(value, 3)}`)
    .join(" · ");
}
