// Every view and dialog can be read: on a phone, a desk and a wide screen, in light and dark, what is seen is measured
// (legibility.mjs), held against kept pictures (pictures.mjs), and checked by axe-core.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { api, json, newPage, PATIENCE, picture, startBrowser, startProgram } from "./fixture.mjs";
import { BOWLED, CHAIN, DIAGNOSTICS, DIFFICULTY, ladder, NOTHING, ODDS } from "./laid.mjs";
import { faultsOfText } from "./legibility.mjs";
import { Pictures } from "./pictures.mjs";
import { blankGraphics, leave, steady } from "./steady.mjs";

/** A theme changes colours and nothing else, so every rule is checked in the light and contrast in both. */
const EVERY_RULE = {};
const CONTRAST = { runOnly: ["color-contrast"] };
/** Kept pictures of the widest window are a quarter of its size, all others half. */
const WINDOWS = [
  { width: 390, height: 844, scale: 0.5, axe: { light: EVERY_RULE } },
  { width: 1440, height: 900, scale: 0.5, axe: { light: EVERY_RULE, dark: CONTRAST } },
  { width: 2560, height: 1440, scale: 0.25, axe: {} }, // nothing is there that is not there at 1440
];
/** Pictures to look at have the animations in them; measurements need none, and without a graphics card they take long. */
const LOOK = Boolean(process.env.RETAKE_SCREENSHOTS);
const THEMES = ["light", "dark"];
const TALLEST = 6000; // [px] of a window that shows a whole view
const MARGIN = 16; // [px] around a dialog

let program, browser, page, faults, close, pictures, worlds;
/** Scenarios by what they are here for. */
const ids = {};

before(async () => {
  [program, browser] = await Promise.all([startProgram({ world: null, examples: false }), startBrowser({ webgl: LOOK })]);
  ({ worlds } = await api(program, "/v1/worlds"));
  const example = (world, title = "") => worlds.find(({ name }) => name === world).examples.find((each) => each.title.startsWith(title));
  const create = async (name, document, samples) => {
    ({ id: ids[name] } = await api(program, "/v1/scenarios", json(document)));
    if (samples) await api(program, `/v1/scenarios/${ids[name]}/chains`, json({ count: 1, seed: 5, stop: { samples } }));
  };
  await create("empty", { world: "ball2d", title: "Nothing has been looked for", model: {}, constraints: [] });
  await create("rare", { ...BOWLED, title: "A split that nobody has thrown yet" });
  await create("health", BOWLED);
  await create("dice", example("dice", "Figure 9: die 1"), 2);
  await create("die", example("dice", "Figure 9: die 2"), 2);
  await create("spelling", example("spelling"), 2);
  await create("bowling", example("bowling"), 3);
  await create("ball2d", example("ball2d"), 12);
  for (const name of ["dice", "die", "spelling", "bowling", "ball2d"]) await finished(ids[name]);

  ({ page, faults, close } = await newPage(browser, { bypassCSP: true, reducedMotion: "reduce", locale: "en-GB", timezoneId: "UTC" }, /\b(404|422)\b|ERR_FAILED/));
  page.setDefaultTimeout(4 * PATIENCE); // for windows that are larger than those of other tests
  const axe = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
  await page.addInitScript({ content: axe });
  if (!LOOK) await page.addInitScript(blankGraphics);
  await page.clock.setFixedTime("2026-01-02T12:00:00Z");
  await steady(page, laid());
  pictures = new Pictures(page);
  await page.goto(program.address);
  await page.evaluate(() => document.fonts.ready);
});
after(async () => {
  await close?.();
  await browser?.close();
  await program?.end();
  await program?.remove();
});

async function finished(id) {
  const end = Date.now() + 4 * PATIENCE;
  while ((await api(program, `/v1/scenarios/${id}/chains`)).chains.some(({ state }) => state !== "finished")) {
    if (Date.now() > end) throw new Error(`the chain of ${id} does not come to its end`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

/** What takes minutes to come about: a scenario that is well known, and one of which nothing is. */
function laid() {
  const chain = (index, changes) => ({ ...CHAIN, id: `c${index}`, index, method: "tempering", iteration: 8000 + 31 * index, samples: 250 + index, ...changes });
  const swaps = [...ladder("c0", [0.41, 0.35, 0.3, 0.28, 0.33, 0.4]), ...ladder("c1", [0.38, 0.31, 0.06, 0.27, 0.36])];
  const failure = "The disk is full: chain 4 of the scenario could not be written, and nothing after iteration 8,093 has been kept";
  const chains = [
    chain(0, { phase: "sampling", effective_samples: 52.4 }),
    chain(1, { state: "paused" }),
    chain(2, { state: "finished", phase: "sampling", effective_samples: 1234.5, ended_by: "ess", iteration: 12345678 }),
    chain(3, { state: "failed", error: failure, ratios: "paper" }),
  ];
  const nothing = { verdict: "nothing-yet", one_in: null, at_least: 190, draws: 700, hits: 0, seconds: 1 };
  return new Map([
    [ids.health, { scenario: { odds: { ...ODDS, basis: "ladder" }, difficulty: DIFFICULTY, samples: 1002, chains: { running: 1, paused: 1, finished: 1, failed: 1 } }, chains, diagnostics: { ...DIAGNOSTICS, odds: { ...ODDS, basis: "ladder" }, swaps } }],
    [ids.rare, { scenario: { difficulty: nothing, chains: { running: 1, paused: 0, finished: 0, failed: 0 } }, chains: [{ ...CHAIN, samples: 0, first_sample: null }], diagnostics: NOTHING }],
  ]);
}

/** Goes to another place of the page, as by the back button. @param {Record<string, string>} query */
const visit = (query) =>
  page.evaluate((search) => {
    history.pushState(null, "", `/?${search}`);
    dispatchEvent(new PopStateEvent("popstate"));
  }, String(new URLSearchParams({ play: "off", ...query })));

const seen = (selector, options) => page.locator(selector).first().waitFor(options);
const tiles = (least) => page.waitForFunction((count) => document.querySelectorAll("#scenario .tile").length >= count, least);

/** Two frames after the last change of the window or the theme everything has its place; plots follow when they are told. */
const settled = async () => {
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(resolve)))));
  await page.waitForFunction(() => [...document.querySelectorAll(".uplot")].every((plot) => !plot.checkVisibility() || plot.offsetWidth === plot.parentElement.clientWidth));
};

