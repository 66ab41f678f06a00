// The first screen, the list beside it, and how a reader gets about: back, Esc, neighbours, and addresses that are wrong.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, drawnTiles, json, newPage, PATIENCE, picture, query, shows, startBrowser, startProgram } from "./fixture.mjs";

let program, browser, worlds, many, bowled;
const STILL = { reducedMotion: "reduce" }; // for what is not about motion
const MANY = 60; // samples, more than a page of the gallery

before(async () => {
  [program, browser] = await Promise.all([startProgram({ world: "bowling", samples: 3 }), startBrowser()]);
  ({ worlds } = await api(program, "/v1/worlds"));
  bowled = (await api(program, "/v1/scenarios")).scenarios[0].id;
  ({ id: many } = await api(program, "/v1/scenarios", json({ world: "ball2d", title: "Many of them", constraints: [{ kind: "rest_position", x: 1 }] })));
  await api(program, `/v1/scenarios/${many}/chains`, json({ count: 1, seed: 5, stop: { samples: MANY } }));
  for (const id of [bowled, many]) await idle(program, id);
});
after(async () => {
  await browser?.close();
  await program?.end();
  await program?.remove();
});

/** Waits until no chain of a scenario runs. */
async function idle(of, id) {
  const end = Date.now() + 4 * PATIENCE;
  while ((await api(of, `/v1/scenarios/${id}/chains`)).chains.some(({ state }) => state !== "finished")) {
    assert.ok(Date.now() < end, "its chains end");
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

const listed = async (order = "newest") => (await api(program, `/v1/scenarios/${many}/samples?limit=500&order=${order}`)).samples.map(({ id }) => id);
/** Keeps every notice of the page, so that one that has gone again is heard too. */
const listen = (page) => page.addInitScript(() => {
  window.heard = [];
  new MutationObserver((records) => {
    for (const { addedNodes } of records) for (const node of addedNodes) if (node.matches?.(".notice") && node.checkVisibility()) window.heard.push(node.textContent);
  }).observe(document, { childList: true, subtree: true });
});
const hears = (page, text) => page.waitForFunction((wanted) => window.heard.some((said) => said.includes(wanted)), text);
const isHidden = (page) => page.locator(".player").waitFor({ state: "hidden" });
const frame = (page) => page.evaluate(() => document.querySelector("canvas.stage").toDataURL());

/** What comes with the next frames. @param {() => Promise<boolean>} condition @param {string} what */
async function soon(condition, what) {
  for (const end = Date.now() + 5000; !(await condition()); await new Promise((resolve) => setTimeout(resolve, 50)))
    if (Date.now() > end) assert.fail(what);
}

test("an address without a scenario shows an animation that plays, and a card for each world", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.address);
  await page.locator(".hero-link .shot.drawn").waitFor();
  await shows(page, ".hero-link .shot", 500);
  const was = await frame(page);
  await page.waitForFunction((picture) => document.querySelector("canvas.stage").toDataURL() !== picture, was);
  assert.match(await page.locator(".first .sentence").textContent(), /^A strike: all 10 pins go down\.$/);
  assert.deepEqual(await page.locator(".world").evaluateAll((cards) => cards.map(({ dataset }) => dataset.world)), worlds.map(({ name }) => name));
  for (const { name, summary } of worlds) assert.ok((await page.locator(`.world[data-world="${name}"]`).textContent()).includes(summary));
  for (const name of ["bowling", "ball2d"]) {
    await page.locator(`.world[data-world="${name}"]`).scrollIntoViewIfNeeded();
    await page.locator(`.world[data-world="${name}"] .shot.drawn`).waitFor();
  }
  assert.equal(await page.locator('#scenario-list [aria-current="page"]').count(), 0);
  await picture(page, "first-light");

  await page.locator('.world[data-world="bowling"] a').click();
  await arrived(page, { scenario: bowled });
  assert.equal(await page.locator("#scenario h1").textContent(), "A strike");
  await page.goBack();
  await page.locator(".first").waitFor();
  // A world that has no scenario here offers to make one.
  await page.locator('.world[data-world="dice"] a').click();
  await arrived(page, { create: "dice" });
  await page.keyboard.press("Escape");
  await arrived(page, { create: null });
  await page.locator(".first").waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("the animation of the first screen opens in the large view, and from there the way leads to its gallery", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.address);
  await page.locator(".hero-link .shot.drawn").waitFor();
  await page.locator(".hero-link").click();
  await arrived(page, { scenario: bowled });
  const { samples } = await api(program, `/v1/scenarios/${bowled}/samples`);
  assert.ok(samples.some(({ id }) => id === query(page).sample));
  await page.locator(".player .picture.drawn").waitFor();
  await page.keyboard.press("Escape");
  await arrived(page, { scenario: bowled, sample: null });
  await isHidden(page);
  await page.goBack();
  await page.locator(".first").waitFor();
  await page.getByRole("link", { name: /^All \d+ animations$/ }).click();
  await arrived(page, { scenario: bowled });
  await page.locator(".brand").click();
  await arrived(page, { scenario: null });
  await page.locator(".hero-link .shot.drawn").waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("the first screen rests for readers who want less motion, and plays when asked to", async () => {
  const { page, faults, close } = await newPage(browser, { reducedMotion: "reduce" });
  await page.goto(program.address);
  await page.locator(".hero-link .shot.drawn").waitFor();
  await page.waitForFunction(() => {
    const was = window.lastPicture;
    window.lastPicture = document.querySelector("canvas.stage").toDataURL();
    return was === window.lastPicture;
  }, null, { polling: 400 });
  const was = await frame(page);
  await page.getByRole("button", { name: "Play all" }).click();
  await arrived(page, { play: "on" });
  await page.waitForFunction((picture) => document.querySelector("canvas.stage").toDataURL() !== picture, was);
  assert.deepEqual(faults, []);
  await close();
});

test("with nothing in stock the first screen says so, and comes to life with the first animation", async () => {
  const empty = await startProgram({ world: null, examples: false });
  const { page, faults, close } = await newPage(browser);
  // Timers may come a little early.
  await page.addInitScript(() => {
    const real = window.setTimeout;
    window.setTimeout = (work, delay, ...rest) => real(work, delay > 1000 ? delay - 5 : delay, ...rest);
  });
  await page.goto(empty.address);
  await page.locator(".first .sentence", { hasText: "There is no scenario yet." }).waitFor();
  await page.waitForFunction(() => document.getElementById("connection").dataset.state === "live");
  const { id } = await api(empty, "/v1/scenarios", json({ world: "ball2d", title: "The first", constraints: [] }));
  await page.locator(".first .sentence", { hasText: "No scenario has an animation yet." }).waitFor();
  assert.equal(await page.locator(".hero-link .shot.drawn").count(), 0);
  await api(empty, `/v1/scenarios/${id}/chains`, json({ stop: { samples: 3 } }));
  await page.locator(".hero-link .shot.drawn").waitFor();
  await page.locator(".first .sentence", { hasText: "The first: " }).waitFor();
  assert.deepEqual(faults, []);
  await close();
  await empty.end();
  await empty.remove();
});

test("without WebGL the first screen has words and ways", async () => {
  const plain = await startBrowser({ webgl: false });
  const { page, faults, close } = await newPage(plain);
  await page.goto(program.address);
  await page.locator("#no-webgl").waitFor();
  await page.locator(".first .sentence", { hasText: "A strike" }).waitFor();
  assert.equal(await page.locator(".first .shot:visible").count(), 0);
  await page.locator('.world[data-world="ball2d"] a').click();
  await arrived(page, { scenario: many });
  assert.deepEqual(faults, []);
  await close();
  await plain.close();
});

test("the open scenario is in view in the list, marked, and the page does not scroll for it", async () => {
  const full = await startProgram({ world: null, examples: false });
  const ids = [];
  for (let at = 0; at < 40; ++at) ids.push((await api(full, "/v1/scenarios", json({ world: "ball2d", title: `Number ${at}`, constraints: [{ kind: "rest_position", x: 0.02 * at }] }))).id);
  for (const options of [{}, { viewport: { width: 390, height: 844 } }]) {
    const { page, faults, close } = await newPage(browser, { ...STILL, ...options });
    // The oldest is the last of the list.
    await page.goto(`${full.address}?scenario=${ids[0]}`);
    const current = page.locator('#scenario-list [aria-current="page"]');
    await current.waitFor();
    const isInView = () => current.evaluate((link) => {
      const { left, right, top, bottom } = link.getBoundingClientRect();
      const frame = link.closest(innerWidth < 860 ? "#scenario-list" : "nav").getBoundingClientRect();
      return left >= frame.left - 1 && right <= frame.right + 1 && top >= frame.top - 1 && bottom <= Math.min(innerHeight, frame.bottom) + 1;
    });
    await soon(isInView, "after the page came");
    assert.equal(await page.evaluate(() => scrollY), 0);
    assert.equal(await current.textContent().then((text) => text.startsWith("Number 0")), true);
    await page.evaluate(async (id) => (await import("/app/url_state.js")).go({ scenario: id }), ids[39]);
    await page.waitForFunction(() => document.querySelector('#scenario-list [aria-current="page"]').textContent.startsWith("Number 39"));
    await soon(isInView, "after another one was opened");
    assert.equal(await current.count(), 1);
    assert.deepEqual(faults, []);
    await close();
  }
  await full.end();
  await full.remove();
});

test("a scenario that is found below what is loaded keeps its place in the list", async () => {
  const { page, faults, close } = await newPage(browser, STILL);
  const made = (id, at, samples = 0) => ({ id, world: "ball2d", world_version: 1, title: id, model: {}, constraints: [], created_at: `2026-01-01T00:00:0${at}.000Z`, samples, chains: { running: 0, paused: 0, finished: 0, failed: 0 }, odds: null, difficulty: null });
  const old = made("old", 1);
  // A stream that stays open: after one that ends the page asks for the whole list again.
  await page.addInitScript(() => {
    window.EventSource = class extends EventTarget {
      constructor() {
        super();
        window.stream = this;
      }
      close() {}
    };
  });
  const tell = (...scenarios) => page.evaluate((told) => told.forEach((one) => window.stream.dispatchEvent(new MessageEvent("scenario", { data: JSON.stringify(one) }))), scenarios);
  let answer = () => {};
  await page.route("**/v1/scenarios?*", async (route) => {
    await answer();
    await route.fulfill({ json: { scenarios: route.request().url().includes("cursor") ? [old] : [made("new", 5), made("newer", 4)], ...(route.request().url().includes("cursor") ? {} : { next_cursor: "c" }) } });
  });
  await page.goto(program.address);
  const titles = () => page.locator(".scenario-title").allTextContents();
  await page.waitForFunction(() => document.querySelectorAll(".scenario-title").length === 2);
  await tell(made("newest", 6), { ...old, samples: 7 });
  await page.waitForFunction(() => document.querySelectorAll(".scenario-title").length === 3);
  assert.deepEqual(await titles(), ["newest", "new", "newer"], "what is further down does not come up because something happens to it");

  // What is told while the list is on its way is newer than the list.
  let asked;
  const isAsked = new Promise((resolve) => (asked = resolve));
  let go;
  const mayGo = new Promise((resolve) => (go = resolve));
  answer = () => (asked(), mayGo);
  const loaded = page.evaluate(async () => (await import("/app/catalog.js")).loadScenarios());
  await isAsked;
  await tell(made("last", 7), { ...made("new", 5), chains: { running: 1, paused: 0, finished: 0, failed: 0 } });
  go();
  await loaded;
  await page.waitForFunction(() => ![...document.querySelectorAll(".scenario-title")].some(({ textContent }) => textContent === "newest"));
  assert.deepEqual(await titles(), ["last", "new", "newer"]);
  assert.match(await page.locator('[data-scenario="new"]').textContent(), /1 running/);
  await page.unroute("**/v1/scenarios?*");
  assert.deepEqual(faults, []);
  await close();
});

test("next and previous work after a reload, also far below what the gallery has loaded", async () => {
  const { page, faults, close } = await newPage(browser, STILL);
  for (const order of ["newest", "likely"]) {
    const ids = await listed(order);
    const at = MANY - 3;
    await page.goto(`${program.address}?scenario=${many}&order=${order}&sample=${ids[at]}`);
    await page.locator(".player .picture.drawn").waitFor();
    const [previous, next] = [page.getByRole("button", { name: /^Previous/ }), page.getByRole("button", { name: /^Next/ })];
    await page.waitForFunction(() => [...document.querySelectorAll(".player-head button")].every((button) => !button.disabled));
    await next.click();
    await arrived(page, { sample: ids[at + 1] });
    await page.waitForFunction(() => [...document.querySelectorAll(".player-head button")].every((button) => !button.disabled));
    await page.keyboard.press("k");
    await arrived(page, { sample: ids[at + 2] });
    await page.waitForFunction(() => document.querySelector(".player-head button:nth-of-type(2)").disabled);
    await page.reload();
    await page.waitForFunction(() => !document.querySelector(".player-head button").disabled);
    await previous.click();
    await arrived(page, { sample: ids[at + 1] });
  }
  assert.deepEqual(faults, []);
  await close();
});

test("the way back from the large view leads to the gallery where it was", async () => {
  const { page, faults, close } = await newPage(browser, STILL);
  await page.goto(program.address);
  await page.locator('.world[data-world="ball2d"] a').click();
  await arrived(page, { scenario: many });
  await drawnTiles(page);
  await page.evaluate(() => scrollTo(0, 500));
  const tile = page.locator(".tile-link").nth(13);
  await tile.scrollIntoViewIfNeeded();
  const at = await page.evaluate(() => scrollY);
  assert.ok(at > 100);
  await tile.click();
  await page.locator(".player .picture.drawn").waitFor();
  await page.goBack();
  await isHidden(page);
  assert.equal(await page.evaluate(() => scrollY), at);
  // The same by Esc: what was closed is not met again on the way back. Details that were chosen stay.
  await tile.click();
  await page.locator(".player .picture.drawn").waitFor();
  await page.getByLabel("Speed").selectOption("0.5");
  for (let step = 0; step < 3; ++step) {
    const { sample } = query(page);
    await page.keyboard.press("k");
    await page.waitForFunction((was) => new URLSearchParams(location.search).get("sample") !== was, sample);
  }
  const last = query(page).sample;
  await page.keyboard.press("Escape");
  await arrived(page, { sample: null, scenario: many, speed: "0.5" });
  await isHidden(page);
  const isInView = () => page.locator(`.tile[data-sample="${last}"]`).evaluate((element) => {
    const { top, bottom } = element.getBoundingClientRect();
    return top >= 60 && bottom <= innerHeight;
  });
  await soon(isInView, "the animation that was seen last");
  await page.goBack();
  await page.locator(".first").waitFor();
  await page.goForward();
  await arrived(page, { scenario: many, sample: null });
  assert.deepEqual(faults, []);
  await close();
});

test("after a deep link Esc leads to the gallery, one thing at a time, and not out of the page", async () => {
  const { page, faults, close } = await newPage(browser, STILL);
  const ids = await listed();
  await page.goto(`${program.address}?scenario=${many}&sample=${ids[2]}&create=ball2d`);
  await page.locator(".player .picture.drawn").waitFor();
  await page.locator("#create[open]").waitFor();
  await page.locator("#scenario-text").waitFor();
  const steps = await page.evaluate(() => history.length);
  await page.keyboard.press("Escape");
  await isHidden(page);
  await arrived(page, { sample: null, create: "ball2d" });
  assert.ok(await page.locator("#create").isVisible(), "only the upper one is closed");
  await page.keyboard.press("Escape");
  await page.locator("#create").waitFor({ state: "hidden" });
  await arrived(page, { create: null, scenario: many });
  await drawnTiles(page);
  await page.keyboard.press("Escape");
  assert.equal(query(page).scenario, many);
  assert.equal(await page.evaluate(() => history.length), steps);
  // After a reload Esc still knows the way.
  await page.locator(".tile-link").first().click();
  await page.locator(".player .picture.drawn").waitFor();
  await page.reload();
  await page.locator(".player .picture.drawn").waitFor();
  await page.keyboard.press("Escape");
  await isHidden(page);
  await arrived(page, { sample: null, scenario: many });
  await drawnTiles(page);
  assert.deepEqual(faults, []);
  await close();
});

test("a sample alone in the address finds its gallery, one of another scenario leads there, and one that is gone is said", async () => {
  const { page, faults, close } = await newPage(browser, STILL, /\b404\b/);
  await listen(page);
  const [first] = await listed();
  await page.goto(`${program.address}?sample=${first}`);
  await arrived(page, { scenario: many, sample: first });
  await page.locator(".player .picture.drawn").waitFor();
  assert.deepEqual(await page.evaluate(() => window.heard), []);
  await page.keyboard.press("Escape");
  await isHidden(page);
  await drawnTiles(page);

  await page.goto(`${program.address}?scenario=${bowled}&sample=${first}`);
  await arrived(page, { scenario: many, sample: first });
  await hears(page, "belongs to another scenario");
  await page.waitForFunction(() => !document.querySelector(".player-head button:nth-of-type(2)").disabled);

  await page.goto(`${program.address}?scenario=${bowled}&sample=nope`);
  await hears(page, "There is no animation “nope”");
  await isHidden(page);
  await arrived(page, { scenario: bowled, sample: null });
  await drawnTiles(page, 3);
  assert.deepEqual(faults, []);
  await close();
});

test("whatever nonsense a parameter holds, the page says so and works", async () => {
  const { page, faults, close } = await newPage(browser, STILL, /\b404\b/);
  await listen(page);
  await page.goto(program.address);
  const names = await page.evaluate(async () => Object.keys((await import("/app/url_state.js")).place()));
  const [sample] = await listed();
  /** What makes a parameter matter at all. */
  const beside = { chain: { tab: "chains" }, quantity: { tab: "chains" }, quantities: { tab: "chains" }, start: { tab: "chains" }, t: { sample }, speed: { sample }, loop: { sample }, path: { sample }, camera: { sample }, takes: { scenario: "", together: many } };
  /** Where it is said that is no notice. */
  const places = { scenario: "#scenario .empty", together: ".together .shot-note" };
  const junk = { t: "-1", camera: "1,2,x,4,5,6" };
  // The ground's colours are in the tests of dice.
  for (const name of names.filter((each) => each !== "color")) {
    const value = junk[name] ?? "nope";
    await page.goto(`${program.address}?${new URLSearchParams({ scenario: many, ...beside[name], [name]: value })}`);
    if (places[name]) await page.locator(places[name], { hasText: "not here" }).waitFor();
    else await page.waitForFunction(() => window.heard.length).catch(() => assert.fail(`nothing is said of ${name}`));
    assert.ok(places[name] || (await page.evaluate(() => window.heard.join())).includes(value), `what is said of ${name}`);
    await page.waitForFunction(([key, was]) => new URLSearchParams(location.search).get(key) !== was, [name, places[name] ? "" : value]);
    for (const dialog of ["#create", ".player"]) {
      if (!(await page.locator(dialog).isVisible())) continue;
      await page.keyboard.press("Escape");
      await page.locator(dialog).waitFor({ state: "hidden" });
    }
    await page.locator(".scenario-link", { hasText: "A strike" }).click();
    await arrived(page, { scenario: bowled, together: null, sample: null }).catch(() => assert.fail(`after ${name}: ${page.url()}`));
    await page.locator("#scenario h1", { hasText: "A strike" }).waitFor();
  }
  assert.deepEqual(faults, []);
  await close();
});
