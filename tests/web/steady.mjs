// The program's answers with all that changes from run to run, or with a world's physics, held still; and answers laid
// over them. What is added to the contract comes through by itself.
import { TRACE } from "./laid.mjs";

const MOMENT = "2026-01-01T12:00:00.000Z";
const DIFFICULTIES = [
  { verdict: "common", one_in: 8.2, at_least: 7.1, draws: 700, hits: 85, seconds: 1 },
  { verdict: "rare", one_in: 1400, at_least: 390, draws: 1400, hits: 1, seconds: 1 },
];

/** A number for a name, the same in every run. @param {string} name */
const numberOf = (name) => ([...name].reduce((sum, letter) => (31 * sum + letter.charCodeAt(0)) % 9973, 7) % 4000) / 1000 + 0.5;

/** A measure or a variable keeps its kind. @param {string} name @param {any} value */
function still(name, value) {
  if (Array.isArray(value)) return value.map((each, at) => (typeof each === "number" ? at + 1 : still(name, each)));
  if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, still(key, each)]));
  return typeof value === "number" ? numberOf(name) : value;
}

const SAMPLE = {
  iteration: 4211, weight: 3, log_prior: -12.34, log_constraint: -0.5, duration: 3.21, plays: 2, learning: false,
  created_at: MOMENT, digest: "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
};

/** @param {object} sample */
function stillSample(sample) {
  const known = Object.keys(SAMPLE).filter((key) => key in sample);
  const body = { ...sample, ...Object.fromEntries(known.map((key) => [key, SAMPLE[key]])), measures: still("", sample.measures) };
  if (sample.variables) body.variables = still("", sample.variables);
  return body;
}

/**
 * Holds the answers to a page still. Nothing comes through the stream of events.
 * @param {import("playwright-core").Page} page
 * @param {Map<string, {scenario?: object, chains?: object[], diagnostics?: object}>} laid by scenario: what is new in
 *   it, its chains and diagnostics whole
 */
export async function steady(page, laid) {
  const scenario = (one) => ({ ...one, created_at: MOMENT, odds: null, difficulty: DIFFICULTIES[one.world.length % 2], ...laid.get(one.id)?.scenario });
  const answers = [
    [/\/v1\/scenarios\/([^/]+)\/chains$/, (body, id) => (laid.get(id)?.chains ? { chains: laid.get(id).chains.map((chain) => ({ ...chain, scenario: id })) } : body)],
    [/\/v1\/scenarios\/([^/]+)\/diagnostics$/, (body, id) => laid.get(id)?.diagnostics ?? body],
    [/\/v1\/scenarios\/[^/]+\/samples$/, (body) => ({ ...body, samples: body.samples.map(stillSample) })],
    [/\/v1\/scenarios\/[^/]+\/plays$/, (body) => ({ ...body, sample: stillSample(body.sample) })],
    [/\/v1\/scenarios$/, (body) => ({ ...body, scenarios: body.scenarios.map(scenario) })],
    [/\/v1\/scenarios\/[^/]+$/, scenario],
    [/\/v1\/samples\/[^/]+$/, stillSample],
  ];
  await page.route("**/v1/**", async (route) => {
    const { pathname } = new URL(route.request().url());
    if (pathname === "/v1/events") return route.fulfill({ contentType: "text/event-stream", body: ": nothing\n\n" });
    if (/\/trace$/.test(pathname)) return route.fulfill({ json: TRACE });
    const [pattern, change] = answers.find(([each]) => each.test(pathname)) ?? [];
    if (!pattern) return route.continue();
    const response = await route.fetch();
    if (!response.ok() || response.status() === 204) return route.fulfill({ response });
    return route.fulfill({ response, json: change(await response.json(), pathname.match(pattern)[1]) });
  });
}
