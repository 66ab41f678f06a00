// The large view: it plays, pauses, scrubs, and comes back from its address as it was.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, arrived, drawnTiles, newPage, picture, query, shows, startBrowser, startProgram } from "./fixture.mjs";

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
  await page.goto(program.gallery);
  await drawnTiles(page);
  await page.locator(".tile-link").first().click();
  await page.locator(".player .picture.drawn").waitFor();
}

test("it plays, pauses, steps by frames, scrubs, and survives a reload", async () => {
  const { page, faults, close } = await newPage(browser);
  await openFirst(page);
  await passes(page, 0.2);
  await shows(page, ".picture", 60);

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

test("every shape of the contract is drawn, and one that is not in it is named", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.route("**/keyframes*", async (route) => route.fulfill({ json: everyShape() }));
  await openFirst(page);
  await passes(page, 0.2);
  await shows(page, ".picture", 150);
  await page.locator(".facts-panel .note", { hasText: "“torus” (ring)" }).waitFor();
  assert.equal(await page.locator(".facts-panel .note").count(), 1);
  await picture(page, "every-shape");
  assert.deepEqual(faults, []);
  await close();
});

test("measures that are no numbers are said in words", async () => {
  const { page, faults, close } = await newPage(browser);
  const measures = { strike: true, gutter: false, fallen: [2, 3, 10], left: [], miss: null };
  await page.route(/\/v1\/samples\/[^/?]+$/, async (route) => {
    const response = await route.fetch();
    await route.fulfill({ response, json: { ...(await response.json()), measures } });
  });
  await openFirst(page);
  await page.waitForFunction(() => document.querySelectorAll(".facts")[0].children.length === 5);
  const said = await page.locator(".facts").first().locator("> div > dd").allTextContents();
  assert.deepEqual(said, ["–", "yes", "no", "2, 3, 10", "none"], "what the scenario tells of comes first");
  assert.deepEqual(faults, []);
  await close();
});

test("the camera stands where the world says, and a viewpoint that is none is ignored", async () => {
  const sound = { center: [0.1, 0.4, 0], half_extents: [1.2, 0.5, 0], azimuth: 2.5, elevation: 0.75 };
  const directionWith = async (view) => {
    const { page, faults, close } = await newPage(browser);
    await page.route("**/keyframes*", async (route) => route.fulfill({ json: { ...everyShape(), view } }));
    await openFirst(page);
    const { x, y } = await page.locator(".picture").boundingBox();
    await page.mouse.move(x + 100, y + 100);
    await page.mouse.down();
    await page.mouse.move(x + 101, y + 100);
    await page.mouse.up();
    await page.waitForFunction(() => new URLSearchParams(location.search).has("camera"));
    const [azimuth, elevation] = query(page).camera.split(",").map(Number);
    assert.deepEqual(faults, []);
    await close();
    return [azimuth, elevation];
  };
  const [azimuth, elevation] = await directionWith(sound);
  assert.ok(Math.abs(azimuth - sound.azimuth) < 0.02 && elevation === sound.elevation, `${azimuth}, ${elevation}`);
  const own = await directionWith(undefined);
  for (const rubbish of [{ ...sound, center: "here" }, { ...sound, elevation: 2 }]) {
    assert.deepEqual(await directionWith(rubbish), own, JSON.stringify(rubbish));
  }
});

test("a body has no picture, shadow or mirror image before it is there", async () => {
  const whole = lateBall(0.5);
  const empty = { ...whole, bodies: whole.bodies.filter(({ track }) => track === undefined), tracks: [] };
  const seen = async (document, time) => {
    const { page, faults, close } = await newPage(browser);
    await page.route("**/keyframes*", async (route) => route.fulfill({ json: document }));
    const [{ id }] = (await api(program, "/v1/scenarios")).scenarios;
    const [sample] = (await api(program, `/v1/scenarios/${id}/samples?limit=1`)).samples;
    await page.goto(`${program.address}?scenario=${id}&sample=${sample.id}&t=${time}&path=off`);
    await page.locator(".player .picture.drawn").waitFor();
    await shows(page, ".picture", 20);
    const pixels = await page.locator(".picture").evaluate(async (element) => {
      await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
      const canvas = document.querySelector("canvas.stage");
      const origin = canvas.getBoundingClientRect();
      const { left, top, width, height } = element.getBoundingClientRect();
      const copy = new OffscreenCanvas(Math.round(width), Math.round(height));
      const context = copy.getContext("2d", { willReadFrequently: true });
      context.drawImage(canvas, origin.left - left, origin.top - top, origin.width, origin.height);
      const { data } = context.getImageData(0, 0, copy.width, copy.height);
      const digest = await crypto.subtle.digest("SHA-256", data);
      return [...new Uint8Array(digest)].join(" ");
    });
    await picture(page, `late-ball-${document.tracks.length}-${time}`);
    assert.deepEqual(faults, []);
    await close();
    return pixels;
  };
  const nobody = await seen(empty, 0.25);
  assert.equal(await seen(whole, 0.25), nobody, "before");
  assert.notEqual(await seen(whole, 0.5), nobody, "from then on");
  assert.notEqual(await seen(lateBall(), 0.25), nobody, "one that is there from the start");
});

test("bodies turn alike whichever of its two signs a rotation has", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.gallery);
  const given = everyShape();
  const turned = structuredClone(given);
  for (const { rotation } of turned.tracks)
    for (let at = 0; at < rotation.length; ++at) if (Math.floor(at / 4) % 3 === 1) rotation[at] *= -1;
  const apart = await page.evaluate(async ([one, other]) => {
    const { Take } = await import("/app/take.js");
    const [here, there] = [new Take(one), new Take(other)];
    let most = 0;
    for (let time = 0; time <= here.duration; time += 0.007) {
      here.pose(time);
      there.pose(time);
      here.movers.forEach(({ mesh }, at) => (most = Math.max(most, 1 - Math.abs(mesh.quaternion.dot(there.movers[at].mesh.quaternion)))));
    }
    return most;
  }, [given, turned]);
  assert.ok(apart < 1e-6, `turned by ${apart}`);
  assert.deepEqual(faults, []);
  await close();
});

