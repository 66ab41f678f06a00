// How a scenario fares: odds, independence, time; samples found while learning; the form that starts chains.
// What takes minutes to come about is told to the page by answers of the contract's shape laid over the real ones.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { difficultyInWords, independenceInWords, oddsInWords, spanInWords } from "../../web/app/health_words.js";
import { api, arrived, drawnTiles, json, newPage, PATIENCE, picture, startBrowser, startProgram } from "./fixture.mjs";
import { BOWLED, CHAIN, DIAGNOSTICS, DIFFICULTY, ladder, NOTHING, ODDS, TRACE } from "./laid.mjs";

let program, browser;
before(async () => {
  program = await startProgram();
  browser = await startBrowser();
});
after(async () => {
  await browser?.close();
  await program?.end();
  await program?.remove();
});

/**
 * Lays answers over those of the program: `scenario` what is new in one, `chains` and `diagnostics` whole. The stream
 * is empty, so that nothing real comes after them.
 */
async function lay(page, id, { scenario = {}, chains = [], diagnostics }) {
  const over = (one) => (one.id === id ? { ...one, odds: null, difficulty: null, ...scenario } : one);
  await page.route("**/v1/events", (route) => route.fulfill({ contentType: "text/event-stream", body: ": nothing\n\n" }));
  await page.route("**/v1/scenarios?*", async (route) => {
    const body = await (await route.fetch()).json();
    await route.fulfill({ json: { ...body, scenarios: body.scenarios.map(over) } });
  });
  await page.route(`**/v1/scenarios/${id}`, async (route) => route.fulfill({ json: over(await (await route.fetch()).json()) }));
  await page.route(`**/v1/scenarios/${id}/chains?*`, (route) => route.fulfill({ json: { chains: chains.map((chain) => ({ ...chain, scenario: id })) } }));
  await page.route(`**/v1/scenarios/${id}/diagnostics`, (route) => route.fulfill({ json: diagnostics }));
  await page.route("**/v1/chains/*/trace?*", (route) => route.fulfill({ json: TRACE }));
}

const bowled = async () => (await api(program, "/v1/scenarios", json(BOWLED))).id;
const card = (page, name) => page.locator(`[data-card="${name}"]`);
const says = (page, name, text) => card(page, name).filter({ hasText: text }).waitFor();

/** Waits until every chain of a scenario is finished. */
async function finished(id) {
  const end = Date.now() + PATIENCE;
  for (;;) {
    const { chains } = await api(program, `/v1/scenarios/${id}/chains`);
    if (chains.length && chains.every(({ state }) => state === "finished")) return chains;
    if (Date.now() > end) throw new Error(`still ${chains.map(({ state }) => state)}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

test("what the program says of its example is what the page tells", async () => {
  const { page, faults, close } = await newPage(browser);
  const { id } = (await api(program, "/v1/scenarios")).scenarios.find(({ world }) => world === "ball2d");
  await finished(id);
  const { odds, effective, first_sample } = await api(program, `/v1/scenarios/${id}/diagnostics`);
  assert.equal(odds.basis, "rejection");
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  const { often, interval } = oddsInWords(odds, "drops");
  await says(page, "odds", often);
  await says(page, "odds", `${interval}, with 95 % confidence.`);
  await says(page, "independence", independenceInWords(effective));
  await says(page, "time", `Found the first after ${spanInWords(first_sample.seconds)}`);
  await page.locator(".quantities tbody tr").first().waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("soon after it is created a scenario says how rare its wish is, without a chain", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?create=ball2d`);
  const text = page.getByLabel("The scenario, as JSON");
  await page.waitForFunction(() => document.getElementById("scenario-text").value.includes('"world"'));
  const wish = { world: "ball2d", title: "Far out", constraints: [{ kind: "rest_position", x: 2 }] };
  await text.fill(JSON.stringify(wish));
  await page.getByLabel(/Start a chain/).uncheck();
  await page.getByRole("button", { name: "Create" }).click();
  await page.waitForFunction(() => document.querySelector("#scenario h1")?.textContent === "Far out");
  await page.waitForFunction(() => document.querySelector(".rarity-line").textContent !== "");
  const id = new URL(page.url()).searchParams.get("scenario");
  const { difficulty } = await api(program, `/v1/scenarios/${id}`);
  const word = { common: "Common", rare: "Rare", "nothing-yet": "Nothing yet" }[difficulty.verdict];
  assert.equal(await page.locator(".rarity-line").textContent(), `${word}: ${difficultyInWords(difficulty, "drops")}`);
  assert.equal(await page.locator(`[data-scenario="${id}"] .rarity`).textContent(), word.toLowerCase());
  assert.deepEqual(faults, []);
  await close();
});

