// Numbers and wishes in words.

/** A value as it is read: yes or no, or a number with at most `digits` significant ones. @param {any} value */
export function number(value, digits = 4) {
  if (value === null || value === undefined) return "–";
  if (typeof value === "boolean") return value ? "yes" : "no";
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

/** How a number reads that has this unit; any other unit stands behind it as it is. @type {Object<string, (value: number, digits: number) => string>} */
const UNITS = {
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
  return UNITS[unit]?.(value, digits) ?? `${number(value, digits)} ${unit}`;
}

/** The unit of a variable. Those whose names differ in numbers alone are told once, as "height_#".
 * @param {Object<string, string>|undefined} units @param {string} name */
export const variableUnit = (units, name) => units?.[name.replace(/\d+/g, "#")] ?? "";

const list = (items) => (items.length < 2 ? items.join("") : `${items.slice(0, -1).join(", ")} and ${items.at(-1)}`);

/** A scenario's document as text, its keys in the order in which people think, a list of numbers on one line.
 * @param {object} scenario */
export function documentText({ world, title, model, constraints = [], ...rest }) {
  const ordered = { world, title, model, constraints: constraints.map(({ kind, ...term }) => ({ kind, ...term })), ...rest };
  // Strings hold no line breaks of their own, so this is never inside one.
  return JSON.stringify(ordered, null, 2).replace(/\[\n[-+.,\deE\s]*\]/g, (list) => list.replace(/\s+/g, " ").replace("[ ", "[").replace(" ]", "]"));
}

/** The wish of a scenario as a sentence. @param {{wishes: string[]}} scenario */
export function wish({ wishes }) {
  return wishes?.length ? `${capital(list(wishes))}.` : "No wish: whatever may happen, as often as it may happen.";
}
