// Fetches keyframe documents and keeps the takes made of them, the latest used first to stay.
import { pathOf, request } from "./api.js";
import { stage } from "./stage.js";
import { Take } from "./take.js";
import { onTheme } from "./theme.js";

const MOST_KEPT = 160;
const AT_ONCE = 4;

/** @type {Map<string, Promise<Take>>} key to take, least recently used first */
const kept = new Map();
const waiting = [];
let busy = 0;

/** Frames a second of the takes in the grid: half of the full motion, which is plenty between keyframes. */
export const TILE_RATE = 30;

/** Where a sample's keyframes are served. @param {string} id @param {number} [rate] */
export const keyframesPath = (id, rate) => pathOf("samples", id, `/keyframes${rate ? `?rate=${rate}` : ""}`);

/**
 * The take of a sample. Waiting requests are served last come, first served: what came into view last matters most.
 * @param {string} id @param {number} [rate] @returns {Promise<Take>}
 */
export function takeOf(id, rate) {
  const key = keyframesPath(id, rate);
  let take = kept.get(key);
  if (take) {
    kept.delete(key);
  } else {
    take = inTurn(() => request(key)).then((keyframes) => new Take(keyframes, { trailWidth: rate ? 1.25 : 0.75 }));
    take.catch(() => kept.delete(key));
  }
  kept.set(key, take);
  for (const [oldest, old] of kept) {
    if (kept.size <= MOST_KEPT) break;
    kept.delete(oldest);
    old.then((gone) => gone.dispose(), () => {});
  }
  return take;
}

function inTurn(ask) {
  return new Promise((resolve, reject) => {
    waiting.push(() => ask().then(resolve, reject));
    serve();
  });
}

async function serve() {
  if (busy >= AT_ONCE || !waiting.length) return;
  ++busy;
  await waiting.pop()();
  --busy;
  serve();
}

onTheme(() => {
  for (const take of kept.values()) take.then((ready) => ready.wearTheme(), () => {});
  stage.redraw();
});
