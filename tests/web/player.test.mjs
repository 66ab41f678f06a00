// The large view: it plays, pauses, scrubs, and comes back from its address as it was.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, colorsOf, drawnTiles, newPage, query, startBrowser, startProgram } from "./fixture.mjs";

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

const time = (page) => page.locator(".scrub").evaluate((scrub) => scrub.valueAsNumber);
const passes = (page, than) => page.waitForFunction((least) => document.querySelector(".scrub").valueAsNumber > least, than);

async function openFirst(page) {
  await page.goto(program.address);
  await drawnTiles(page);
  await page.locator(".tile-link").first().click();
  await page.locator(".player .picture.drawn").waitFor();
}

test("it plays, pauses, steps by frames, scrubs, and survives a reload", async () => {
  const { page, faults, close } = await newPage(browser);
  await openFirst(page);
  await passes(page, 0.2);
  assert.ok((await colorsOf(page, ".picture")) > 60, "the large picture has many colours");

  await page.keyboard.press(" ");
  await page.getByRole("button", { name: "Play", exact: true }).waitFor();
  await page.waitForFunction(() => new URLSearchParams(location.search).has("t"));
  const paused = await time(page);
  assert.ok(Math.abs(Number(query(page).t) - paused) < 0.02, "the address says where it stands");

  await page.keyboard.press("Home");
  assert.equal(await time(page), 0);
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowRight");
  const { rate } = await api(program, `/v1/samples/${query(page).sample}/keyframes`);
  assert.ok(Math.abs((await time(page)) - 2 / rate) < 1e-3, "two frames on");

  const bar = await page.locator(".scrub").boundingBox();
  await page.mouse.click(bar.x + 0.6 * bar.width, bar.y + bar.height / 2);
  await page.waitForFunction(() => {
    const scrub = document.querySelector(".scrub");
    return Math.abs(scrub.valueAsNumber / Number(scrub.max) - 0.6) < 0.05;
  });
  await page.getByLabel("Speed").selectOption("0.25");
  await arrived(page, { speed: "0.25" });
  const left = { ...query(page), at: await time(page) };

  await page.reload();
  await page.locator(".player .picture.drawn").waitFor();
  await page.waitForFunction((at) => Math.abs(document.querySelector(".scrub").valueAsNumber - at) < 0.02, left.at);
  assert.equal(query(page).sample, left.sample);
  assert.equal(await page.getByLabel("Speed").inputValue(), "0.25");
  assert.equal(await page.getByRole("button", { name: "Play", exact: true }).count(), 1);

  await page.keyboard.press(" ");
  await passes(page, left.at + 0.02);
  assert.deepEqual(faults, []);
  await close();
});

test("the camera turns by dragging, and stays so on reload", async () => {
  const { page, faults, close } = await newPage(browser);
  await openFirst(page);
  const { x, y, width, height } = await page.locator(".picture").boundingBox();
  await page.mouse.move(x + width / 2, y + height / 2);
  await page.mouse.down();
  await page.mouse.move(x + width / 2 + 120, y + height / 2 + 30, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction(() => new URLSearchParams(location.search).has("camera"));
  const { camera } = query(page);
  await page.reload();
  await page.locator(".player .picture.drawn").waitFor();
  assert.equal(query(page).camera, camera);
  await page.getByRole("button", { name: /Show everything/ }).click();
  await arrived(page, { camera: null });
  assert.deepEqual(faults, []);
  await close();
});

test("it tells the measures, variables and contacts, and verifies the sample", async () => {
  const { page, faults, close } = await newPage(browser);
  await openFirst(page);
  const sample = await api(program, `/v1/samples/${query(page).sample}`);
  await page.waitForFunction((names) => document.querySelectorAll(".variables > div").length === names, Object.keys(sample.variables).length);
  assert.equal(await page.locator(".facts").first().locator("> div").count(), Object.keys(sample.measures).length);
  assert.ok((await page.locator(".tick").count()) > 0, "contacts are marked on the scrub bar");
  await page.getByRole("button", { name: "Verify" }).click();
  await page.locator('.verdict[data-identical="true"]').waitFor();
  const keyframes = await page.getByRole("link", { name: "Keyframes" }).getAttribute("href");
  assert.equal((await api(program, keyframes)).format, "retake.keyframes/1");
  assert.deepEqual(faults, []);
  await close();
});

test("keys open and close it, the back button leaves it, neighbours are one key away", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.address);
  await drawnTiles(page);
  await page.locator(".tile-link").first().focus();
  const first = await page.locator(".tile").first().getAttribute("data-sample");
  await page.keyboard.press("Enter");
  await arrived(page, { sample: first });
  await page.locator(".player .picture.drawn").waitFor();
  await page.keyboard.press("k");
  await page.waitForFunction((was) => new URLSearchParams(location.search).get("sample") !== was, first);
  await page.goBack();
  await arrived(page, { sample: first });
  await page.goBack();
  await arrived(page, { sample: null });
  await page.locator(".player").waitFor({ state: "hidden" });
  assert.ok((await colorsOf(page, ".tile:nth-child(1) .shot")) > 40, "the tiles are drawn again");
  await page.goForward();
  await page.locator(".player .picture.drawn").waitFor();
  await page.keyboard.press("Escape");
  await arrived(page, { sample: null });
  assert.deepEqual(faults, []);
  await close();
});
