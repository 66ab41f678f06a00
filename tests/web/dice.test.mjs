// Dice: what a die and its table are drawn of, colours on demand, the mark of a place, and several scenarios together.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, drawnTiles, json, newPage, picture, query, shows, startBrowser, startProgram } from "./fixture.mjs";

let program, browser, examples, series;
before(async () => {
  [program, browser] = await Promise.all([startProgram({ world: "dice", samples: 3, seed: 2 }), startBrowser()]);
  const { worlds } = await api(program, "/v1/worlds");
  examples = worlds.find(({ name }) => name === "dice").examples;
  series = [];
  for (const example of examples.filter(({ title }) => title.startsWith("Figure 9"))) {
    const { id } = await api(program, "/v1/scenarios", json(example));
    await api(program, `/v1/scenarios/${id}/chains`, json({ count: 1, seed: 5, stop: { samples: 3 } }));
    series.push(id);
  }
  // What tiles say depends on which animations are known.
  while ((await api(program, "/v1/scenarios?limit=100")).scenarios.some(({ chains }) => chains.running)) await new Promise((resolve) => setTimeout(resolve, 100));
});
after(async () => {
  await browser?.close();
  await program?.end();
  await program?.remove();
});

/** The die that is thrown to a place with a millimetre to spare, and its document. */
async function throwOfASix() {
  const { scenarios } = await api(program, "/v1/scenarios?limit=100");
  const scenario = scenarios.find(({ title }) => title === examples[0].title).id;
  let sample;
  while (!sample) [sample] = (await api(program, `/v1/scenarios/${scenario}/samples?limit=1`)).samples;
  return { scenario, sample, keyframes: await api(program, `/v1/samples/${sample.id}/keyframes`) };
}

/** The picture, bit by bit. @param {import("playwright-core").Page} page */
const pixels = (page) => page.locator(".picture").evaluate((element) => {
  const canvas = document.querySelector("canvas.stage");
  const origin = canvas.getBoundingClientRect();
  const { left, top, width, height } = element.getBoundingClientRect();
  const copy = new OffscreenCanvas(width, height);
  const context = copy.getContext("2d");
  context.drawImage(canvas, left - origin.left, top - origin.top, width, height, 0, 0, width, height);
  const { data } = context.getImageData(0, 0, width, height);
  let sum = 0;
  for (let at = 0; at < data.length; ++at) sum = (31 * sum + data[at]) | 0;
  return sum;
});

test("a document has the die, the table with what it is like, the pips, and the mark of the place", async () => {
  const { sample, keyframes } = await throwOfASix();
  const [die, table, pips] = keyframes.bodies;
  const target = keyframes.bodies.at(-1);
  const tray = ["felt", "rim_far", "rim_near", "rim_left", "rim_right", "desk"];
  assert.deepEqual(keyframes.bodies.map(({ name }) => name), ["die_1", "table", "pips_1", ...tray, "target"]);
  assert.equal(die.track, pips.track);
  assert.deepEqual(Object.keys(table.shape.attributes).sort(), ["friction", "restitution"]);
  const points = table.shape.positions.length / 3;
  for (const values of Object.values(table.shape.attributes)) {
    assert.equal(values.length, points);
    assert.ok(values.every((value) => value >= 0 && value <= 1 && Math.abs(100 * value - Math.round(100 * value)) < 1e-6));
    assert.ok(new Set(values).size > 10, "it differs from place to place");
  }
  // The mark is where the document asks for it, the die within the tolerance of it.
  const wish = examples[0].constraints.find(({ kind }) => kind === "rest_position");
  assert.deepEqual([target.position[0], target.position[2]], [wish.x, wish.z]);
  assert.equal(target.color, die.color);
  const { rest_x: x, rest_z: z } = sample.measures;
  assert.ok(Math.hypot(x - wish.x, z - wish.z) <= wish.tolerance);
});

