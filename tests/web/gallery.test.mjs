// The gallery: it fills by itself, shows pictures, keeps its order in the address.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, drawnTiles, json, newPage, shows, startBrowser, startProgram } from "./fixture.mjs";

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

test("an example is there and its tiles come by themselves, drawn and moving", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.gallery);
  await page.locator("#scenario-list .scenario-link").first().waitFor();
  const { scenarios } = await api(program, "/v1/scenarios");
  assert.equal(await page.locator("#scenario h1").textContent(), scenarios[0].title);
  await drawnTiles(page, 6);
  await page.waitForFunction(() => document.getElementById("connection").dataset.state === "live");
  await shows(page, ".tile:nth-child(1) .shot", 40);
  const pixels = () => page.evaluate(() => document.querySelector("canvas.stage").toDataURL());
  const first = await pixels();
  await page.waitForFunction((was) => document.querySelector("canvas.stage").toDataURL() !== was, first);
  assert.deepEqual(faults, []);
  await close();
});

test("the order is in the address, and the back button undoes it", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.gallery);
  await drawnTiles(page);
  await page.getByRole("button", { name: "Likeliest" }).click();
  await arrived(page, { order: "likely" });
  const scenario = (await api(program, "/v1/scenarios")).scenarios[0].id;
  const likeliest = async () => (await api(program, `/v1/scenarios/${scenario}/samples?limit=1&order=likely`)).samples[0].id;
  const tops = [await likeliest()];
  await page.waitForFunction((top) => document.querySelector(".tile")?.dataset.sample === top, tops[0]).catch(async () => {
    // A chain that still runs may have found a likelier one meanwhile; then the chip shows it.
    await page.getByRole("button", { name: /new$/ }).click();
    await page.waitForFunction((top) => document.querySelector(".tile")?.dataset.sample === top, await likeliest());
  });
  await page.reload();
  await drawnTiles(page);
  assert.equal(await page.locator('[data-order="likely"]').getAttribute("aria-pressed"), "true");
  await page.goBack();
  await arrived(page, { order: null });
  await page.waitForFunction(() => document.querySelector('[data-order="newest"]').getAttribute("aria-pressed") === "true");
  assert.deepEqual(faults, []);
  await close();
});

test("more animations come when the end of the list is near", async () => {
  const { page, faults, close } = await newPage(browser);
  const scenario = (await api(program, "/v1/scenarios")).scenarios[0].id;
  await api(program, `/v1/scenarios/${scenario}/chains`, json({ stop: { samples: 40 } }));
  await page.goto(`${program.address}?scenario=${scenario}&order=oldest`);
  await page.waitForFunction(() => document.querySelectorAll(".tile").length >= 24);
  await page.waitForFunction(() => {
    scrollTo(0, document.documentElement.scrollHeight);
    return document.querySelectorAll(".tile").length > 30;
  });
  const shown = await page.locator(".tile").evaluateAll((tiles) => tiles.map((tile) => tile.dataset.sample));
  assert.equal(new Set(shown).size, shown.length);
  const { samples } = await api(program, `/v1/scenarios/${scenario}/samples?order=oldest&limit=${shown.length}`);
  assert.deepEqual(shown, samples.map((sample) => sample.id));
  assert.deepEqual(faults, []);
  await close();
});

test("what is found while one looks waits behind a chip, and nothing jumps", async () => {
  const { page, faults, close } = await newPage(browser);
  const scenario = (await api(program, "/v1/scenarios")).scenarios[0].id;
  await page.goto(`${program.address}?scenario=${scenario}`);
  await page.waitForFunction(() => document.querySelectorAll(".tile").length >= 24);
  await page.waitForFunction(() => document.getElementById("connection").dataset.state === "live");
  const newest = () => page.locator(".tile").first().getAttribute("data-sample");
  const was = await newest();
  await page.getByRole("button", { name: "Find 50 more" }).click();
  await page.getByRole("button", { name: "50 new", exact: true }).waitFor();
  assert.equal(await newest(), was);
  await page.getByRole("button", { name: "50 new", exact: true }).click();
  const { samples } = await api(program, `/v1/scenarios/${scenario}/samples?limit=1`);
  await page.waitForFunction((id) => document.querySelector(".tile").dataset.sample === id, samples[0].id);
  await page.locator(".chip").waitFor({ state: "hidden" });
  assert.deepEqual(faults, []);
  await close();
});

test("tiles rest for readers who want less motion, play under the pointer, and all play when asked to", async () => {
  const { page, faults, close } = await newPage(browser, { reducedMotion: "reduce" });
  await page.goto(program.gallery);
  await drawnTiles(page, 6);
  const stands = () => page.waitForFunction(() => {
    const was = window.lastPicture;
    window.lastPicture = document.querySelector("canvas.stage").toDataURL();
    return was === window.lastPicture;
  }, null, { polling: 400 });
  const moves = async () => {
    const was = await page.evaluate(() => document.querySelector("canvas.stage").toDataURL());
    await page.waitForFunction((picture) => document.querySelector("canvas.stage").toDataURL() !== picture, was);
  };
  await stands();
  await page.locator(".tile-link").nth(1).hover();
  await moves();
  await moves();
  await page.locator("h1").hover();
  await stands();
  const play = page.getByRole("button", { name: "Play all" });
  assert.equal(await play.getAttribute("aria-pressed"), "false");
  await play.click();
  await arrived(page, { play: "on" });
  await page.waitForFunction(() => document.querySelector(".toggle").getAttribute("aria-pressed") === "true");
  await moves();
  await page.goBack();
  await arrived(page, { play: null });
  await stands();
  assert.deepEqual(faults, []);
  await close();
});
