// Spelling: marbles that spell HI, drawn as glass in a box, seen from above, told as a text.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, newPage, picture, shows, startBrowser, startProgram } from "./fixture.mjs";

let program, browser, scenario, sample, keyframes;
before(async () => {
  [program, browser] = await Promise.all([startProgram({ world: "spelling", samples: 2 }), startBrowser()]);
  scenario = (await api(program, "/v1/scenarios")).scenarios[0].id;
  while (!sample) [sample] = (await api(program, `/v1/scenarios/${scenario}/samples?limit=1`)).samples;
  keyframes = await api(program, `/v1/samples/${sample.id}/keyframes`);
});
after(async () => {
  await browser?.close();
  await program?.end();
  await program?.remove();
});

test("a word's document has its marbles, the box with its partitions, and what is wished", () => {
  const names = keyframes.bodies.map(({ name }) => name);
  const marbles = Array.from({ length: 10 }, (_, at) => `marble_${at + 1}`);
  assert.deepEqual(names, [...marbles, "partitions", "floors", "wall_far", "wall_near", "wall_left", "wall_right", "table", "target"]);
  assert.equal(keyframes.tracks.length, 10);
  for (const { position } of keyframes.tracks) assert.ok(position.at(-2) < 0.014, "it lies below the rim");
  assert.ok(keyframes.view.elevation > 0.8, "seen from above");
});

test("it is drawn without a fault, and its lists of measures are told", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?scenario=${scenario}&sample=${sample.id}&t=${keyframes.duration}`);
  await page.locator(".player .picture.drawn").waitFor();
  await shows(page, ".picture", 1000);
  assert.equal(await page.locator(".facts-panel .note").count(), 0, "every body is drawn as itself");
  await picture(page, "spelling-light");
  const said = (name) => page.locator(".facts").first().locator("> div", { has: page.getByText(name, { exact: true }) }).locator("dd").textContent();
  assert.equal(await said("filled bins"), "10");
  assert.equal(await said("bin of ball"), sample.measures.bin_of_ball.join(", "));
  assert.equal(await page.locator("#scenario .sentence").textContent(), "The marbles spell “HI”.");
  assert.deepEqual(faults, []);
  await close();
});