test("a tile says how the die turns and how far it is off, and nothing that the wish says", async () => {
  const { scenario, sample } = await throwOfASix();
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?scenario=${scenario}&play=off`);
  await drawnTiles(page, 3);
  const words = page.locator(".tile").first();
  await words.getByText(/^turns \d+(\.\d)? times$/).waitFor();
  // What a measure means comes a little later than its number.
  await page.waitForFunction(() => /miss\s0\.\d+\smm/.test(document.querySelector(".tile .tile-more").textContent));
  assert.doesNotMatch(await words.textContent(), /face/);
  assert.ok(sample.measures.miss < 0.001);
  assert.deepEqual(faults, []);
  await close();
});

test("the die is smooth, its table is lit ground, and the mark lies on its bumps", async () => {
  const { keyframes } = await throwOfASix();
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?tab=chains`);
  const seen = await page.evaluate(async (document) => {
    const { Take } = await import("/app/take.js");
    const THREE = await import("/vendor/three.module.js");
    const take = new Take(document);
    take.group.updateMatrixWorld(true);
    const named = (name) => take.group.getObjectByName(name);
    const ground = take.ground.mesh;
    // Rays from above onto the table at the points of the mark.
    const target = named("target");
    const places = target.geometry.getAttribute("position");
    const above = [];
    for (let at = 0; at < places.count; at += 7) {
      const point = new THREE.Vector3().fromBufferAttribute(places, at).applyMatrix4(target.matrixWorld);
      const [hit] = new THREE.Raycaster(point.clone().setY(1), new THREE.Vector3(0, -1, 0)).intersectObject(ground);
      above.push(hit ? point.y - hit.point.y : NaN);
    }
    const smooth = ["die_1", "pips_1", "table"].map((name) => named(name).geometry.index !== null);
    const color = () => [...ground.geometry.getAttribute("color").array];
    const plain = color();
    take.pose(0, { color: "friction" });
    const friction = color();
    take.pose(0, { color: "no such thing" });
    const again = color();
    const answer = { above, smooth, plain: new Set(plain).size, friction: new Set(friction).size, again: String(again) === String(plain), legend: take.ground.legend("friction") };
    take.dispose();
    return answer;
  }, keyframes);
  assert.deepEqual(seen.smooth, [true, true, true]);
  for (const height of seen.above) assert.ok(height > 0 && height < 0.0003, `${height} m above the table`);
  assert.ok(seen.plain <= 3, "one colour");
  assert.ok(seen.friction > 60, `${seen.friction} parts of colours`);
  assert.ok(seen.again, "a name that there is not means plain");
  const values = keyframes.bodies[1].shape.attributes.friction;
  assert.ok(seen.legend.low <= Math.min(...values) && seen.legend.high >= Math.max(...values));
  assert.deepEqual(faults, []);
  await close();
});

