// A new scenario: every fault is shown where it is, then it is created and fills.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, drawnTiles, newPage, query, startBrowser, startProgram } from "./fixture.mjs";

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

test("faults are shown with their pointers, then the scenario is created, fills, and can be deleted", async () => {
  // The browser itself tells the console of every refusal.
  const { page, faults, close } = await newPage(browser, {}, /\b(400|422)\b/);
  await page.goto(program.address);
  await page.getByRole("button", { name: "New", exact: true }).click();
  await arrived(page, { create: "any" });
  const text = page.getByLabel("The scenario, as JSON");
  await page.getByRole("radio", { name: /^ball2d/ }).check();
  await arrived(page, { create: "ball2d" });
  await page.waitForFunction(() => document.getElementById("scenario-text").value.includes('"ball2d"'));
  const example = JSON.parse(await text.inputValue());

  await text.fill("{");
  await page.getByRole("button", { name: "Create" }).click();
  await page.locator(".faults > p").waitFor();

  const wish = { ...example, title: "To the left", constraints: [{ kind: "rest_position", x: "left", sd: -1 }] };
  await text.fill(JSON.stringify(wish, null, 2));
  await page.getByRole("button", { name: "Create" }).click();
  const fault = page.locator(".fault-place", { hasText: "/constraints/0/x" });
  await fault.waitFor();
  await page.locator(".fault-place", { hasText: "/constraints/0/sd" }).waitFor();
  await fault.click();
  const selected = await text.evaluate((field) => field.value.slice(field.selectionStart, field.selectionEnd));
  assert.equal(selected, '"left"');

  wish.constraints = [{ kind: "rest_position", x: -1, sd: 0.1 }];
  await text.fill(JSON.stringify(wish, null, 2));
  await page.getByRole("button", { name: "Create" }).click();
  await page.waitForFunction(() => document.querySelector("#scenario h1")?.textContent === "To the left");
  const { scenario } = query(page);
  assert.equal((await api(program, `/v1/scenarios/${scenario}`)).title, "To the left");
  await page.locator(`#scenario-list [data-scenario="${scenario}"] [aria-current="page"]`).waitFor();
  await drawnTiles(page, 2);

  await page.getByText("The scenario as it was asked for").click();
  await page.getByRole("button", { name: "Delete scenario" }).click();
  await page.getByRole("button", { name: "Delete it with all its animations?" }).click();
  await page.locator(`#scenario-list [data-scenario="${scenario}"]`).waitFor({ state: "detached" });
  assert.deepEqual(faults, []);
  await close();
});
