// What the server holds, kept up to date by its events: scenarios, worlds, and the chains of the open scenario.
import { pathOf, post, request } from "./api.js";
import { complain } from "./notice.js";
import { on } from "./live.js";
import { onPlace, place } from "./url_state.js";

/** @type {Map<string, import("./types.js").Scenario>} the newest first, as the server lists them */
const scenarios = new Map();
/** Those that the server does not have. @type {Set<string>} */
const missing = new Set();
/** @type {Map<string, import("./types.js").Chain>} of the scenario `chainsOf` */
const chains = new Map();
let chainsOf = "";
/** Whether they are all there; an event may tell of one before that. */
let chainsReady = false;
let cursor = null;
/** What events told while a list is on its way, and is newer than that list. @type {Set<(() => void)[]>} */
const whileLoading = new Set();
/** Whether the list came; `ready` when all that it needs is there too. */
let listed = false;
let ready = false;
let worlds = null;
/** @type {Map<string, import("./types.js").World>} by name, once the scenarios are there */
const knownWorlds = new Map();
/** @type {Map<string, Promise<import("./types.js").Meaning>>} by scenario */
const meanings = new Map();
const listeners = new Set();

export const allScenarios = () => [...scenarios.values()];
export const hasMoreScenarios = () => Boolean(cursor);
export const isReady = () => ready;

/** The scenario that the address names. @returns {import("./types.js").Scenario|undefined} */
export const openScenario = () => scenarios.get(place().scenario);

/** Whether the server was asked for a scenario and does not have it. @param {string} id */
export const isMissing = (id) => missing.has(id);

/** The chains of the open scenario by their index. */
export const openChains = () => (chainsReady && chainsOf === openScenario()?.id ? [...chains.values()].sort((a, b) => a.index - b.index) : []);

/** Calls `listener` after anything here changed, at most once a frame. @param {() => void} listener */
export function onCatalog(listener) {
  listeners.add(listener);
}

let told = 0;
function tell() {
  // A timer, not a frame: a hidden page keeps its lists right too.
  told ||= setTimeout(() => {
    told = 0;
    for (const listener of listeners) listener();
  }, 30);
}

/** @returns {Promise<import("./types.js").World[]>} */
export async function allWorlds() {
  worlds ??= request("/v1/worlds").then((body) => body.worlds);
  try {
    return await worlds;
  } catch (error) {
    worlds = null;
    throw error;
  }
}

/** @param {string} name @returns {import("./types.js").World|undefined} */
export const worldOf = (name) => knownWorlds.get(name);

/** What a scenario's measures and variables mean. It never changes, so that it is asked for once.
 * @param {string} scenario id @returns {Promise<import("./types.js").Meaning>} */
export async function meaningOf(scenario) {
  if (!meanings.has(scenario)) meanings.set(scenario, request(pathOf("scenarios", scenario)));
  try {
    const { measures = [], variable_units = {} } = await meanings.get(scenario);
    return { measures, variable_units };
  } catch (error) {
    meanings.delete(scenario);
    throw error;
  }
}

export async function loadScenarios({ more = false } = {}) {
  const heard = [];
  whileLoading.add(heard);
  try {
    const body = await request(`/v1/scenarios?limit=100${more && cursor ? `&cursor=${encodeURIComponent(cursor)}` : ""}`);
    if (!more) scenarios.clear();
    for (const scenario of body.scenarios) scenarios.set(scenario.id, scenario);
    cursor = body.next_cursor ?? null;
    listed = true;
    sort();
  } finally {
    whileLoading.delete(heard);
  }
  for (const again of heard) again();
  const [all] = await Promise.all([allWorlds(), loadNamed()]);
  for (const world of all) knownWorlds.set(world.name, world);
  ready = true;
  tell();
}

/** The address may name scenarios further down the list than what is loaded. */
async function loadNamed() {
  const named = [place().scenario, ...place().together.split(",")].filter((id) => id && !scenarios.has(id));
  await Promise.all(named.map(async (id) => {
    const scenario = await request(pathOf("scenarios", id)).catch((error) => (error.status === 404 ? null : Promise.reject(error)));
    if (scenario) scenarios.set(id, scenario);
    else missing.add(id);
  }));
  if (named.length) sort();
}

