// Bowling: a strike drawn as the lane is, seen from where the world says, told in the words of the lane.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, newPage, picture, shows, startBrowser, startProgram } from "./fixture.mjs";

let program, browser, scenario, sample, keyframes;
before(async () => {
  [program, browser] = await Promise.all([startProgram({ world: "bowling", samples: 2 }), startBrowser()]);
  scenario = (await api(program, "/v1/scenarios")).scenarios[0].id;
  while (!sample) [sample] = (await api(program, `/v1/scenarios/${scenario}/samples?limit=1`)).samples;
  keyframes = await api(program, `/v1/samples/${sample.id}/keyframes`);
});
after(async () => {
  await browser?.close();
  await program?.end();
  await program?.remove();
});

test("a strike's document has the ball, ten pins of revolution, and what stands still, in this order", () => {
  const names = keyframes.bodies.map(({ name }) => name);
  const pins = Array.from({ length: 10 }, (_, at) => `pin_${at + 1}`);
  assert.deepEqual(names.slice(0, 12), ["ball", ...pins, "lane"]);
  assert.equal(new Set(names).size, names.length);
  for (const name of pins) assert.equal(keyframes.bodies.find((body) => body.name === name).shape.type, "revolution");
  const scenery = keyframes.bodies.filter(({ track }) => track === undefined);
  assert.ok(JSON.stringify(scenery).length < 8000, "the scenery is small beside the motion");
});

test("it is drawn without a fault, from where the world says, and its measures have units", async () => {
  const { page, faults, close } = await newPage(browser);
  const moment = (sample.measures.first_contact + 0.2).toFixed(3);
  await page.goto(`${program.address}?scenario=${scenario}&sample=${sample.id}&t=${moment}`);
  await page.locator(".player .picture.drawn").waitFor();
  await shows(page, ".picture", 1000);
  assert.equal(await page.locator(".facts-panel .note").count(), 0, "every body is drawn as itself");
  await picture(page, "bowling-light");

  await page.locator(".picture").press("+");
  await page.mouse.move(200, 200);
  await page.mouse.down();
  await page.mouse.move(201, 200);
  await page.mouse.up();
  await page.waitForFunction(() => new URLSearchParams(location.search).has("camera"));
  const [azimuth, elevation] = new URL(page.url()).searchParams.get("camera").split(",").map(Number);
  assert.ok(Math.abs(azimuth - keyframes.view.azimuth) < 0.02 && Math.abs(elevation - keyframes.view.elevation) < 0.02, `${azimuth}, ${elevation}`);

  const said = (name) => page.locator(".facts").first().locator("> div", { has: page.getByText(name, { exact: true }) }).locator("dd").textContent();
  assert.match(await said("entry angle"), /^-?\d+(\.\d+)?°$/);
  assert.match(await said("entry speed"), / m\/s$/);
  assert.match(await said("entry offset"), /^-?\d+(\.\d+)? [mc]m$/);
  assert.match(await said("first contact"), /^\d\.\d+ s$/);
  assert.equal(await said("pins down"), "1, 2, 3, 4, 5, 6, 7, 8, 9, 10");
  assert.equal(await page.locator("#scenario .sentence").textContent(), "All 10 pins go down.");
  assert.deepEqual(faults, []);
  await close();
});

test("a crowd leaves one trail, tiles open a second before the hit, pins are smooth and face outwards", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?scenario=${scenario}&tab=chains`);
  const seen = await page.evaluate(async (document) => {
    const { Take } = await import("/app/take.js");
    const take = new Take(document);
    const pin = take.group.getObjectByName("pin_1").geometry;
    const [place, normal] = ["position", "normal"].map((name) => pin.getAttribute(name));
    let worst = Infinity;
    for (let at = 0; at < place.count; ++at) {
      const out = normal.getX(at) * place.getX(at) + normal.getZ(at) * place.getZ(at);
      const length = Math.hypot(normal.getX(at), normal.getY(at), normal.getZ(at));
      worst = Math.min(worst, out, Math.abs(length - 1) < 1e-3 ? Infinity : -1);
    }
    const [base, crown] = [0, place.count - 1].map((at) => [place.getY(at), normal.getY(at)]);
    const answer = { trails: take.trails.length, opening: take.opening, worst, base, crown, mirrors: take.reflections.length };
    take.dispose();
    return answer;
  }, keyframes);
  assert.equal(seen.trails, 1);
  assert.equal(seen.mirrors, 1);
  assert.ok(Math.abs(seen.opening - (sample.measures.first_contact - 1)) < 0.1, `opens at ${seen.opening}`);
  assert.ok(seen.worst > -1e-6, "no normal points inwards");
  assert.ok(seen.base[0] < 0 && Math.abs(seen.base[1] + 1) < 1e-6, "the base is flat");
  assert.ok(seen.crown[0] > 0 && Math.abs(seen.crown[1] - 1) < 1e-6, "the crown is round");
  assert.deepEqual(faults, []);
  await close();
});

test("an empty store gets examples of every world, in the order in which a person should meet them", async () => {
  const full = await startProgram({ world: null });
  const { page, faults, close } = await newPage(browser);
  const { worlds } = await api(full, "/v1/worlds");
  const titles = worlds.flatMap(({ examples }) => examples.map(({ title }) => title));
  assert.equal(titles[0], "A strike");
  assert.deepEqual((await api(full, "/v1/scenarios")).scenarios.map(({ title }) => title), titles);
  await page.goto(`${full.address}?tab=chains`);
  const entries = [...new Set(titles.map((title) => title.replace(/^(Figure 9): .*/, "$1")))];
  await page.waitForFunction((count) => document.querySelectorAll(".scenario-link").length === count, entries.length);
  assert.deepEqual(await page.locator(".scenario-title").allTextContents(), entries);
  assert.deepEqual(faults, []);
  await close();
  await full.end();
  await full.remove();
});
