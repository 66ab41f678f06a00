// The program's answers with all that changes from run to run, or with a world's physics, held still; and answers laid
// over them. What is added to the contract comes through by itself.
import { TRACE } from "./laid.mjs";

const MOMENT = "2026-01-01T12:00:00.000Z";
const DIFFICULTIES = [
  { verdict: "common", one_in: 8.2, at_least: 7.1, draws: 700, hits: 85, seconds: 1 },
  { verdict: "rare", one_in: 1400, at_least: 390, draws: 1400, hits: 1, seconds: 1 },
];

/** A number for a name and a place in a list, the same in every run. @param {string} name @param {number} place */
const numberOf = (name, place) => (([...name].reduce((sum, letter) => (31 * sum + letter.charCodeAt(0)) % 9973, 7) + 613 * place) % 4000) / 1000 + 0.5;

/** A measure or a variable keeps its kind. @param {string} name @param {any} value @param {number} place */
function still(name, value, place) {
  if (Array.isArray(value)) return value.map((each, at) => (typeof each === "number" ? at + 1 : still(name, each, place)));
  if (value && typeof value === "object") return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, still(key, each, place)]));
  return typeof value === "number" ? numberOf(name, place) : value;
}

const SAMPLE = {
  iteration: 4211, weight: 3, log_prior: -12.34, log_constraint: -0.5, duration: 3.21, plays: 2, learning: false,
  created_at: MOMENT, digest: "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
};

/** Samples by their places in the lists that told of them. @type {Map<string, number>} */
const places = new Map();

/** @param {object} sample */
function stillSample(sample) {
  const known = Object.keys(SAMPLE).filter((key) => key in sample);
  const place = places.get(sample.id) ?? 0;
  const body = { ...sample, ...Object.fromEntries(known.map((key) => [key, SAMPLE[key]])), measures: still("", sample.measures, place) };
  if (sample.variables) body.variables = still("", sample.variables, place);
  return body;
}

/** @param {{samples: object[]}} body */
function stillSamples(body) {
  body.samples.forEach(({ id }, at) => places.has(id) || places.set(id, at));
  return { ...body, samples: body.samples.map(stillSample) };
}

/** A graphics card that draws nothing: what three.js asks for is there and has no effect. Runs in the page. */
export function blankGraphics() {
  const told = { VERSION: "WebGL 2.0", SHADING_LANGUAGE_VERSION: "WebGL GLSL ES 3.00", SCISSOR_BOX: [0, 0, 1, 1], VIEWPORT: [0, 0, 1, 1] };
  const answers = {
    getParameter: (name) => told[Object.keys(told).find((key) => WebGL2RenderingContext[key] === name)] ?? 64,
    getContextAttributes: () => ({}),
    getExtension: () => null,
    getShaderPrecisionFormat: () => ({ rangeMin: 127, rangeMax: 127, precision: 23 }),
    getProgramParameter: (_, name) => (name === WebGL2RenderingContext.LINK_STATUS ? true : 0),
    getShaderInfoLog: () => "",
    getProgramInfoLog: () => "",
    getAttribLocation: () => -1,
    isContextLost: () => false,
  };
  const context = new Proxy(answers, {
    get: (_, name) => answers[name] ?? WebGL2RenderingContext[name] ?? (String(name).startsWith("create") ? () => ({}) : () => null),
  });
  const real = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
    return kind === "webgl2" ? context : real.call(this, kind, ...rest);
  };
}

/** A stream of events through which nothing comes; `breakOff` ends it for good. Runs in the page. */
function silentStream() {
  globalThis.EventSource = class extends EventTarget {
    static #all = new Set();

    constructor() {
      super();
      EventSource.#all.add(this);
      setTimeout(() => this.dispatchEvent(new Event(globalThis.serverIsGone ? "error" : "open")));
    }

    close() {
      EventSource.#all.delete(this);
    }

    static breakOff() {
      globalThis.serverIsGone = true;
      for (const stream of EventSource.#all) stream.dispatchEvent(new Event("error"));
    }
  };
}

/** The server is gone from now on. @param {import("playwright-core").Page} page */
export async function leave(page) {
  for (const path of ["**/v1/**", "**/healthz"]) await page.route(path, (route) => route.abort());
  await page.evaluate(() => EventSource.breakOff());
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
    [/\/v1\/scenarios\/[^/]+\/samples$/, stillSamples],
    [/\/v1\/scenarios\/[^/]+\/plays$/, (body) => ({ ...body, sample: stillSample(body.sample) })],
    [/\/v1\/scenarios$/, (body) => ({ ...body, scenarios: body.scenarios.map(scenario) })],
    [/\/v1\/scenarios\/[^/]+$/, scenario],
    [/\/v1\/samples\/[^/]+$/, stillSample],
  ];
  await page.addInitScript(silentStream);
  await page.route("**/v1/**", async (route) => {
    const { pathname } = new URL(route.request().url());
    if (/\/trace$/.test(pathname)) return route.fulfill({ json: TRACE });
    const [pattern, change] = answers.find(([each]) => each.test(pathname)) ?? [];
    if (!pattern) return route.continue();
    const response = await route.fetch();
    if (!response.ok() || response.status() === 204) return route.fulfill({ response });
    return route.fulfill({ response, json: change(await response.json(), pathname.match(pattern)[1]) });
  });
}
