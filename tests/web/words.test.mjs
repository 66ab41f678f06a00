// How a scenario fares, in words, without a browser: every state that the contract allows has its sentence.
import assert from "node:assert/strict";
import { test } from "node:test";
import * as words from "../../web/app/health_words.js";
import { quantity, variableUnit, wish } from "../../web/app/words.js";

const odds = (probability, low, high, more = {}) => ({ probability, low, high, basis: "learned", draws: 12000, hits: 900, ...more });

test("odds read as one in so many, with their interval", () => {
  assert.deepEqual(words.oddsInWords(odds(1 / 1512, 1 / 1887, 1 / 1213), "throws"), { often: "1 in 1,500 throws", interval: "1,200 to 1,900" });
  assert.deepEqual(words.oddsInWords(odds(1 / 8.31, 1 / 9.02, 1 / 7.74), "drops"), { often: "1 in 8.3 drops", interval: "7.7 to 9" });
});

test("a narrow interval gets as many digits as it needs", () => {
  assert.deepEqual(words.oddsInWords(odds(1 / 1512, 1 / 1514, 1 / 1508), "throws"), { often: "1 in 1,512 throws", interval: "1,508 to 1,514" });
  assert.deepEqual(words.oddsInWords(odds(1 / 1512, 1 / 1548, 1 / 1483), "throws"), { often: "1 in 1,510 throws", interval: "1,480 to 1,550" });
});

test("an interval that reaches down to nothing says so", () => {
  assert.deepEqual(words.oddsInWords(odds(1 / 2e6, 0, 1 / 1e5), "tries"), { often: "1 in 2,000,000 tries", interval: "100,000 to anything" });
});

test("what happens often is a share, and what always happens is said", () => {
  assert.deepEqual(words.oddsInWords(odds(0.58, 0.553, 0.607), "drops"), { often: "58 % of all drops", interval: "55.3 to 60.7 %" });
  assert.equal(words.oddsInWords(odds(1, 0.998, 1), "drops").often, "Nearly all drops");
});

test("without a hit only the limit is known, and no basis is told", () => {
  const none = odds(0, 0, 1 / 3253, { basis: "rejection", draws: 12000, hits: 0 });
  assert.deepEqual(words.oddsInWords(none, "tries"), { often: "Nothing yet in 12,000 tries: rarer than 1 in 3,300", interval: "" });
  assert.equal(words.basisInWords(none, "tries"), "");
});

test("each basis of the odds has its sentence", () => {
  const sentences = ["learned", "rejection", "ladder"].map((basis) => words.basisInWords(odds(0.01, 0.005, 0.02, { basis }), "throws"));
  assert.equal(new Set(sentences).size, 3);
  for (const sentence of sentences) assert.match(sentence, /^[A-Z].+\.$/);
  assert.match(sentences[1], /12,000 plain throws, 900/);
});

test("one word says how rare a wish is, from the best that is known", () => {
  const looked = (verdict, one_in, hits) => ({ verdict, one_in, at_least: 220, draws: 700, hits, seconds: 1 });
  const rarity = (more) => words.rarityOf({ odds: null, difficulty: null, samples: 0, ...more }, "throws");
  assert.equal(rarity({}), null);
  assert.deepEqual(rarity({ difficulty: looked("common", 8, 88) }), { word: "Common", odds: "1 in 8 throws" });
  assert.deepEqual(rarity({ difficulty: looked("rare", 350, 2) }), { word: "Rare", odds: "1 in 350 throws" });
  assert.deepEqual(rarity({ difficulty: looked("nothing-yet", null, 0) }), { word: "Nothing yet", odds: "none in 700 throws, rarer than 1 in 220" });
  assert.equal(rarity({ difficulty: looked("nothing-yet", null, 0), samples: 3 }).word, "Very rare");
  const better = odds(1 / 1500, 1 / 1900, 1 / 1200);
  assert.deepEqual(rarity({ difficulty: looked("nothing-yet", null, 0), odds: better, samples: 3 }), { word: "Rare", odds: "1 in 1,500 throws, 1,200 to 1,900" });
  assert.equal(rarity({ difficulty: looked("rare", 350, 2), odds: odds(0, 0, 1 / 50, { draws: 150, hits: 0 }) }).word, "Rare");
});

test("the chains agree, or do not, by the worst R-hat; where there is none nothing is claimed", () => {
  const agreement = (chains, ...rhats) => words.agreementOf({ chains, quantities: rhats.map((rhat) => ({ rhat })) });
  assert.equal(agreement(4), null);
  assert.equal(agreement(4, null, null), null);
  assert.deepEqual(agreement(4, 1.01, null, 1.04), { words: "The chains agree", agree: true, rhat: 1.04 });
  assert.deepEqual(agreement(4, 1.01, 1.3), { words: "Still finding their way", agree: false, rhat: 1.3 });
  assert.equal(agreement(1, 1.01).words, "The chain agrees with itself");
});

test("the claim of single chains is told as a claim", () => {
  const effective = { samples: 84, quantity: "rest_x", within: 210, per_cpu_minute: 12.34 };
  assert.equal(words.independenceInWords(effective), "About 84 independent animations");
  assert.equal(words.independenceInWords({ ...effective, samples: 1 }), "About 1 independent animation");
  assert.equal(words.independenceInWords({ ...effective, samples: 1234 }), "About 1,200 independent animations");
  assert.equal(words.independenceInWords(null), "Too early to tell");
  const told = words.independenceNotes({ effective, chains: 4 }).join(" ");
  assert.match(told, /the chains would claim 210\b/);
  assert.match(told, /rest x\b/);
  assert.match(told, /12 independent animations per CPU minute/);
  assert.doesNotMatch(words.independenceNotes({ effective: { ...effective, within: 85 }, chains: 4 }).join(" "), /claim/);
  assert.match(words.independenceNotes({ effective, chains: 1 }).join(" "), /one chain alone/);
});

