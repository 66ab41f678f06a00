// What a caption says of an animation, without a browser: what happens in it, and what differs from one to the next.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Captions } from "../../web/app/captions.js";
import { storyOf } from "../../web/app/story.js";

const FRAMES = 61;
const RATE = 30;
const UPRIGHT = [0, 0, 0, 1];
const LYING = [Math.SQRT1_2, 0, 0, Math.SQRT1_2];

/** A document of bodies that go from one place to another; `turns` says at which frame one lies down. */
function document(actors, events = []) {
  const tracks = actors.map(({ from = [0, 0, 0], to = from, at = 0, until = FRAMES - 1, lies = Infinity, first }) => {
    const track = { position: [], rotation: [], ...(first && { from: first / RATE }) };
    for (let frame = 0; frame < FRAMES; ++frame) {
      const share = Math.min(1, Math.max(0, (frame - at) / Math.max(1, until - at)));
      track.position.push(...from.map((value, axis) => value + share * (to[axis] - value)));
      track.rotation.push(...(frame >= lies ? LYING : UPRIGHT));
    }
    return track;
  });
  const bodies = actors.map(({ name, type = "revolution" }, track) => ({ name, shape: { type }, color: "#888888", track }));
  bodies.push({ name: "ground", shape: { type: "box" }, color: "#888888" });
  return { rate: RATE, frames: FRAMES, duration: (FRAMES - 1) / RATE, bodies, tracks, events };
}
const contact = (frame, one, other, impulse = 1) => ({ kind: "contact", time: frame / RATE, bodies: [one, other], impulse });
const said = (...given) => storyOf(document(...given)).map(({ words }) => words);

test("the last to fall is told with who hit it hardest before", () => {
  const thrown = { name: "stone", type: "sphere", to: [3, 0, 0] };
  const cups = [{ name: "cup_2", lies: 20 }, { name: "cup_7", lies: 31 }, { name: "cup_9" }];
  assert.deepEqual(said([thrown, ...cups], [contact(10, "stone", "cup_7", 0.2), contact(28, "cup_2", "cup_7", 3), contact(29, "cup_7", "ground", 9), contact(40, "stone", "cup_7", 50)]), ["cup 7 falls last, hit by 2"]);
  assert.deepEqual(said([thrown, ...cups], [contact(28, "stone", "cup_7")]), ["cup 7 falls last, hit by stone"]);
  assert.deepEqual(said([thrown, ...cups]), ["cup 7 falls last"]);
});

test("what drops off its place has fallen too, what rolls or is in motion from the start has not", () => {
  const dropped = { name: "cup_1", from: [0, 1, 0], to: [0, 0, 0], at: 20, until: 25 };
  assert.deepEqual(said([dropped, { name: "cup_2", lies: 12 }]), ["cup 1 falls last"]);
  const tossed = { name: "box_1", from: [0, 1, 0], to: [0, 0, 0], until: 30, lies: 15 };
  assert.deepEqual(said([tossed, { name: "box_2", from: [0, 1, 0], to: [1, 0, 0], until: 40, lies: 35 }]), ["box 2 rests last"]);
});

test("where nothing falls the last to come to rest is told with whom it touched last; two together are none", () => {
  const balls = [{ name: "ball_1", type: "sphere", to: [1, 0, 0], until: 30 }, { name: "ball_2", type: "sphere", to: [0, 0, 1], until: 50 }];
  assert.deepEqual(said(balls, [contact(5, "ball_2", "ball_1"), contact(49, "ground", "ball_2")]), ["ball 2 rests last, touched by 1"]);
  assert.deepEqual(said([balls[0], { ...balls[1], until: 30 }]), []);
});

test("one that is alone goes a way, and turns if one can see it", () => {
  assert.deepEqual(said([{ name: "ball", type: "sphere", to: [3, 0, 0] }]), ["goes 3 m"]);
  const spun = document([{ name: "box_1", to: [0.3, 0, 0] }]);
  for (let frame = 0; frame < FRAMES; ++frame) {
    const half = (Math.PI * 3 * frame) / (FRAMES - 1);
    spun.tracks[0].rotation.splice(4 * frame, 4, 0, Math.sin(half), 0, Math.cos(half));
  }
  assert.deepEqual(storyOf(spun).map(({ words }) => words), ["turns 3 times", "goes 30 cm"]);
  assert.deepEqual(said([{ name: "ball", type: "sphere", to: [6, 0, 0], first: 30 }]), ["goes 3 m"], "before it is there it goes nowhere");
});

test("what a body does is told alike whichever of its two signs a rotation has", () => {
  const actors = [{ name: "box_1", to: [0.3, 0, 0] }, { name: "cup_1", lies: 20 }, { name: "cup_2", lies: 31 }];
  const [as_given, turned] = [document(actors), document(actors)];
  const alone = document([actors[0]]);
  for (let frame = 0; frame < FRAMES; ++frame) {
    const half = (Math.PI * 3 * frame) / (FRAMES - 1);
    alone.tracks[0].rotation.splice(4 * frame, 4, 0, Math.sin(half), 0, Math.cos(half));
  }
  const either = structuredClone(alone);
  for (const { rotation } of [...turned.tracks, ...either.tracks])
    for (let frame = 0; frame < FRAMES; frame += 3) for (let k = 0; k < 4; ++k) rotation[4 * frame + k] *= -1;
  assert.deepEqual(storyOf(turned), storyOf(as_given));
  assert.deepEqual(storyOf(either), storyOf(alone));
});

