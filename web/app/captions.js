// What tells one animation of a scenario from the next, in words: what happens in it, and those of its measures that
// differ most among the animations that are known. What all have in common is the scenario's, and is not said. Knows
// neither elements nor requests, nor the name of any measure.
import { quantity, spaced } from "./words.js";

const MOST = 2; // measures in a caption
const LONGEST = 18; // letters of a value that is read at a glance
const SAME = 0.02; // a time so near the duration says nothing new, as a share of it
const ENOUGH = 48; // animations that decide which measures tell them apart, so that later ones change no caption
const KEPT = 6; // scenarios that are remembered
/** What a second wish of a kind says: "miss_2". */
const AGAIN = /_\d+$/;

/** @typedef {{gist: string, more: string}} Caption the one thing to know, and what else differs; either may be empty */

export class Captions {
  #samples = new Map();
  #stories = new Map(); // what happens, and at how many frames a second it was seen
  #meanings = [];
  #chosen = null;
  #listeners = new Set();

  /** @param {import("./types.js").MeasureMeaning[]} measures in the order in which the world tells them */
  mean(measures) {
    this.#meanings = measures;
    this.#change();
  }

  /** @param {import("./types.js").Sample[]} samples */
  admit(samples) {
    const fresh = samples.filter(({ id }) => !this.#samples.has(id));
    for (const sample of fresh) this.#samples.set(sample.id, sample);
    if (fresh.length) this.#change();
  }

  /** What was seen at more frames a second takes the place of what was seen at fewer, whichever comes first.
   * @param {string} id @param {import("./story.js").Happening[]} story @param {number} [rate] frames a second */
  witness(id, story, rate = 0) {
    if (this.#stories.get(id)?.rate >= rate) return;
    this.#stories.set(id, { story, rate });
    this.#change();
  }

  /** Calls `listener` when captions may have changed, once for many changes. @param {() => void} listener
   * @returns {() => void} ends it */
  onChange(listener) {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }

  /** @param {string} id @returns {Caption} */
  of(id) {
    const sample = this.#samples.get(id);
    if (!sample) return { gist: "", more: "" };
    this.#chosen ??= { kind: this.#tellingKind(), measures: this.#tellingMeasures() };
    const { kind, measures } = this.#chosen;
    const story = this.#stories.get(id)?.story.find((happening) => happening.kind === kind)?.words ?? "";
    const told = measures.map(({ name, read }, at) => says(sample.measures?.[name], name, read, measures[at - 1]?.name)).filter(Boolean);
    const all = [story, ...told].filter(Boolean);
    return story ? { gist: story, more: told.join(" · ") } : { gist: all.join(" · "), more: "" };
  }

  #change() {
    this.#chosen = null;
    this.later ??= setTimeout(() => {
      this.later = null;
      for (const listener of this.#listeners) listener();
    }, 60);
  }

  /** The first kind of happening that is not the same in all animations seen so far. */
  #tellingKind() {
    const seen = new Map();
    for (const { story } of this.#stories.values()) for (const { kind, words } of story) seen.set(kind, (seen.get(kind) ?? new Set()).add(words));
    return [...seen].find(([, words]) => words.size > 1)?.[0];
  }

  /** The measures whose values differ most, in the order in which they are told. */
  #tellingMeasures() {
    const samples = [...this.#samples.values()].slice(0, ENOUGH);
    const meanings = this.#meanings.length ? this.#meanings : Object.keys(samples[0].measures ?? {}).map((name) => ({ name, unit: "" }));
    const names = new Set(meanings.map(({ name }) => name));
    const isAgain = ({ name }) => AGAIN.test(name) && names.has(name.replace(AGAIN, ""));
    const isDuration = ({ name, unit }) => unit === "s" && samples.every((sample) => Math.abs(sample.measures?.[name] - sample.duration) < SAME * sample.duration);
    // A list is read element by element, not at a glance.
    const usable = meanings.filter((meaning) => meaning.kind !== "list" && !isAgain(meaning) && !isDuration(meaning));
    // One alone is like no other: it says what comes first.
    const read = usable.map(({ name, unit }, at) => {
      const values = samples.map(({ measures }) => measures?.[name]);
      return { name, at, values, read: readerOf(values, unit) };
    });
    if (samples.length < 2) return read.filter(({ values: [value] }) => typeof value === "number").slice(0, MOST);
    return read
      .map((measure) => ({ ...measure, spread: spreadOf(measure) }))
      .filter(({ spread }) => spread > 0)
      .sort((one, other) => other.spread - one.spread)
      .slice(0, MOST)
      .sort((one, other) => one.at - other.at);
  }
}

/** How the values of a measure are read: all to the place to which the largest has two digits.
 * @param {import("./types.js").Measure[]} values @param {string} unit @returns {(value: import("./types.js").Measure) => string} */
function readerOf(values, unit) {
  const parts = (text) => text.match(/^(-?[\d.]+)(.*)$/)?.slice(1) ?? ["", ""];
  const largest = Math.max(...values.map((value) => (typeof value === "number" ? Math.abs(value) : 0)));
  const [digits, name] = parts(quantity(largest, unit, 2));
  const places = digits.split(".")[1]?.length ?? 0;
  return (value) => {
    if (typeof value !== "number") return quantity(value, unit, 2);
    const [number, its] = parts(quantity(value, unit, 6));
    // A smaller unit has places of its own.
    return its === name && !Number.isInteger(value) ? `${Number(Number(number).toFixed(places))}${its}` : quantity(value, unit, Number.isInteger(value) ? 6 : 2);
  };
}

/** How much values differ, from 0 (not as they are read) to 2: their range in parts of the largest.
 * @param {{values: import("./types.js").Measure[], read: (value: import("./types.js").Measure) => string}} measure */
function spreadOf({ values, read }) {
  const texts = values.map(read);
  if (new Set(texts).size < 2 || texts.some((text) => text.length > LONGEST)) return 0;
  const numbers = values.filter((value) => typeof value === "number");
  if (numbers.length < values.length) return 1;
  const [low, high] = [Math.min(...numbers), Math.max(...numbers)];
  return (high - low) / Math.max(Math.abs(low), Math.abs(high));
}

/** A measure in words, on one line. A word that a name begins with like the one before it is not said again; of what is
 * so or not, only that it is so. */
function says(value, name, read, before) {
  if (value === null || value === undefined || value === false) return "";
  const [first, ...rest] = name.split("_");
  const words = rest.length && before?.split("_")[0] === first ? rest.join(" ") : spaced(name);
  return (value === true ? words : `${words} ${read(value)}`).replaceAll(" ", "\u00a0");
}

/** @type {Map<string, Captions>} by scenario, the one asked for last at the end */
const known = new Map();

/** The captions of a scenario, which its gallery and the large view share. @param {string} scenario id */
export function captionsOf(scenario) {
  const captions = known.get(scenario) ?? new Captions();
  known.delete(scenario);
  known.set(scenario, captions);
  for (const id of known.keys()) if (known.size > KEPT) known.delete(id);
  return captions;
}
