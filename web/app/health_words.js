// How a scenario fares, in words: how rare its wish is, how many animations are independent, how long it takes.
import { count, number, percent, spaced } from "./words.js";

export const AGREEING_RHAT = 1.05;
const COMMON = 1 / 100;
const OFTEN = 0.2; // from here on a share reads better than "1 in"

/** What draws from the prior are called. @param {import("./types.js").World|undefined} world */
export const triesOf = (world) => (world?.try ?? "try").replace(/(?<![aeiou])y$/, "ie").replace(/$/, "s");

const rounded = (value, digits) => (value < 10 ? number(value, digits) : count(Number(value.toPrecision(digits))));

/** As "1 in 1,500". @param {number} probability */
const oneIn = (probability, digits = 2) => `1 in ${rounded(1 / probability, digits)}`;

/** How many digits tell an estimate from the ends of its interval; two where they need no more. */
function digitsOf({ probability, low, high }) {
  const figures = (digits) => [probability, low, high].map((each) => Number((1 / each).toPrecision(digits)));
  return [2, 3].find((digits) => new Set(figures(digits)).size === 3) ?? 4;
}

const rarerThan = (times) => `rarer than 1 in ${rounded(times, 2)}`;

function oftenInWords(probability, tries, digits = 2) {
  if (probability > 0.995) return `Nearly all ${tries}`;
  return probability >= OFTEN ? `${percent(probability, 1)} of all ${tries}` : `${oneIn(probability, digits)} ${tries}`;
}

/**
 * How often chance satisfies the wish: "1 in 1,500 throws", its 95 % interval: "1,200 to 1,900".
 * @param {import("./types.js").Odds} odds @param {string} tries
 * @returns {{often: string, interval: string}} no interval without a hit
 */
export function oddsInWords(odds, tries) {
  const { probability, low, high, draws } = odds;
  if (!(probability > 0)) return { often: `Nothing yet in ${count(draws)} ${tries}: ${rarerThan(1 / high)}`, interval: "" };
  if (probability >= OFTEN) return { often: oftenInWords(probability, tries), interval: `${number(100 * low, 3)} to ${percent(Math.min(1, high), 1)}` };
  const digits = digitsOf(odds);
  return { often: oftenInWords(probability, tries, digits), interval: `${rounded(1 / high, digits)} to ${low > 0 ? rounded(1 / low, digits) : "anything"}` };
}

const BASIS = {
  learned: ({ draws, hits }) => `From ${count(draws)} draws near what was found, ${count(hits)} of them hits, each weighted by how likely chance is to make it.`,
  rejection: ({ draws, hits }, tries) => `From ${count(draws)} plain ${tries}, ${count(hits)} of them ${hits === 1 ? "a hit" : "hits"}.`,
  ladder: () => "Estimated over a ladder of ever stricter wishes; a rough figure.",
};

/** How the odds are known. @param {import("./types.js").Odds} odds @param {string} tries */
export const basisInWords = (odds, tries) => (odds.probability > 0 && BASIS[odds.basis]?.(odds, tries)) || "";

/** The odds that a first look at plain tries gives: a point, without an interval of its own.
 * @param {import("./types.js").Difficulty} difficulty @param {string} tries
 * @param {number} [samples] what chains have found @returns {string} */
export function difficultyInWords({ one_in, at_least, draws }, tries, samples = 0) {
  if (one_in === null && samples > 0) return `Rarer than 1 in ${rounded(at_least, 2)} ${tries}`;
  if (one_in === null) return `Nothing yet in ${count(draws)} ${tries}: ${rarerThan(at_least)}`;
  return oftenInWords(1 / one_in, tries);
}

/** Where that is known from. @param {import("./types.js").Difficulty} difficulty @param {string} tries
 * @param {boolean} guided whether there is a chain that its world guides @returns {string[]} sentences */
export function difficultyNotes({ draws, hits }, tries, guided) {
  const look = hits ? `From a first look at ${count(draws)} plain ${tries}.` : `A first look at ${count(draws)} plain ${tries} saw none.`;
  return guided ? [look, "The chains build up what is wished for, so they cannot tell how rare chance makes it."] : [look];
}

/**
 * One word for how rare a wish is, from the best that is known, and the odds behind it.
 * @param {import("./types.js").Scenario} scenario @param {string} tries
 * @returns {{word: string, odds: string}|null} null while nothing is known
 */
export function rarityOf({ odds, difficulty, samples }, tries) {
  if (odds?.probability > 0) {
    const { often, interval } = oddsInWords(odds, tries);
    return { word: odds.probability >= COMMON ? "Common" : "Rare", odds: `${often}, ${interval}` };
  }
  if (difficulty?.hits > 0) return { word: difficulty.verdict === "common" ? "Common" : "Rare", odds: difficultyInWords(difficulty, tries) };
  const limit = odds ? 1 / odds.high : difficulty?.at_least;
  const draws = odds ? odds.draws : difficulty?.draws;
  if (limit === undefined) return null;
  // What only a chain has found is no longer nothing.
  if (samples > 0) return { word: "Very rare", odds: `none in ${count(draws)} plain ${tries}, ${rarerThan(limit)}` };
  return { word: "Nothing yet", odds: `none in ${count(draws)} ${tries}, ${rarerThan(limit)}` };
}