/** A caption with the spaces that do not break a line as any others. */
const plain = ({ gist, more }) => ({ gist: gist.replaceAll("\u00a0", " "), more: more.replaceAll("\u00a0", " ") });
const meaning = (name, unit = "", kind = "number") => ({ name, kind, unit, summary: "" });
const samples = (...all) => all.map((measures, at) => ({ id: `s${at}`, duration: 2 + at, measures }));
/** The captions of samples that have these measures. */
function captions(meanings, ...measures) {
  const all = new Captions();
  all.mean(meanings);
  all.admit(samples(...measures));
  return all;
}

test("measures that all have in common are not said, of the others those that differ most", () => {
  const told = captions([meaning("hits"), meaning("entry_speed", "m/s"), meaning("entry_offset", "m"), meaning("ended", "", "flag"), meaning("angle", "rad")],
    { hits: 4, entry_speed: 7.9, entry_offset: -0.03, ended: true, angle: 0.1 },
    { hits: 4, entry_speed: 8.1, entry_offset: 0.02, ended: true, angle: 0.05 });
  assert.deepEqual(plain(told.of("s0")), { gist: "entry offset -3 cm · angle 5.7°", more: "" });
  assert.deepEqual(plain(told.of("s1")), { gist: "entry offset 2 cm · angle 2.9°", more: "" });
});

test("what differs by less than is read, a time that is the duration, and what is too long is not said", () => {
  const told = captions([meaning("weight", "kg"), meaning("end", "s"), meaning("places", "", "list"), meaning("sides", "", "list"), meaning("miss", "m"), meaning("miss_2", "m")],
    { weight: 1.00001, end: 2, places: [11, 12, 13, 14, 15, 16], sides: [1, -1], miss: 0.001, miss_2: 0.001 },
    { weight: 1.00002, end: 3, places: [16, 15, 14, 13, 12, 11], sides: [-1, -1], miss: 0.004, miss_2: 0.009 });
  assert.equal(plain(told.of("s1")).gist, "miss 4 mm");
});

test("how far a time is missed is said in the unit of times", () => {
  const told = captions([meaning("beat_miss", "s"), meaning("miss", "m")], { beat_miss: 0.0402, miss: 0.0402 }, { beat_miss: 0.0121, miss: 0.0121 });
  assert.equal(plain(told.of("s0")).gist, "beat miss 40 ms · miss 4 cm");
});

test("values are read to one place, which the largest decides, and stay on one line", () => {
  const told = captions([meaning("turn_angle", "rad"), meaning("off", "m"), meaning("hits")], { turn_angle: 0.0994, off: 0.0463, hits: 1234 }, { turn_angle: 0.0009, off: 0.0104, hits: 1234 }, { turn_angle: -0.05, off: 0.00442, hits: 1234 });
  assert.deepEqual(["s0", "s1", "s2"].map((id) => told.of(id).gist), ["turn\u00a0angle\u00a05.7° · off\u00a04.6\u00a0cm", "turn\u00a0angle\u00a00.1° · off\u00a01\u00a0cm", "turn\u00a0angle\u00a0-2.9° · off\u00a04.4\u00a0mm"]);
});

test("of what is so or not only that it is so is said; a set that is short is said", () => {
  const told = captions([meaning("met_another", "", "flag"), meaning("left", "", "set")], { met_another: true, left: [] }, { met_another: false, left: [7, 10] });
  assert.equal(plain(told.of("s0")).gist, "met another · left none");
  assert.equal(plain(told.of("s1")).gist, "left 7, 10");
});

test("one animation alone says its first measures", () => {
  assert.equal(captions([meaning("ok", "", "flag"), meaning("x", "m"), meaning("y", "m"), meaning("z", "m")], { ok: true, x: 1, y: 2, z: 3 }).of("s0").gist.replaceAll("\u00a0", " "), "x 1 m · y 2 m");
});

test("what happens comes first, as soon as it differs, and of one kind in all captions", () => {
  const told = captions([meaning("x", "m")], { x: 1 }, { x: 2 }, { x: 3 });
  const happens = (id, turn, way) => told.witness(id, [{ kind: "turn", words: turn }, { kind: "way", words: way }]);
  happens("s0", "turns twice", "goes 1 m");
  assert.deepEqual(plain(told.of("s0")), { gist: "x 1 m", more: "" });
  happens("s1", "turns twice", "goes 2 m");
  assert.deepEqual(plain(told.of("s0")), { gist: "goes 1 m", more: "x 1 m" });
  happens("s2", "turns once", "goes 2 m");
  assert.deepEqual([plain(told.of("s0")).gist, plain(told.of("s2")).gist], ["turns twice", "turns once"]);
});

test("what more frames tell takes the place of what fewer told, whichever comes first", () => {
  for (const order of [[30, 60], [60, 30]]) {
    const told = captions([meaning("x", "m")], { x: 1 }, { x: 2 });
    told.witness("s1", [{ kind: "turn", words: "turns once" }], 30);
    for (const rate of order) told.witness("s0", [{ kind: "turn", words: `turns 2.${rate / 10} times` }], rate);
    assert.equal(plain(told.of("s0")).gist, "turns 2.6 times");
  }
});

test("who listens is told once for many changes", async () => {
  const told = captions([meaning("x", "m")], { x: 1 });
  let calls = 0;
  const end = told.onChange(() => ++calls);
  told.admit(samples({ x: 1 }, { x: 2 }));
  told.witness("s0", []);
  await new Promise((resolve) => setTimeout(resolve, 150));
  assert.equal(calls, 1);
  end();
  told.witness("s1", []);
  await new Promise((resolve) => setTimeout(resolve, 150));
  assert.equal(calls, 1);
});