test("a chain started from the form ends when it has so many independent animations", async () => {
  const { page, faults, close } = await newPage(browser);
  const wish = { world: "ball2d", title: "Sixty of them", constraints: [{ kind: "rest_position", x: -1 }] };
  const { id } = await api(program, "/v1/scenarios", json(wish));
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await page.getByRole("button", { name: "Start chains" }).click();
  await page.getByLabel("Animations that count").fill("");
  await page.getByLabel("Independent animations").fill("60");
  await page.locator(".start-chains .choice").nth(3).waitFor();
  await page.getByRole("radio", { name: /conditional/ }).check();
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await arrived(page, { start: null });
  const [chain] = await finished(id);
  assert.deepEqual(chain.stop, { ess: 60 });
  assert.equal(chain.method, "conditional");
  assert.equal(chain.ended_by, "ess");
  assert.ok(chain.effective_samples >= 60);
  const row = page.locator(`tr[data-chain="${chain.id}"]`);
  await row.locator('td[data-label="Independent"]', { hasText: String(Math.round(chain.effective_samples)) }).waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("a ladder of the program: what it found while it was tuned is marked, and its trades are drawn", async () => {
  const { page, faults, close } = await newPage(browser);
  const wish = { world: "ball2d", title: "Up a ladder", constraints: [{ kind: "rest_position", x: 1.5 }] };
  const { id } = await api(program, "/v1/scenarios", json(wish));
  await api(program, `/v1/scenarios/${id}/chains`, json({ method: "tempering", seed: 3, stop: { samples: 100 } }));
  await finished(id);
  const { swaps } = await api(program, `/v1/scenarios/${id}/diagnostics`);
  const tried = swaps.filter(({ proposed }) => proposed > 0).length;
  assert.ok(tried > 1);
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await page.waitForFunction((steps) => document.querySelectorAll(".ladder .step").length === steps, tried);
  await page.goto(`${program.address}?scenario=${id}&order=oldest`);
  await page.waitForFunction(() => document.querySelectorAll(".tile").length >= 24);
  const { samples } = await api(program, `/v1/scenarios/${id}/samples?order=oldest&limit=100`);
  const marked = await page.locator(".tile").evaluateAll((tiles) => tiles.map((tile) => [tile.dataset.sample, tile.querySelector(".learning") !== null]));
  assert.ok(marked.some(([, learning]) => learning));
  assert.deepEqual(marked, samples.slice(0, marked.length).map((sample) => [sample.id, sample.learning]));
  assert.deepEqual(faults, []);
  await close();
});

test("odds, independence and time are told in words", async () => {
  const { page, faults, close } = await newPage(browser, { viewport: { width: 1280, height: 1240 }, colorScheme: "light" });
  const id = await bowled();
  const finished = { ...CHAIN, state: "finished", phase: "sampling", effective_samples: 52.4, ended_by: "ess" };
  const chains = [0, 1, 2, 3].map((index) => ({ ...finished, id: `c${index}`, index, iteration: 8000 + 31 * index, samples: 250 + index }));
  await lay(page, id, { scenario: { odds: ODDS, difficulty: DIFFICULTY, samples: 1002 }, chains, diagnostics: DIAGNOSTICS });
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await says(page, "odds", "1 in 1,500 throws");
  await says(page, "odds", "1,200 to 1,900, with 95 % confidence.");
  await says(page, "odds", "31,204 draws");
  await says(page, "independence", "About 84 independent animations");
  await says(page, "independence", "the chains would claim 210");
  await says(page, "independence", "Held back most by lane friction.");
  await says(page, "independence", "The chains agree R-hat 1.03 at worst");
  await says(page, "independence", "5.2 independent animations per CPU minute");
  await says(page, "time", "Found the first after 0.3 s");
  await says(page, "time", "saved 61.1 % of the simulated time");
  assert.equal(await page.locator(".rarity-line").textContent(), "Rare: 1 in 1,500 throws, 1,200 to 1,900");
  assert.equal(await page.locator(`[data-scenario="${id}"] .rarity`).textContent(), "rare");
  assert.ok(await page.locator(".swaps").isHidden(), "no ladder, no plot of one");
  await picture(page, "health-light");
  await page.emulateMedia({ colorScheme: "dark" });
  await page.waitForFunction(() => document.documentElement.dataset.theme === "dark");
  await picture(page, "health-dark");
  assert.deepEqual(faults, []);
  await close();
});

test("quantities stand in the order of their worth, the worst first; all of them on demand, and the address knows", async () => {
  const { page, faults, close } = await newPage(browser);
  const id = await bowled();
  await lay(page, id, { chains: [{ ...CHAIN, state: "finished" }], diagnostics: DIAGNOSTICS });
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  const rows = page.locator(".quantities tbody tr");
  const names = () => rows.locator("th").allTextContents();
  await rows.first().waitFor();
  assert.deepEqual(await names(), ["lane friction", "pin 7 x", "pin 5 x", "pin 1 x", "spin rate", "spin axis"]);
  // The first row is there for what the chains' means allow, and says so; the others for all chains together.
  assert.deepEqual(await rows.locator(".counting").allTextContents(), ["84", "163", "174", "185", "196", "207"]);
  const lines = await rows.locator("svg").evaluateAll((drawings) => drawings.map((drawing) => drawing.querySelectorAll("line.across").length));
  assert.deepEqual(lines, [1, 0, 0, 0, 0, 0]);
  // Bars keep their proportions.
  const widths = await rows.nth(1).locator("rect").evaluateAll((bars) => Object.fromEntries(bars.map((bar) => [bar.getAttribute("class"), bar.getBoundingClientRect().width])));
  assert.ok(Math.abs(widths.within / widths.bulk - 2.4) < 0.02, JSON.stringify(widths));
  assert.ok(Math.abs(widths.tail / widths.bulk - 0.7) < 0.02, JSON.stringify(widths));
  const all = page.getByRole("button", { name: "Show all 10" });
  assert.equal(await all.getAttribute("aria-expanded"), "false");
  await all.press("Enter");
  await arrived(page, { quantities: "all" });
  await page.waitForFunction(() => document.querySelectorAll(".quantities tbody tr").length === 10);
  assert.equal((await names()).at(-1), "pins down", "what never changes limits nothing");
  await page.reload();
  await page.waitForFunction(() => document.querySelectorAll(".quantities tbody tr").length === 10);
  await page.getByRole("button", { name: "Show the 6 worst" }).click();
  await arrived(page, { quantities: null });
  await page.waitForFunction(() => document.querySelectorAll(".quantities tbody tr").length === 6);
  assert.deepEqual(faults, []);
  await close();
});

test("with nothing found yet it says what is excluded, and how long it may take", async () => {
  const { page, faults, close } = await newPage(browser, { colorScheme: "light" });
  const id = await bowled();
  const chain = { ...CHAIN, samples: 0, first_sample: null };
  const difficulty = { verdict: "nothing-yet", one_in: null, at_least: 190, draws: 700, hits: 0, seconds: 1 };
  await lay(page, id, { scenario: { difficulty }, chains: [chain], diagnostics: NOTHING });
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await says(page, "odds", "Nothing yet in 12,000 throws: rarer than 1 in 3,300");
  await says(page, "independence", "Too early to tell");
  await says(page, "time", "Perhaps 41 s more");
  await page.locator('tr[data-chain="c0"]', { hasText: "exploring: nothing found yet" }).waitFor();
  assert.equal(await page.locator(".rarity-line").textContent(), "Nothing yet: none in 700 throws, rarer than 1 in 190");
  assert.equal(await page.locator(`[data-scenario="${id}"] .rarity`).textContent(), "nothing yet");
  assert.ok(await page.locator(".quantities").isHidden());
  await picture(page, "health-nothing-yet");
  assert.deepEqual(faults, []);
  await close();
});

test("a first look alone is told as one, with the word that the contract gives", async () => {
  for (const [difficulty, words] of [
    [{ verdict: "common", one_in: 8.2, at_least: 7.1, draws: 700, hits: 85, seconds: 1 }, "Common: 1 in 8.2 throws"],
    [DIFFICULTY, "Rare: 1 in 1,400 throws"],
    [null, ""],
  ]) {
    const { page, faults, close } = await newPage(browser);
    const id = await bowled();
    await lay(page, id, { scenario: { difficulty }, diagnostics: { ...NOTHING, odds: null, eta_seconds: null } });
    await page.goto(`${program.address}?scenario=${id}&tab=chains`);
    await says(page, "odds", difficulty ? "From a first look at" : "Not known yet");
    assert.equal(await page.locator(".rarity-line").textContent(), words);
    assert.deepEqual(faults, []);
    await close();
  }
});

test("a ladder shows where its neighbours trade places", async () => {
  const { page, faults, close } = await newPage(browser, { viewport: { width: 1280, height: 1240 }, colorScheme: "light" });
  const id = await bowled();
  const chains = [0, 1].map((index) => ({ ...CHAIN, id: `c${index}`, index, method: "tempering", phase: index ? "sampling" : "exploring" }));
  const swaps = [...ladder("c0", [0.41, 0.35, 0.3, 0.28, 0.33, 0.4]), ...ladder("c1", [0.38, 0.31, 0.06, 0.27, 0.36]), { chain: "c1", low: 1, high: 1, proposed: 0, accepted: 0 }];
  await lay(page, id, { scenario: { odds: { ...ODDS, basis: "ladder" } }, chains, diagnostics: { ...DIAGNOSTICS, odds: { ...ODDS, basis: "ladder" }, swaps } });
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await page.locator(".swaps", { hasText: "The weakest step trades 6 % of the time" }).waitFor();
  const ladders = page.locator(".ladder");
  await page.locator(".ladder-line", { hasText: "Chain 1" }).waitFor();
  // The weakest chain comes first; steps that were never tried are no steps.
  assert.match(await ladders.first().getAttribute("aria-label"), /^Chain 2: 5 steps, trades succeed 6 to 38 % of the time$/);
  assert.match(await ladders.nth(1).getAttribute("aria-label"), /^Chain 1: 6 steps/);
  await page.locator('tr[data-chain="c0"] .phase', { hasText: "tuning its ladder, 43 found" }).waitFor();
  assert.equal(await page.locator('tr[data-chain="c1"] .phase').textContent(), "sampling");
  await picture(page, "health-ladder");
  assert.deepEqual(faults, []);
  await close();
});

test("what was found while learning carries a mark, in its tile and in the large view", async () => {
  const { page, faults, close } = await newPage(browser, { colorScheme: "light" });
  const { id } = (await api(program, "/v1/scenarios")).scenarios.find(({ world }) => world === "ball2d");
  const { samples } = await api(program, `/v1/scenarios/${id}/samples?order=oldest&limit=6`);
  const learned = new Set(samples.filter((_, at) => at % 2 === 0).map((sample) => sample.id));
  const over = (sample) => (learned.has(sample.id) ? { ...sample, learning: true, weight: 0 } : { ...sample, learning: false });
  await page.route("**/v1/scenarios/*/samples?*", async (route) => {
    const body = await (await route.fetch()).json();
    await route.fulfill({ json: { ...body, samples: body.samples.map(over) } });
  });
  await page.route(/\/v1\/samples\/[^/]+$/, async (route) => route.fulfill({ json: over(await (await route.fetch()).json()) }));
  await page.goto(`${program.address}?scenario=${id}&order=oldest`);
  await drawnTiles(page, 6);
  for (const { id: sample } of samples) {
    const tile = page.locator(`.tile[data-sample="${sample}"]`);
    assert.equal(await tile.locator(".learning").count(), learned.has(sample) ? 1 : 0);
    assert.equal(/found early/.test(await tile.locator("a").getAttribute("aria-label")), learned.has(sample));
  }
  assert.match(await page.locator(".tile .learning").first().getAttribute("title"), /^Found early, before its chain had settled; a true animation, left out of the statistics$/);
  await picture(page, "learning-tiles");
  await page.locator(`.tile[data-sample="${samples[0].id}"] a`).click();
  await page.locator(".facts-panel .learning", { hasText: "left out of the statistics" }).waitFor();
  await page.locator(".facts", { hasText: "not at all" }).waitFor();
  await picture(page, "learning-player");
  await page.getByRole("button", { name: /Next/ }).click();
  await arrived(page, { sample: samples[1].id });
  await page.locator(".facts-panel .learning").waitFor({ state: "hidden" });
  assert.deepEqual(faults, []);
  await close();
});

test("the form that starts chains offers every method in a sentence, and stops by independent animations", async () => {
  const { page, faults, close } = await newPage(browser, { colorScheme: "light" });
  const id = await bowled();
  const methods = ["rejection", "metropolis", "conditional", "tempering"];
  await page.route("**/v1/worlds", async (route) => {
    const { worlds } = await (await route.fetch()).json();
    await route.fulfill({ json: { worlds: worlds.map((world) => ({ ...world, default_method: "conditional", methods })) } });
  });
  const asked = [];
  await page.route("**/v1/chains/*/trace?*", (route) => route.fulfill({ json: TRACE }));
  await page.route(`**/v1/scenarios/${id}/chains`, (route) => {
    if (route.request().method() === "GET") return route.continue();
    asked.push(route.request().postDataJSON());
    return route.fulfill({ status: 201, json: { chains: [{ ...CHAIN, scenario: id }] } });
  });
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await page.getByRole("button", { name: "Start chains" }).click();
  const choices = page.locator(".start-chains .choice");
  await choices.nth(3).waitFor();
  assert.equal(await choices.count(), 4);
  assert.match(await choices.first().textContent(), /conditional · usual/);
  for (const text of await choices.allTextContents()) assert.match(text, /^[^.]+\.$/);
  await picture(page, "start-chains");
  await page.getByLabel("Chains", { exact: true }).fill("4");
  await page.getByRole("radio", { name: /tempering/ }).check();
  await page.getByLabel("Animations that count").fill("");
  await page.getByLabel("Independent animations").fill("200");
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await arrived(page, { start: null });
  assert.deepEqual(asked, [{ count: 4, method: "tempering", stop: { ess: 200 } }]);
  // Opened again, closed by the keyboard; the world's own method needs no name.
  await page.getByRole("button", { name: "Start chains" }).click();
  await page.getByRole("radio", { name: /· usual/ }).check();
  await page.getByLabel("Independent animations").fill("1001");
  await page.getByRole("button", { name: "Start", exact: true }).click();
  assert.equal(asked.length, 1, "more than the contract allows is not sent");
  await page.getByLabel("Independent animations").fill("");
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await arrived(page, { start: null });
  assert.deepEqual(asked[1], { count: 4 });
  // On the other tab there is no form, and the page answers.
  await page.goto(`${program.address}?scenario=${id}&start=on`);
  await page.getByRole("tab", { name: /Chains/ }).click();
  await page.getByRole("button", { name: "Close" }).click();
  await arrived(page, { start: null });
  await page.getByRole("button", { name: "Start chains" }).click();
  await arrived(page, { start: "on" });
  await page.keyboard.press("Escape");
  await arrived(page, { start: null });
  assert.ok(await page.locator(".start-chains").isHidden());
  assert.deepEqual(faults, []);
  await close();
});

test("a refusal to start is told in the form", async () => {
  const { page, faults, close } = await newPage(browser, {}, /\b422\b/);
  const id = await bowled();
  await page.goto(`${program.address}?scenario=${id}&tab=chains&start=on`);
  await page.locator(".start-chains .choice").first().waitFor();
  await page.getByLabel("Seed").fill("99999999999999999999");
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await page.locator(".start-chains .error", { hasText: "/seed" }).waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("at 390 pixels the whole of it fits", async () => {
  const { page, faults, close } = await newPage(browser, { viewport: { width: 390, height: 1900 }, hasTouch: true, isMobile: true, colorScheme: "light" });
  const id = await bowled();
  await lay(page, id, { scenario: { odds: ODDS }, chains: [{ ...CHAIN, method: "tempering" }], diagnostics: { ...DIAGNOSTICS, swaps: ladder("c0", [0.4, 0.3, 0.2, 0.3]) } });
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await page.locator(".quantities tbody tr").first().waitFor();
  await page.locator(".ladder").first().waitFor();
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth));
  // Nothing hides behind a scroll of its own either.
  assert.ok(await page.locator(".health .scroller").evaluate((box) => box.scrollWidth <= box.clientWidth));
  await picture(page, "health-narrow");
  assert.deepEqual(faults, []);
  await close();
});
