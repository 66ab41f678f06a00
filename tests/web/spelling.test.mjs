// Spelling: marbles that spell HI, drawn as glass in a box, seen from above, told as a text.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, drawnTiles, json, newPage, picture, query, shows, startBrowser, startProgram } from "./fixture.mjs";

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
  assert.match(await said("settling time"), /^\d\.\d+ s$/);
  assert.equal(await said("bin of ball"), sample.measures.bin_of_ball.join(", "));
  assert.equal(await page.locator("#scenario .sentence").textContent(), "The marbles spell “HI”.");
  assert.deepEqual(faults, []);
  await close();
});

test("in the gallery a word's tile shows it, and a long word's tiles are wide", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?scenario=${scenario}&play=off`);
  await drawnTiles(page, 2);
  await shows(page, ".tile .shot", 500);
  // What all of them have in common is not said.
  assert.doesNotMatch(await page.locator(".tile").first().textContent(), /active|filled/);
  const aspect = () => page.locator(".tile .shot").first().evaluate((shot) => shot.clientWidth / shot.clientHeight);
  assert.ok(Math.abs((await aspect()) - 4 / 3) < 0.02);

  const long = { world: "spelling", constraints: [{ kind: "spell", text: "MARBLES" }] };
  const { id } = await api(program, "/v1/scenarios", json(long));
  await api(program, `/v1/scenarios/${id}/chains`, json({ stop: { samples: 2 } }));
  await page.goto(`${program.address}?scenario=${id}&play=off`);
  await drawnTiles(page, 2);
  await shows(page, ".tile .shot", 500);
  assert.ok(Math.abs((await aspect()) - 3) < 0.02);
  await picture(page, "spelling-wide");
  assert.deepEqual(faults, []);
  await close();
});

test("whoever types a word gets a box with room for it, and soon its animations", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?create=spelling`);
  const word = page.getByLabel("The balls spell a text");
  assert.equal(await word.inputValue(), "HI");
  await word.fill("Joy");
  await picture(page, "spelling-form");
  await word.press("Enter");
  await page.waitForFunction(() => document.querySelector("#scenario h1")?.textContent === "Marbles that spell JOY");
  await drawnTiles(page, 1);
  const { model, constraints } = await api(program, `/v1/scenarios/${query(page).scenario}`);
  assert.equal(constraints[0].text, "JOY");
  assert.ok(model.columns > 7 && model.rows === 7, "the box grew with the word");
  assert.deepEqual(faults, []);
  await close();
});

test("a word that no box has room for is refused with the size it needs", async () => {
  const { page, faults, close } = await newPage(browser, {}, /\b422\b/);
  await page.goto(`${program.address}?create=spelling`);
  const word = page.getByLabel("The balls spell a text");
  await word.fill("INCOMPREHENSIBLE");
  await word.press("Enter");
  const fault = page.locator(".faults li", { hasText: "/constraints/0/text" });
  await fault.waitFor();
  await fault.evaluate((line) => new Promise((seen) => new IntersectionObserver(([{ isIntersecting }]) => isIntersecting && seen()).observe(line)));
  assert.match(await fault.textContent(), /needs \d\d columns and 3 rows, the largest box has 40 columns and 12 rows/);
  await picture(page, "spelling-refused");
  // Where somebody says how large the box is, it stays so.
  const document = { world: "spelling", model: { columns: 7, rows: 5 }, constraints: [{ kind: "spell", text: "ACM" }] };
  await page.getByLabel("The scenario, as JSON").fill(JSON.stringify(document, null, 2));
  await page.getByRole("button", { name: "Create" }).click();
  await page.locator(".faults li", { hasText: "needs 13 columns and 3 rows, the box has 7 columns and 5 rows" }).waitFor();
  assert.equal(query(page).create, "spelling", "nothing was created");
  assert.deepEqual(faults, []);
  await close();
});

test("a guided chain says that it builds, burns in and samples, and that it does not know the odds of chance", async () => {
  const { page, faults, close } = await newPage(browser);
  const base = { ...(await api(program, `/v1/scenarios/${scenario}/chains`)).chains[0], state: "running" };
  assert.equal(base.guided, true);
  const phases = [
    { phase: "exploring", samples: 0, first_sample: null, says: "building the first one up" },
    { phase: "exploring", samples: 4, says: "burning in: 4 found, not counted" },
    { phase: "sampling", samples: 40, says: "sampling" },
  ];
  const chains = phases.map((phase, index) => ({ ...base, ...phase, id: `c${index}`, index }));
  await page.route(`**/v1/scenarios/${scenario}/chains?*`, (route) => route.fulfill({ json: { chains } }));
  await page.route("**/v1/chains/*/trace?*", (route) => route.fulfill({ json: { iteration: [], log_prior: [], log_constraint: [], satisfied: [] } }));
  await page.goto(`${program.address}?scenario=${scenario}&tab=chains`);
  for (const { says } of phases) await page.locator(".phase", { hasText: says }).waitFor();
  const odds = page.locator('[data-card="odds"]');
  await odds.getByText(/^Rarer than 1 in [\d,]+ pours$/).waitFor();
  await odds.getByText("The chains build up what is wished for, so they cannot tell how rare chance makes it.").waitFor();
  await page.locator('[data-card="independence"]').getByText("Chains are still burning in; what they find meanwhile is shown, but does not count.").waitFor();
  await picture(page, "spelling-chains");
  assert.deepEqual(faults, []);
  await close();
});

test("the trace of the paper's chain has its log p(A)", async () => {
  const { page, faults, close } = await newPage(browser);
  const { id } = await api(program, "/v1/scenarios", json({ world: "spelling", title: "Paper", constraints: [{ kind: "spell", text: "HI" }] }));
  const [{ id: chain }] = (await api(program, `/v1/scenarios/${id}/chains`, json({ method: "metropolis", ratios: "paper", stop: { iterations: 300 } }))).chains;
  await page.goto(`${program.address}?scenario=${id}&tab=chains`);
  await page.locator(".uplot canvas").waitFor();
  await page.getByLabel("Quantity").selectOption("log_target");
  await arrived(page, { quantity: "log_target" });
  await page.locator(".u-legend", { hasText: "log target" }).waitFor();
  const { ratios } = await api(program, `/v1/chains/${chain}`);
  assert.equal(ratios, "paper");
  assert.deepEqual(faults, []);
  await close();
});