test("the ground is coloured on demand, with a legend, and the address says by what", async () => {
  const { scenario, sample } = await throwOfASix();
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?scenario=${scenario}&sample=${sample.id}&t=0.1`);
  await page.locator(".player .picture.drawn").waitFor();
  await shows(page, ".picture", 1000);
  await picture(page, "dice-light");
  assert.equal(await page.locator(".facts-panel .note").count(), 0, "every body is drawn as itself");
  assert.ok(await page.locator(".scale").isHidden());
  const plain = await pixels(page);
  const differs = (from) => page.waitForFunction(() => document.querySelector(".scale").checkVisibility()).then(async () => {
    for (let round = 0; round < 100; ++round) {
      const now = await pixels(page);
      if (now !== from) return now;
      await page.waitForTimeout(50);
    }
    return assert.fail("the picture is as it was");
  });
  await page.getByLabel("Colour of the ground").selectOption("friction");
  await arrived(page, { color: "friction" });
  const friction = await differs(plain);
  assert.match(await page.locator(".scale").textContent(), /^Friction0(\.\d+)?0\.\d+(0\.\d+|1)$/);
  await picture(page, "dice-friction");
  await page.locator(".picture").press("c");
  await arrived(page, { color: "restitution" });
  assert.notEqual(await differs(friction), plain);
  await page.reload();
  await page.locator(".player .picture.drawn").waitFor();
  await page.locator(".scale", { hasText: "Restitution" }).waitFor();
  assert.equal(await page.getByLabel("Colour of the ground").inputValue(), "restitution");
  await page.locator(".picture").press("c");
  await arrived(page, { color: null });
  assert.ok(await page.locator(".scale").isHidden());
  assert.deepEqual(faults, []);
  await close();
});

/** Waits until this many pictures are drawn together. */
const drawn = (page, count) => page.waitForFunction((wanted) => document.querySelectorAll(".together .shot.drawn").length === wanted, count);
const times = (page) => page.evaluate(() => [...document.querySelectorAll(".together .tile")].map(({ tile }) => tile.view.time));

test("one click shows figure 9: six scenarios, a fresh animation of each, played together", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?play=on`);
  await page.locator("#scenario-list > li", { hasText: "Figure 9" }).first().waitFor();
  assert.equal(await page.locator("#scenario-list > li", { hasText: "Figure 9" }).count(), 1, "a series is one entry");
  await page.getByRole("link", { name: /^Figure 9/ }).click();
  await arrived(page, { together: series.join(",") });
  await drawn(page, 6);
  assert.equal(await page.locator(".together h1").textContent(), "Figure 9");
  // Open, it shows its scenarios below it.
  assert.deepEqual(await page.locator("#scenario-list .member .scenario-title").allTextContents(), series.map((_, at) => `Figure 9: die ${6 - at}`));
  assert.equal(await page.locator('#scenario-list [aria-current="page"]').count(), 1);
  assert.deepEqual(await page.locator(".together .tile-gist").allTextContents(), series.map((_, at) => `Figure 9: die ${at + 1}`));
  for (let at = 1; at <= 6; ++at) await shows(page, `.together .tile:nth-child(${at}) .shot`, 100);
  await page.waitForFunction(() => {
    const seen = [...document.querySelectorAll(".together .tile")].map(({ tile }) => tile.view.time);
    window.first ??= seen;
    return seen.every((time, at) => time !== window.first[at]);
  });
  // One clock: what has not ended is at the same time.
  const now = await page.evaluate(() => [...document.querySelectorAll(".together .tile")].map(({ tile }) => [tile.view.time, tile.view.take.duration]));
  const underway = now.filter(([time, duration]) => time < duration).map(([time]) => time);
  assert.ok(underway.every((time) => time === underway[0]), String(underway));
  await picture(page, "dice-together");

  // The address says which ones; others come on demand.
  const { takes } = query(page);
  assert.equal(takes.split(",").length, 6);
  await page.reload();
  await drawn(page, 6);
  assert.equal(query(page).takes, takes);
  await page.getByRole("button", { name: "Fresh ones" }).click();
  await page.waitForFunction((before) => {
    const after = new URLSearchParams(location.search).get("takes")?.split(",") ?? [];
    return after.length === 6 && after.every((take, at) => take && take !== before[at]);
  }, takes.split(","));
  await drawn(page, 6);

  // A tile opens in the large view, and leaving it comes back.
  await page.locator(".together .tile-link").nth(2).click();
  await page.locator(".player .picture.drawn").waitFor();
  assert.equal(query(page).sample, query(page).takes.split(",")[2]);
  await page.keyboard.press("Escape");
  await page.locator(".player").waitFor({ state: "hidden" });
  const before = await times(page);
  await page.waitForFunction((was) => document.querySelector(".together .tile").tile.view.time !== was, before[0]);
  assert.deepEqual(faults, []);
  await close();
});

