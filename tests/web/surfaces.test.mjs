// Surfaces: how a body looks is what its document tells, and never what the body or its world is called.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { api, json, newPage, startBrowser, startProgram } from "./fixture.mjs";

const ALL = ["plain", "wood", "boards", "varnished", "felt", "cloth", "plastic", "polished", "glass", "metal", "rubber", "stone", "plaster", "marking", "lamp", "shade"];

let program, browser, documents;
before(async () => {
  [program, browser] = await Promise.all([startProgram({ world: "ball2d", samples: 2 }), startBrowser()]);
  const { worlds } = await api(program, "/v1/worlds");
  documents = {};
  for (const { name, examples } of worlds) {
    const { id } = await api(program, "/v1/scenarios", json(examples[0]));
    await api(program, `/v1/scenarios/${id}/chains`, json({ count: 1, seed: 5, stop: { samples: 1 } }));
    let sample;
    while (!sample) {
      [sample] = (await api(program, `/v1/scenarios/${id}/samples?limit=1`)).samples;
      if (!sample) await new Promise((resolve) => setTimeout(resolve, 100));
    }
    documents[name] = await api(program, `/v1/samples/${sample.id}/keyframes`);
  }
});
after(async () => {
  await browser?.close();
  await program?.end();
  await program?.remove();
});

/** Everything about a document's picture that can be told without drawing it. Names are left out. */
const looks = (page, document) => page.evaluate(async (given) => {
  const { Take } = await import("/app/take.js");
  const take = new Take(given);
  const seen = [];
  take.group.traverse((node) => {
    if (!node.isMesh) return;
    const { material, geometry } = node;
    seen.push([geometry.getAttribute("position").count, material.type, material.color?.getHexString(), material.map?.uuid, material.roughness, material.reflectivity, material.transparent,
      material.polygonOffset, node.castShadow, node.receiveShadow, node.renderOrder].map(String).join(" "));
  });
  const answer = { seen, mirrors: take.reflections.length, ground: Boolean(take.ground), box: JSON.stringify(take.framing), notes: take.notes };
  take.dispose();
  return answer;
}, document);

test("every body of every world tells its surface, and the page knows each", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?tab=chains`);
  for (const [world, { bodies }] of Object.entries(documents)) {
    for (const { name, surface } of bodies) assert.ok(ALL.includes(surface) && surface !== "plain", `${name} of ${world} is ${surface}`);
  }
  const read = await page.evaluate(async (all) => {
    const { surfaceName, surfaceOf } = await import("/app/surfaces.js");
    const box = { type: "box", half_extents: [1, 1, 1] };
    return all.map((surface) => [surfaceName({ surface, shape: box }), surfaceOf({ surface, shape: box, color: "#345678" }).isMaterial]);
  }, ALL);
  assert.deepEqual(read, ALL.map((surface) => [surface, true]));
  assert.deepEqual(faults, []);
  await close();
});

test("what bodies and worlds are called changes nothing", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?tab=chains`);
  for (const [world, document] of Object.entries(documents)) {
    const told = await looks(page, document);
    assert.deepEqual(told.notes, []);
    const names = new Map(document.bodies.map(({ name }, at) => [name, `thing ${at}`]));
    const renamed = {
      ...document,
      world: "another",
      bodies: document.bodies.map((body) => ({ ...body, name: names.get(body.name) })),
      events: document.events.map((event) => ({ ...event, bodies: event.bodies.map((name) => names.get(name)) })),
    };
    assert.deepEqual(await looks(page, renamed), told, world);
  }
  assert.deepEqual(faults, []);
  await close();
});

test("a document that tells no surface, or one from another time, is drawn by its shapes", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?tab=chains`);
  for (const surface of [undefined, "velvet", "constructor"]) {
    const bodies = documents.bowling.bodies.map((body) => ({ ...body, surface }));
    const seen = await looks(page, { ...documents.bowling, bodies });
    assert.deepEqual(seen.notes, []);
    assert.equal(seen.mirrors, 0);
    assert.ok(seen.seen.length > bodies.length - 1);
    assert.ok(seen.seen.some((text) => text.includes("MeshPhongMaterial")), "pins shine");
    assert.ok(seen.seen.some((text) => text.includes("MeshStandardMaterial")), "boxes do not");
  }
  assert.deepEqual(faults, []);
  await close();
});

test("what lies on another body has no shadow, shade is seen through, a lamp needs no light, and a varnished floor mirrors", async () => {
  const { page, faults, close } = await newPage(browser);
  await page.goto(`${program.address}?tab=chains`);
  const seen = await page.evaluate(async (document) => {
    const { Take } = await import("/app/take.js");
    const take = new Take(document);
    const by = (surface) => [...take.still, ...take.movers].filter(({ body }) => body.surface === surface).map(({ mesh }) => mesh);
    const answer = {
      marks: by("marking").map(({ castShadow, material }) => [castShadow, material.polygonOffset]),
      shade: by("shade").map(({ castShadow, material, geometry }) => [castShadow, material.transparent, material.depthWrite, geometry.getAttribute("position").count > 24]),
      lamp: by("lamp").map(({ castShadow, material }) => [castShadow, material.type]),
      mirrors: take.reflections.length,
    };
    take.dispose();
    return answer;
  }, documents.bowling);
  assert.ok(seen.marks.length >= 2);
  for (const mark of seen.marks) assert.deepEqual(mark, [false, true]);
  assert.deepEqual(seen.shade, [[false, true, false, true]]);
  assert.deepEqual(seen.lamp, [[false, "MeshBasicMaterial"]]);
  assert.equal(seen.mirrors, 1);
  assert.deepEqual(faults, []);
  await close();
});