/** A stretch of time as one says it. @param {number} seconds */
export function spanInWords(seconds) {
  if (seconds < 0.1) return "less than 0.1 s";
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 90 * 60) return `${Math.round(seconds / 60)} min`;
  if (seconds < 36 * 3600) return `${Math.round(seconds / 3600)} hours`;
  if (seconds < 400 * 86400) return `${Math.round(seconds / 86400)} days`;
  return "more than a year";
}

/** @param {import("./types.js").Diagnostics["effective"]} effective */
export function independenceInWords(effective) {
  if (!effective) return "Too early to tell";
  const samples = Math.max(1, effective.samples);
  return `About ${count(samples < 100 ? samples : Number(samples.toPrecision(2)))} independent ${Math.round(samples) === 1 ? "animation" : "animations"}`;
}

/**
 * What stands below the number of independent animations.
 * @param {import("./types.js").Diagnostics} diagnostics
 * @param {string} [busy] with what chains are busy before what they find counts, if there are such
 * @returns {string[]} sentences
 */
export function independenceNotes({ effective, chains }, busy = "") {
  if (!effective) return [busy ? `Chains are still ${busy}; what they find meanwhile is shown, but does not count.` : "It takes a few animations from a chain that has found its way."];
  const notes = [];
  if (chains < 2) notes.push("From one chain alone, which claims too much. Start more to be sure.");
  else if (effective.within > 1.05 * effective.samples) notes.push(`Judged each by itself, the chains would claim ${count(effective.within)}. That is too much: only what they agree on counts.`);
  notes.push(`Held back most by ${spaced(effective.quantity)}.`);
  if (effective.per_cpu_minute > 0) notes.push(`${rounded(effective.per_cpu_minute, 2)} independent animations per CPU minute.`);
  return notes;
}

/**
 * Whether the chains agree, by the largest R-hat.
 * @param {import("./types.js").Diagnostics} diagnostics @returns {{words: string, agree: boolean, rhat: number}|null}
 */
export function agreementOf({ quantities, chains }) {
  const rhat = Math.max(...quantities.map((quantity) => quantity.rhat ?? -Infinity));
  if (!Number.isFinite(rhat)) return null;
  const agree = rhat <= AGREEING_RHAT;
  if (chains < 2) return { words: agree ? "The chain agrees with itself" : "Still finding its way", agree, rhat };
  return { words: agree ? "The chains agree" : "Still finding their way", agree, rhat };
}

/** @param {import("./types.js").Diagnostics} diagnostics */
export function timeInWords({ first_sample, eta_seconds }) {
  if (first_sample) return `Found the first after ${spanInWords(first_sample.seconds)}`;
  return typeof eta_seconds === "number" ? `Perhaps ${spanInWords(eta_seconds)} more` : "None found yet";
}

/** @param {import("./types.js").Diagnostics} diagnostics @param {boolean} [searching] whether a chain is under way
 * @returns {string[]} sentences */
export function timeNotes({ first_sample, eta_seconds, saved }, searching = false) {
  const notes = [];
  if (!first_sample && typeof eta_seconds === "number") notes.push("Until the first, at the present pace and judging by what was tried so far.");
  if (!first_sample && typeof eta_seconds !== "number") notes.push(searching ? "A chain is building the first one up." : "No chain is searching.");
  if (saved?.share > 0.005) notes.push(`Stopping early and resuming saved ${percent(saved.share, 1)} of the simulated time.`);
  return notes;
}

/** Whether a chain is guided by its world: it builds its first animation up, and does not learn.
 * @param {import("./types.js").Chain} chain */
export const isGuided = ({ guided }) => guided === true;

/** With what chains are busy before what they find counts. @param {import("./types.js").Chain[]} chains */
export function busyInWords(chains) {
  const early = chains.filter(({ phase }) => phase === "exploring");
  if (!early.length) return "";
  return early.every(isGuided) ? "burning in" : "learning";
}

/** What a chain that is under way is doing. @param {import("./types.js").Chain} chain */
export function phaseInWords(chain) {
  const { phase, method, samples } = chain;
  if (phase !== "exploring") return "sampling";
  if (isGuided(chain)) return samples ? `burning in: ${count(samples)} found, not counted` : "building the first one up";
  if (method === "tempering") return `exploring: tuning its ladder, ${count(samples)} found`;
  return samples ? `exploring: ${count(samples)} found, learning from them` : "exploring: nothing found yet";
}

/** Of a sample that was found while its chain was learning or burning in. */
export const LEARNING = "Found early, before its chain had settled; a true animation, left out of the statistics";

/** What each method does, in a sentence. @type {Object<string, {title: string, summary: string}>} */
export const METHODS = {
  rejection: { title: "Plain draws", summary: "Tries at random and keeps what fits, which is best for common wishes." },
  metropolis: { title: "One walk", summary: "Changes one animation a little at a time, as the paper does: finds rare wishes, and then many that look alike." },
  conditional: { title: "Among what fits", summary: "Learns where the hits lie, or builds one up where the world knows how, and then moves among what fits alone: best for rare wishes." },
  tempering: { title: "A ladder of walks", summary: "Copies walk under ever stricter wishes and trade places: for what is too rare for anything else." },
};
