// What happens in an animation, told from its keyframe document: who falls last and by whom it was hit, who comes to
// rest last, how far and how often something that is alone goes and turns. It knows no world: a body is what moves as
// its poses say, and is called what the document calls it.
import { number, quantity, spaced } from "./words.js";

const STILL = 0.002; // [m] from where it ends, within which a body rests
const STANDING = 0.001; // [m] in the first frame, for what stands when it begins
const UPRIGHT = 0.7; // cosine of the lean up to which a body stands: 45 degrees
const SUNK = 0.05; // [m] below its place at which a body has fallen off
const TURNED = 0.5; // turns, below which nobody sees them

/** @typedef {{kind: string, words: string}} Happening what may tell an animation from others, the plainest first */

/** @param {import("./types.js").Keyframes} keyframes @returns {Happening[]} */
export function storyOf(keyframes) {
  const actors = actorsOf(keyframes);
  const contacts = (keyframes.events ?? []).filter(({ kind }) => kind === "contact");
  if (actors.length === 1) return journey(actors[0]);
  const falls = actors.map((actor) => ({ actor, at: fallOf(actor) })).filter(({ at }) => at !== null);
  const last = falls.length > 1 ? lastOf(falls) : null;
  if (last) return [{ kind: "fall", words: `${spaced(last.actor.name)} falls last${by(", hit by", hardest(last, contacts, actors), last.actor)}` }];
  const rests = actors.map((actor) => ({ actor, at: restOf(actor) }));
  const latest = lastOf(rests);
  return latest ? [{ kind: "rest", words: `${spaced(latest.actor.name)} rests last${by(", touched by", latestTouch(latest, contacts, actors), latest.actor)}` }] : [];
}

/** Who moves: the first body on each track, with its poses. */
function actorsOf({ bodies, tracks, rate, frames }) {
  return tracks.map((track, index) => {
    const body = bodies.find((each) => each.track === index);
    return { name: body?.name ?? "", round: body?.shape?.type === "sphere", position: track.position, rotation: track.rotation, first: Math.ceil((track.from ?? 0) * rate - 1e-6), frames, rate };
  });
}

const placeAt = ({ position }, frame) => position.slice(3 * frame, 3 * frame + 3);
const apart = (one, other) => Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]);

/** The latest; null if two are latest together. */
function lastOf(happenings) {
  const [latest, second] = [...happenings].sort((one, other) => other.at - one.at);
  return latest && latest.at > (second?.at ?? -1) ? latest : null;
}

/** How far its upper side points up, from 1 to -1. */
function uprightness({ rotation }, frame) {
  const [x, , z] = rotation.slice(4 * frame, 4 * frame + 4);
  return 1 - 2 * (x * x + z * z);
}

/** The frame from which on a body that stood lies, or is below where it stood; null if it did not fall. */
function fallOf(actor) {
  const { round, first, frames } = actor;
  if (round || first > 0 || frames < 2 || apart(placeAt(actor, 0), placeAt(actor, 1)) > STANDING) return null;
  const stands = (frame) => uprightness(actor, frame) * Math.sign(uprightness(actor, 0)) > UPRIGHT && placeAt(actor, frame)[1] > placeAt(actor, 0)[1] - SUNK;
  if (!stands(0)) return null;
  let frame = frames - 1;
  while (frame >= 0 && !stands(frame)) --frame;
  return frame === frames - 1 ? null : frame + 1;
}

/** The frame from which on a body is where it ends. */
function restOf(actor) {
  const end = placeAt(actor, actor.frames - 1);
  let frame = actor.frames - 1;
  while (frame > 0 && apart(placeAt(actor, frame - 1), end) < STILL) --frame;
  return frame;
}

/** The contacts of an actor with others that move, up to a frame. */
function meetings({ actor, at }, contacts, actors) {
  const names = new Set(actors.map(({ name }) => name));
  const meets = ({ time, bodies }) => time <= (at + 1) / actor.rate && bodies.includes(actor.name) && bodies.every((name) => names.has(name));
  return contacts.filter(meets).map(({ bodies, ...contact }) => ({ ...contact, other: bodies.find((name) => name !== actor.name) }));
}

const hardest = (last, contacts, actors) => meetings(last, contacts, actors).sort((one, other) => other.impulse - one.impulse)[0]?.other;
const latestTouch = (last, contacts, actors) => meetings(last, contacts, actors).sort((one, other) => other.time - one.time)[0]?.other;

/** "hit by 4": a word that both have is not said again. */
function by(words, other, { name }) {
  if (!other) return "";
  const [mine, its] = [name, other].map((each) => each.match(/^(.+)_(\d+)$/));
  return `${words} ${mine && its && mine[1] === its[1] ? its[2] : spaced(other)}`;
}

/** What one that is alone does: how often it turns, how far it goes. @returns {Happening[]} */
function journey(actor) {
  let [way, turn] = [0, 0];
  for (let frame = actor.first + 1; frame < actor.frames; ++frame) {
    way += apart(placeAt(actor, frame - 1), placeAt(actor, frame));
    const [x, y, z, w] = actor.rotation.slice(4 * frame - 4, 4 * frame);
    const [a, b, c, d] = actor.rotation.slice(4 * frame, 4 * frame + 4);
    turn += 2 * Math.acos(Math.min(1, Math.abs(x * a + y * b + z * c + w * d)));
  }
  const turns = turn / (2 * Math.PI);
  const turning = !actor.round && turns > TURNED ? [{ kind: "turn", words: `turns ${number(turns, turns < 10 ? 2 : 3)} times` }] : [];
  return [...turning, { kind: "way", words: `goes ${quantity(way, "m", 2)}` }];
}