/** The newest first; those of one moment stay as they came. */
function sort() {
  const sorted = [...scenarios].sort(([, one], [, other]) => Date.parse(other.created_at) - Date.parse(one.created_at));
  scenarios.clear();
  for (const [id, scenario] of sorted) scenarios.set(id, scenario);
}

/** Asks for the chains of the open scenario, once for each scenario unless `again`. */
export async function loadChains({ again = false } = {}) {
  const scenario = openScenario();
  if (!scenario || (chainsOf === scenario.id && !again)) return;
  if (chainsOf !== scenario.id) {
    chains.clear();
    chainsReady = false;
  }
  chainsOf = scenario.id;
  const pages = [];
  for (let next = ""; next !== null; next = pages.at(-1).next_cursor ?? null) {
    pages.push(await request(pathOf("scenarios", scenario.id, `/chains?limit=500${next && `&cursor=${encodeURIComponent(next)}`}`)));
    if (chainsOf !== scenario.id) return;
  }
  for (const chain of pages.flatMap((page) => page.chains)) chains.set(chain.id, chain);
  chainsReady = true;
  tell();
}

/** @param {string} text the document as it was typed @returns {Promise<import("./types.js").Scenario>} */
export async function createScenario(text) {
  const scenario = await post("/v1/scenarios", text);
  keep(scenario);
  tell();
  return scenario;
}

export async function deleteScenario(id) {
  await request(pathOf("scenarios", id), { method: "DELETE" });
  scenarios.delete(id);
  tell();
}

/** @param {string} scenario @param {object} wanted see the contract: count, seed, method, stop */
export async function startChains(scenario, wanted) {
  const body = await post(pathOf("scenarios", scenario, "/chains"), wanted);
  for (const chain of body.chains) note(chain);
  return body.chains;
}

/** @param {string} id @param {"pause"|"resume"|"stop"} what */
export async function tellChain(id, what) {
  const chain = await post(pathOf("chains", id, `/${what}`));
  if (chain?.id) note(chain);
  else note(await request(pathOf("chains", id)));
}

function note(chain) {
  if (chain.scenario !== chainsOf) return;
  chains.set(chain.id, chain);
  tell();
}

on("chain", note);
/** Keeps a scenario in its place; a new one comes first, as the server lists them. */
function keep(scenario) {
  const isNew = !scenarios.has(scenario.id);
  const others = isNew ? [...scenarios] : [];
  if (isNew) scenarios.clear();
  scenarios.set(scenario.id, scenario);
  for (const [id, other] of others) scenarios.set(id, other);
  missing.delete(scenario.id);
  if (isNew) sort();
}

/** Whether it would stand below what is loaded of the list. */
function isFurtherDown(scenario) {
  const last = [...scenarios.values()].at(-1);
  return Boolean(cursor && last) && !scenarios.has(scenario.id) && Date.parse(scenario.created_at) < Date.parse(last.created_at);
}

/** What an event changes in the list. @param {(data: any) => void} change */
const hear = (kind, change) => on(kind, (data) => {
  change(data);
  for (const heard of whileLoading) heard.push(() => change(data));
  tell();
});
hear("scenario", (scenario) => {
  // Until the list is there, an event would look like the whole of it.
  if (listed && !isFurtherDown(scenario)) keep(scenario);
});
hear("scenario-deleted", ({ id }) => scenarios.delete(id));
hear("samples", ({ scenario, count }) => {
  const known = scenarios.get(scenario);
  if (known) scenarios.set(scenario, { ...known, samples: count });
});
on("resync", () => Promise.all([loadScenarios(), loadChains({ again: true })]).catch(complain));
onPlace((now, before) => {
  if (!ready || (now.scenario === before.scenario && now.together === before.together)) return;
  loadNamed().then(tell, complain);
});