/** A ball above a varnished lane. @param {number} [from] [s] when it appears */
function lateBall(from) {
  const frames = 31;
  const still = { position: [0, -0.05, 0], rotation: [0, 0, 0, 1] };
  const bodies = [
    { name: "ball", shape: { type: "sphere", radius: 0.15 }, color: "#b23a48", track: 0 },
    { name: "lane", shape: { type: "box", half_extents: [1, 0.05, 0.6] }, color: "#c69c6d", surface: "varnished", ...still },
  ];
  const over = (values) => Array.from({ length: frames }, () => values).flat();
  const track = { position: over([0, 0.3, 0]), rotation: over([0, 0, 0, 1]), ...(from === undefined ? {} : { from }) };
  const view = { center: [0, 0.2, 0], half_extents: [0.8, 0.4, 0.4], azimuth: 0.3, elevation: 0.5 };
  return { format: "retake.keyframes/1", sample: "x", world: "x", world_version: 1, rate: 30, frames, duration: 1, bodies, tracks: [track], events: [], view };
}

/** A document with each kind of shape in motion, and one shape that no contract knows. */
function everyShape() {
  const shapes = {
    ball: [{ type: "sphere", radius: 0.12 }, "#20304c"],
    pin: [{ type: "revolution", profile: [[0, -0.15], [0.03, -0.15], [0.06, -0.03], [0.022, 0.1], [0.032, 0.19], [0, 0.23]] }, "#f4f1ea"],
    crate: [{ type: "box", half_extents: [0.1, 0.1, 0.1] }, "#b23a48"],
    can: [{ type: "cylinder", radius: 0.08, height: 0.25 }, "#4c7d6f"],
    rock: [{ type: "mesh", positions: [0, 0.15, 0, 0.15, -0.1, 0.1, -0.15, -0.1, 0.1, 0, -0.1, -0.15], indices: [0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3] }, "#7a5ea8"],
    ring: [{ type: "torus", radius: 0.1 }, "#888888"],
  };
  const frames = 61;
  const bodies = [{ name: "floor", shape: { type: "box", half_extents: [2, 0.05, 1] }, color: "#c69c6d", position: [0, -0.05, 0], rotation: [0, 0, 0, 1] }];
  const tracks = [];
  for (const [at, [name, [shape, color]]] of Object.entries(shapes).entries()) {
    const track = { position: [], rotation: [] };
    for (let frame = 0; frame < frames; ++frame) {
      const turn = frame / 40;
      track.position.push(at * 0.4 - 1 + frame / 600, 0.2 + 0.5 * Math.abs(Math.cos(frame / 8 + at)), (at % 2) * 0.2);
      track.rotation.push(0, Math.sin(turn / 2), 0, Math.cos(turn / 2));
    }
    bodies.push({ name, shape, color, track: tracks.push(track) - 1 });
  }
  const events = [{ time: 0.5, kind: "contact", bodies: ["ball", "floor"], impulse: 2, position: [-1, 0, 0], normal: [0, 1, 0] }];
  return { format: "retake.keyframes/1", sample: "x", world: "x", world_version: 1, rate: 30, frames, duration: 2, bodies, tracks, events };
}

test("keys open and close it, the back button leaves it, neighbours are one key away", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(program.gallery);
  await drawnTiles(page);
  await page.locator(".tile-link").first().focus();
  const first = await page.locator(".tile").first().getAttribute("data-sample");
  await page.keyboard.press("Enter");
  await arrived(page, { sample: first });
  await page.locator(".player .picture.drawn").waitFor();
  await page.keyboard.press("k");
  await page.waitForFunction((was) => new URLSearchParams(location.search).get("sample") !== was, first);
  await page.keyboard.press("j");
  await arrived(page, { sample: first });
  await page.goBack();
  await arrived(page, { sample: null });
  await page.locator(".player").waitFor({ state: "hidden" });
  await shows(page, ".tile:nth-child(1) .shot", 40);
  await page.goForward();
  await page.locator(".player .picture.drawn").waitFor();
  await page.keyboard.press("Escape");
  await arrived(page, { sample: null });
  assert.deepEqual(faults, []);
  await close();
});