/** Waits until the text stands: captions are set anew until all that they tell of is known. */
const textStands = () =>
  page.evaluate(async () => {
    for (let before; before !== document.body.innerText; await new Promise((resolve) => setTimeout(resolve, 150))) before = document.body.innerText;
  });

/** A window as high as what is in it, so that all of it is seen; the large view fills any window by itself. */
async function fit({ width, height }) {
  await page.setViewportSize({ width, height });
  if (width === WINDOWS[0].width) await textStands(); // in the others the same text is laid out anew
  await settled();
  const whole = await page.evaluate(() => {
    const dialog = [...document.querySelectorAll("dialog:modal")].at(-1);
    if (dialog) return { dialog: true, height: dialog.matches(".player") ? 0 : dialog.scrollHeight + 40 };
    return { dialog: false, height: Math.max(document.documentElement.scrollHeight, 60 + document.querySelector(".scenarios").scrollHeight) };
  });
  if (whole.height > height) await page.setViewportSize({ width, height: Math.min(TALLEST, whole.height) });
  if (!whole.dialog) await page.waitForFunction(() => [...document.querySelectorAll(".tile .shot")].every((shot) => shot.matches(".drawn") || shot.textContent || !shot.checkVisibility()));
  await settled();
}

/** Measures, checks and compares what is seen now in every window and theme. @param {string} name of it */
async function isLegible(name) {
  const wrong = [];
  for (const window of WINDOWS) {
    await fit(window);
    for (const theme of THEMES) {
      const where = `${name}-${window.width}-${theme}`;
      await page.emulateMedia({ colorScheme: theme });
      await settled();
      const found = [
        ...(await page.evaluate(faultsOfText)),
        ...(window.axe[theme] ? await faultsOfAxe(window.axe[theme]) : []),
        await differs(where, window),
      ];
      wrong.push(...found.filter(Boolean).map((fault) => `${where}: ${fault}`));
      await picture(page, where);
    }
  }
  assert.deepEqual([...wrong, ...faults.splice(0)], []);
}

/** What axe-core finds against it: of the dialog that is open, else of the whole page. @param {object} rules */
const faultsOfAxe = (rules) =>
  page.evaluate(async (wanted) => {
    const dialog = [...document.querySelectorAll("dialog:modal")].at(-1);
    const { violations } = await globalThis.axe.run(dialog ?? document, { resultTypes: ["violations"], preload: false, ...wanted });
    return violations.flatMap(({ id, help, nodes }) => nodes.map(({ target, failureSummary }) => `${id}: ${help}, at ${target.join(" ")}: ${failureSummary.replace(/\s+/g, " ")}`));
  }, rules);

/**
 * Against the kept picture, without what is drawn in three dimensions. A dialog is as wide on the widest screen as on a
 * desk, so it is kept once. Code is set in the page's own typeface: the page ships no other, and machines differ in
 * theirs. Whether what is focused has a ring depends on what was last touched, so rings are left out.
 */
async function differs(name, { width, scale }) {
  const clip = await page.evaluate((margin) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(".stage { visibility: hidden } code, pre, textarea, .fault-place { font-family: Inter !important } * { caret-color: transparent !important; outline-color: transparent !important }");
    document.adoptedStyleSheets.push(sheet);
    const dialog = [...document.querySelectorAll("dialog.sheet:modal")].at(-1);
    if (!dialog) return { x: 0, y: 0, width: innerWidth, height: innerHeight };
    const box = dialog.getBoundingClientRect();
    const [x, y] = [box.left, box.top].map((edge) => Math.max(0, Math.floor(edge) - margin));
    return { x, y, width: Math.min(innerWidth - x, Math.ceil(box.width) + 2 * margin), height: Math.min(innerHeight - y, Math.ceil(box.height) + 2 * margin), dialog: true };
  }, MARGIN);
  const { dialog, ...place } = clip;
  const difference = dialog && width > WINDOWS[1].width ? "" : await pictures.compare(name, scale, place);
  await page.evaluate(() => document.adoptedStyleSheets.pop());
  return difference;
}