test("while chains learn or burn in, that is why nothing counts yet", () => {
  const note = (...chains) => words.independenceNotes({ effective: null, chains: 0 }, words.busyInWords(chains)).join(" ");
  const learning = { phase: "exploring", guided: false };
  const burning = { phase: "exploring", guided: true };
  assert.match(note(learning), /still learning/);
  assert.match(note(burning, { ...burning, phase: "sampling" }), /still burning in/);
  for (const idle of [note(), note({ ...burning, phase: "sampling" })]) assert.doesNotMatch(idle, /still/);
});

test("what is built up says nothing of the odds of chance", () => {
  const difficulty = { one_in: null, at_least: 35_000, draws: 129_023, hits: 0 };
  assert.equal(words.difficultyInWords(difficulty, "pours"), "Nothing yet in 129,023 pours: rarer than 1 in 35,000");
  assert.equal(words.difficultyInWords(difficulty, "pours", 120), "Rarer than 1 in 35,000 pours");
  assert.deepEqual(words.difficultyNotes(difficulty, "pours", false), ["A first look at 129,023 plain pours saw none."]);
  assert.match(words.difficultyNotes(difficulty, "pours", true).join(" "), /build up what is wished for/);
  assert.deepEqual(words.difficultyNotes({ ...difficulty, hits: 3 }, "pours", false), ["From a first look at 129,023 plain pours."]);
});

test("time is told from the first sample, else from what may be to come", () => {
  const saved = { share: 0.613 };
  const found = { first_sample: { seconds: 0.31 }, eta_seconds: null, saved };
  assert.equal(words.timeInWords(found), "Found the first after 0.3 s");
  assert.deepEqual(words.timeNotes(found), ["Stopping early and resuming saved 61.3 % of the simulated time."]);
  const searching = { first_sample: null, eta_seconds: 240, saved: { share: null } };
  assert.equal(words.timeInWords(searching), "Perhaps 4 min more");
  assert.equal(words.timeNotes(searching).length, 1);
  const unknown = { ...searching, eta_seconds: null };
  assert.equal(words.timeInWords(unknown), "None found yet");
  assert.deepEqual(words.timeNotes(unknown, false), ["No chain is searching."]);
  assert.deepEqual(words.timeNotes(unknown, true), ["A chain is building the first one up."]);
});

test("spans of time have one unit", () => {
  const spans = [[0.04, "less than 0.1 s"], [0.3, "0.3 s"], [42.4, "42 s"], [89.9, "90 s"], [240, "4 min"], [18_000, "5 hours"], [400_000, "5 days"], [1e9, "more than a year"]];
  for (const [seconds, said] of spans) assert.equal(words.spanInWords(seconds), said);
});

test("a chain says what it is doing", () => {
  const chain = (more) => words.phaseInWords({ phase: "exploring", method: "conditional", samples: 0, ...more });
  assert.equal(chain({ samples: 43 }), "exploring: 43 found, learning from them");
  assert.equal(chain({}), "exploring: nothing found yet");
  assert.match(chain({ method: "tempering" }), /^exploring: .*ladder/);
  assert.equal(chain({ phase: "sampling" }), "sampling");
  const guided = (more) => chain({ guided: true, ...more });
  assert.equal(guided({}), "building the first one up");
  assert.equal(guided({ samples: 3 }), "burning in: 3 found, not counted");
  assert.equal(guided({ samples: 30, phase: "sampling" }), "sampling");
});

test("the clauses of wishes are one sentence", () => {
  assert.equal(wish({ wishes: [] }), "No wish: whatever may happen, as often as it may happen.");
  assert.equal(wish({ wishes: ["die 1 shows face 6"] }), "Die 1 shows face 6.");
  assert.equal(wish({ wishes: ["pin 6 goes down", "the ball touches pin 6", "it ends"] }), "Pin 6 goes down, the ball touches pin 6 and it ends.");
});

test("a quantity reads in the unit that the server tells", () => {
  const said = [
    [0.0216, "s", "21.6 ms"], [2.4, "s", "2.4 s"], [0, "s", "0 s"],
    [0.0032, "m", "3.2 mm"], [-0.0432, "m", "-4.32 cm"], [1.02, "m", "1.02 m"],
    [0.05, "rad", "2.865°"], [1, "rad/s", "57.3 °/s"], [7.94, "m/s", "7.94 m/s"], [2.5, "N s", "2.5 N s"],
    [3, "", "3"], [3, undefined, "3"], [null, "m", "–"], [true, "", "yes"], [[0.5, null], "s", "0.5 s, –"], [[], "s", "none"],
  ];
  for (const [value, unit, words] of said) assert.equal(quantity(value, unit), words);
});

test("variables whose names differ in numbers alone share their unit", () => {
  const units = { "height_#_#": "m", spin: "rad/s" };
  assert.equal(variableUnit(units, "height_3_12"), "m");
  assert.equal(variableUnit(units, "spin"), "rad/s");
  assert.equal(variableUnit(units, "share_3"), "");
  assert.equal(variableUnit(undefined, "spin"), "");
});

test("tries are called what their world calls one", () => {
  assert.equal(words.triesOf({ try: "throw" }), "throws");
  assert.equal(words.triesOf({ try: "try" }), "tries");
  assert.equal(words.triesOf(undefined), "tries");
});