test("of a series one is opened alone, and it is marked below the series", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?together=${series.join(",")}`);
  await page.getByRole("link", { name: /^Figure 9: die 3/ }).click();
  await arrived(page, { together: null, scenario: series[2] });
  assert.equal(await page.locator("#scenario h1").textContent(), "Figure 9: die 3");
  assert.match(await page.locator('#scenario-list .member [aria-current="page"]').textContent(), /^Figure 9: die 3/);
  await page.locator(".brand").click();
  await page.locator(".first").waitFor();
  assert.equal(await page.locator("#scenario-list .member").count(), 0, "folded again");
  assert.deepEqual(faults, []);
  await close();
});

test("scenarios are chosen in the list, and one without an animation waits for its first", async () => {
  const { page, faults, close } = await newPage(browser);
  const { id: empty } = await api(program, "/v1/scenarios", json({ world: "ball2d", title: "Nothing yet", constraints: [] }));
  const asked = [];
  page.on("request", (request) => request.method() === "POST" && asked.push(request.url()));
  await page.goto(`${program.address}?play=off`);
  assert.equal(await page.locator(".pick:visible").count(), 0);
  await page.getByRole("button", { name: "Choose scenarios to show together" }).click();
  await page.getByLabel("Show “Figure 9: die 2” together with others").check();
  await drawn(page, 1);
  await page.getByLabel("Show “Nothing yet” together with others").check();
  await arrived(page, { together: `${series[1]},${empty}` });
  await page.locator(".together .shot-note", { hasText: "Nothing found yet" }).waitFor();
  assert.equal(await page.locator(".together h1").textContent(), "Two scenarios together");
  assert.ok(!asked.some((url) => url.includes(empty)), "what has nothing is not asked");
  await api(program, `/v1/scenarios/${empty}/chains`, json({ count: 1, stop: { samples: 2 } }));
  await drawn(page, 2);
  assert.equal(asked.length, 2, "one play of each");
  await page.getByLabel("Show “Figure 9: die 2” together with others").uncheck();
  await drawn(page, 1);
  assert.equal(query(page).together, empty);
  await page.locator(".scenario-link", { hasText: "Figure 9: die 3" }).click();
  await arrived(page, { together: null, takes: null, scenario: series[2] });
  assert.equal(await page.locator("#scenario h1").textContent(), "Figure 9: die 3");
  assert.deepEqual(faults, []);
  await close();
});

test("a colour of the ground that there is not is said, and left out", async () => {
  const { scenario, sample } = await throwOfASix();
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?scenario=${scenario}&sample=${sample.id}&color=nope`);
  await page.locator(".notice", { hasText: "color = “nope”" }).waitFor();
  await arrived(page, { color: null, sample: sample.id });
  await page.locator(".player .picture.drawn").waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("where a sample is another scenario's there is a fresh one, and the page says so", async () => {
  const { page, faults, close } = await newPage(browser);
  const [alien] = (await api(program, `/v1/scenarios/${series[1]}/samples?limit=1`)).samples;
  await page.goto(`${program.address}?together=${series[0]}&takes=${alien.id}`);
  await page.locator(".notice", { hasText: "of another scenario" }).waitFor();
  await drawn(page, 1);
  const shown = await api(program, `/v1/samples/${query(page).takes}`);
  assert.equal(shown.scenario, series[0]);
  assert.deepEqual(faults, []);
  await close();
});

test("where a sample is gone there is a fresh one, and where a scenario is gone the page says so", async () => {
  const { page, faults, close } = await newPage(browser, {}, /404/);
  await page.goto(`${program.address}?together=${series[0]},gone&takes=gone,`);
  await drawn(page, 1);
  await page.locator(".together .shot-note", { hasText: "Not here any more" }).waitFor();
  const [take, none] = query(page).takes.split(",");
  assert.ok(take !== "gone" && none === "", query(page).takes);
  assert.deepEqual(faults, []);
  await close();
});
