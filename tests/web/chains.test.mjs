// The chains: started, held, let go on and ended from the page; their trace.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, json, newPage, startBrowser, startProgram } from "./fixture.mjs";

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

test("a chain is started, paused, resumed and stopped, live", async () => {
  const { page, faults, close } = await newPage(browser);
  // A wish that is all but impossible, so that the chain runs until it is told otherwise.
  const wish = { world: "ball2d", title: "Too exact", model: {}, constraints: [{ kind: "rest_position", x: 1, tolerance: 1e-9 }] };
  const scenario = (await api(program, "/v1/scenarios", json(wish))).id;
  await page.goto(`${program.address}?scenario=${scenario}`);
  await page.getByRole("tab", { name: /Chains/ }).click();
  await arrived(page, { tab: "chains" });
  const known = (await api(program, `/v1/scenarios/${scenario}/chains`)).chains.map((chain) => chain.id);
  await page.waitForFunction((count) => document.querySelectorAll("tr[data-chain]").length >= count, known.length);

  await page.getByRole("button", { name: "Start chains" }).click();
  await arrived(page, { start: "on" });
  await page.getByLabel("Animations that count").fill("");
  await page.getByLabel("Seed").fill("11");
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await arrived(page, { start: null });
  await page.waitForFunction((ids) => [...document.querySelectorAll("tr[data-chain]")].some((row) => !ids.includes(row.dataset.chain)), known);
  const { chains } = await api(program, `/v1/scenarios/${scenario}/chains`);
  const chain = chains.find(({ id }) => !known.includes(id));
  assert.equal(chain.seed, 11);
  const row = page.locator(`tr[data-chain="${chain.id}"]`);
  const shows = (state) => row.locator(`.state[data-state="${state}"]`).waitFor();
  const serverSays = async (state) => assert.equal((await api(program, `/v1/chains/${chain.id}`)).state, state);

  await row.getByRole("button", { name: "Pause" }).click();
  await shows("paused");
  await serverSays("paused");
  await row.getByRole("button", { name: "Resume" }).click();
  await shows("running");
  const iterations = () => row.locator('td[data-label="Iterations"]').textContent();
  const before = await iterations();
  await page.waitForFunction(([id, was]) => document.querySelector(`tr[data-chain="${id}"] td[data-label="Iterations"]`).textContent !== was, [chain.id, before]);
  await row.getByRole("button", { name: "Stop" }).click();
  await shows("finished");
  await serverSays("finished");
  assert.deepEqual(faults, []);
  await close();
});

test("chains are shown whole, however many pages of them there are", async () => {
  const { page, faults, close } = await newPage(browser);
  const scenario = (await api(program, "/v1/scenarios")).scenarios.find(({ samples }) => samples > 0).id;
  const list = `/v1/scenarios/${scenario}/chains`;
  const [chain] = (await api(program, list)).chains;
  // Seven in pages of three, though more fit into one.
  const asked = [];
  await page.route(`**${list}?*`, (route) => {
    const { searchParams } = new URL(route.request().url());
    asked.push(searchParams.get("cursor"));
    const first = Number(searchParams.get("cursor") ?? 0);
    const chains = Array.from({ length: Math.min(3, 7 - first) }, (_, i) => ({ ...chain, id: `chain${first + i}`, index: first + i }));
    return route.fulfill({ json: { chains, ...(first + 3 < 7 && { next_cursor: String(first + 3) }) } });
  });
  await page.route("**/v1/events", (route) => route.fulfill({ contentType: "text/event-stream", body: ": nothing\n\n" }));
  await page.route("**/v1/chains/*/trace?*", (route) => route.fulfill({ json: { iteration: [], log_prior: [], log_constraint: [], satisfied: [] } }));
  await page.goto(`${program.address}?scenario=${scenario}&tab=chains`);
  await page.waitForFunction(() => document.querySelectorAll("tr[data-chain]").length === 7);
  assert.deepEqual(asked.slice(0, 3), [null, "3", "6"]);
  assert.deepEqual(faults, []);
  await close();
});

test("the trace is drawn; chain and quantity are in the address", async () => {
  const { page, faults, close } = await newPage(browser);
  const scenario = (await api(program, "/v1/scenarios")).scenarios.find(({ samples }) => samples > 0).id;
  await page.goto(`${program.address}?scenario=${scenario}&tab=chains`);
  await page.locator(".uplot canvas").waitFor();
  const inked = () => page.waitForFunction(() => {
    const canvas = document.querySelector(".uplot canvas");
    const copy = new OffscreenCanvas(canvas.width, canvas.height);
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(canvas, 0, 0);
    return context.getImageData(0, 0, copy.width, copy.height).data.some((value) => value > 0);
  });
  await inked();
  await page.getByLabel("Quantity").selectOption("log_prior");
  await arrived(page, { quantity: "log_prior" });
  await page.reload();
  await page.locator(".uplot canvas").waitFor();
  assert.equal(await page.getByLabel("Quantity").inputValue(), "log_prior");
  await inked();
  assert.deepEqual(faults, []);
  await close();
});
