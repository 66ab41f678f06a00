// Light and dark, wide and narrow, with and without 3D graphics, with and without a server.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { arrived, drawnTiles, newPage, picture, query, shows, startBrowser, startProgram } from "./fixture.mjs";

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

const background = (page) => page.evaluate(() => getComputedStyle(document.documentElement).backgroundColor);

test("light and dark follow the system, and the button overrules it for good", async () => {
  const { page, faults, close } = await newPage(browser, { colorScheme: "light" });
  await page.goto(program.gallery);
  await drawnTiles(page, 8);
  const light = await background(page);
  await picture(page, "gallery-light");
  await page.emulateMedia({ colorScheme: "dark" });
  await page.waitForFunction(() => document.documentElement.dataset.theme === "dark");
  assert.notEqual(await background(page), light);
  await picture(page, "gallery-dark");
  await page.locator(".tile-link").first().click();
  await page.locator(".player .picture.drawn").waitFor();
  await page.waitForFunction(() => document.querySelector(".scrub").valueAsNumber > 1);
  await picture(page, "animation-dark");
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Light theme" }).click();
  await arrived(page, { theme: "light" });
  assert.equal(await background(page), light);
  await page.goto(program.gallery);
  await page.waitForFunction(() => document.documentElement.dataset.theme === "light");
  await page.getByRole("tab", { name: /Chains/ }).click();
  await page.locator(".uplot canvas").waitFor();
  await picture(page, "chains-light");
  assert.deepEqual(faults, []);
  await close();
});

test("at 390 pixels nothing sticks out and everything is reachable", async () => {
  const { page, faults, close } = await newPage(browser, { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  const fits = async (where) =>
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= document.documentElement.clientWidth), `${where} fits`);
  await page.goto(program.gallery);
  await drawnTiles(page, 2);
  await fits("the gallery");
  await picture(page, "gallery-narrow");
  await page.locator(".tile-link").first().tap();
  await page.locator(".player .picture.drawn").waitFor();
  await page.waitForFunction(() => document.querySelector(".scrub").valueAsNumber > 0.5);
  for (const name of ["Pause", /Close/]) assert.ok(await page.getByRole("button", { name }).isVisible());
  await shows(page, ".picture", 60);
  await picture(page, "animation-narrow");
  await page.getByRole("button", { name: /Close/ }).tap();
  await arrived(page, { sample: null });
  await page.getByRole("tab", { name: /Chains/ }).tap();
  await page.locator(".headline").first().waitFor();
  await page.locator(".quantities tbody tr").first().waitFor();
  await fits("the chains");
  await picture(page, "chains-narrow");
  await page.getByRole("button", { name: "Start chains" }).tap();
  await page.locator(".start-chains .choice").first().waitFor();
  await fits("the form that starts chains");
  await picture(page, "start-chains-narrow");
  await page.getByRole("button", { name: "Close" }).tap();
  await arrived(page, { start: null });
  await page.getByRole("button", { name: "New", exact: true }).tap();
  await page.getByRole("button", { name: "Create" }).waitFor();
  await fits("the form");
  assert.deepEqual(faults, []);
  await close();
});

test("without WebGL it says so, and lists, facts and chains work", async () => {
  const plain = await startBrowser({ webgl: false });
  const { page, faults, close } = await newPage(plain);
  await page.goto(program.gallery);
  await page.locator("#no-webgl").waitFor();
  await page.waitForFunction(() => document.querySelectorAll(".tile").length >= 4);
  await page.locator(".tile-link").first().click();
  await page.waitForFunction(() => document.querySelectorAll(".variables > div").length > 0);
  await page.keyboard.press("Escape");
  await arrived(page, { sample: null });
  await page.getByRole("tab", { name: /Chains/ }).click();
  await page.locator("tr[data-chain]").first().waitFor();
  assert.equal(query(page).tab, "chains");
  assert.deepEqual(faults, []);
  await close();
  await plain.close();
});

test("without a stream to spare the page asks for news instead", async () => {
  const crowded = await startProgram();
  const streams = [];
  for (let refused = false; !refused && streams.length < 64; ) {
    const ending = new AbortController();
    const response = await fetch(new URL("/v1/events", crowded.address), { signal: ending.signal });
    refused = response.status === 429;
    streams.push({ ending, response }); // a response that nobody holds is collected, and its stream ends
  }
  const { page, faults, close } = await newPage(browser, {}, /\b429\b/);
  await page.goto(crowded.gallery);
  await page.waitForFunction(() => document.getElementById("connection").dataset.state === "asking");
  assert.ok(await page.locator("#banner").isHidden());
  await drawnTiles(page, 2);
  for (const { ending } of streams) ending.abort();
  await page.waitForFunction(() => document.getElementById("connection").dataset.state === "live");
  assert.deepEqual(faults, []);
  await close();
  await crowded.end();
  await crowded.remove();
});

test("while the server is gone a banner says so, and the page comes back by itself", async () => {
  const first = await startProgram();
  // A browser tells the console of every request that finds nobody.
  const { page, faults, close } = await newPage(browser, {}, /ERR_(CONNECTION_REFUSED|INCOMPLETE_CHUNKED_ENCODING|CONNECTION_RESET|EMPTY_RESPONSE|NETWORK_CHANGED)|\b503\b/);
  await page.goto(first.gallery);
  await drawnTiles(page, 2);
  await first.end();
  await page.locator("#banner").waitFor();
  assert.ok((await page.locator(".tile").count()) >= 2, "what was shown stays");
  const again = await startProgram({ store: first.store, port: first.port });
  await page.locator("#banner").waitFor({ state: "hidden" });
  await page.waitForFunction(() => document.getElementById("connection").dataset.state === "live");
  assert.ok((await page.locator(".scenario-link").count()) >= 1);
  assert.deepEqual(faults, []);
  await close();
  await again.end();
  await first.remove();
});