test("the first screen", async () => {
  await visit({});
  await seen(".world .shot.drawn");
  await page.waitForFunction((count) => document.querySelectorAll(".first .shot.drawn").length === count, 1 + worlds.length);
  await isLegible("first");
});

test("the gallery of a scenario, and its document with the question before it is deleted", async () => {
  await visit({ scenario: ids.ball2d });
  await tiles(12);
  await isLegible("gallery");
  await page.getByText("The scenario as it was asked for").click();
  await page.getByRole("button", { name: "Delete scenario" }).click();
  await seen("text=Delete it with all its animations?");
  await isLegible("delete");
});

test("a gallery with wide tiles", async () => {
  await visit({ scenario: ids.bowling });
  await tiles(3);
  await isLegible("gallery-wide");
});

test("scenarios that are chosen, and shown together, one of them without an animation", async () => {
  await visit({ choose: "on", together: [ids.ball2d, ids.dice, ids.empty, ids.spelling].join(",") });
  await tiles(4);
  await seen("text=Nothing found yet");
  await isLegible("together");
});

test("a scenario without an animation, and none at all", async () => {
  await visit({ scenario: ids.empty });
  await seen("text=No animation yet.");
  await isLegible("no-animation");
  await visit({ scenario: "nope" });
  await seen("#scenario .empty");
  await isLegible("no-scenario");
});

test("health, chains in every state and their trace", async () => {
  await visit({ scenario: ids.health, tab: "chains", quantities: "all" });
  await seen(".quantities tbody tr");
  await seen(".ladder");
  await seen(".uplot canvas");
  await isLegible("health");
  await visit({ scenario: ids.rare, tab: "chains" });
  await seen(".headline >> text=Nothing yet in 12,000");
  await seen(".uplot canvas");
  await isLegible("health-nothing-yet");
  await visit({ scenario: ids.empty, tab: "chains" });
  await seen("text=No chain has been started yet.");
  await isLegible("health-no-chain");
});

test("starting chains, and a refusal to", async () => {
  await visit({ scenario: ids.health, tab: "chains", start: "on" });
  await seen(".start-chains .choice >> nth=2");
  await isLegible("start-chains");
  await page.getByLabel("Seed").fill("99999999999999999999");
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await seen(".start-chains .error >> text=/seed");
  await isLegible("start-chains-refused");
});

test("a new scenario of every world, with a word where its wish has one, and refused", async () => {
  for (const { name } of worlds) {
    await visit({ scenario: ids.ball2d, create: name });
    await page.waitForFunction((world) => document.getElementById("scenario-text").value.includes(`"world": "${world}"`), name);
    assert.equal(await page.locator(".saying").isVisible(), name === "spelling");
    await isLegible(`create-${name}`);
  }
  await page.getByLabel("The scenario, as JSON").fill(JSON.stringify({ world: "ball2d", constraints: [{ kind: "rest_position", x: "left", sd: -1, of_a_body_that_nobody_knows: true }, { kind: "nothing" }] }, null, 2));
  await page.getByRole("button", { name: "Create" }).click();
  await seen(".fault-place >> text=/constraints/0/sd");
  await isLegible("create-refused");
});

test("the large view in every world, with its panel", async () => {
  for (const [name, query] of Object.entries({ ball2d: {}, bowling: {}, spelling: {}, dice: { color: "friction" } })) {
    const [{ id }] = (await api(program, `/v1/scenarios/${ids[name]}/samples?limit=1`)).samples;
    await visit({ scenario: ids[name], sample: id, t: "1", ...query });
    await seen(".player .picture.drawn");
    await seen(".facts-panel .variables > div", { state: "attached" });
    if (name === "dice") await seen(".player .scale");
    if (name === "dice") await seen("text=/^Turns 2\\.8 times$/"); // as all its frames say, not every other one
    if (name === "ball2d") {
      await page.getByRole("button", { name: "Verify" }).click();
      await seen(".verdict >> text=Identical");
    }
    await isLegible(`player-${name}`);
  }
  await page.locator(".facts-panel summary").click();
  await isLegible("player-variables");
  await page.locator(".facts-panel summary").click();
});

test("notices, and the banner while the server is gone", async () => {
  await visit({ scenario: ids.ball2d });
  await tiles(12);
  await page.evaluate(async () => {
    const { notice } = await import("/app/notice.js");
    const { setTimeout } = globalThis;
    globalThis.setTimeout = () => 0; // they stay
    notice("There is no animation “nope”; it may have been deleted.", "bad");
    notice("Too many chains: 64 are running already – /count ask for fewer, or stop some of them first", "plain");
    globalThis.setTimeout = setTimeout;
  });
  await leave(page);
  await seen("#banner");
  await isLegible("server-gone");
});

test("every kept picture is of something", async () => {
  assert.deepEqual(await pictures.orphans(), []);
});
