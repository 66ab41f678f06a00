// What every test of the page needs: the program with a store of its own, a browser, and a page that is watched.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdir, mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

const PROGRAM = process.env.RETAKE_PROGRAM;
const CHROMIUM = process.env.RETAKE_CHROMIUM ?? "/usr/bin/chromium";
export const PATIENCE = 30_000; // [ms] for anything to come true, on a busy machine

const QUIET = [
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
// WebGL without a graphics card.
const SOFTWARE_WEBGL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

/**
 * Starts `retake serve`. A new store has one example, so that chains of others take no time from the test.
 * @param {{store?: string, port?: number, world?: string|null, examples?: boolean, samples?: number, seed?: number}}
 *   [options] a new store and any free port unless given; the world of the example, null for what the program itself
 *   adds, if `examples` are wanted; how many samples are found, and by which seed, any unless given
 * @returns {Promise<{address: string, gallery: string, port: number, store: string, end: () => Promise<void>,
 *   remove: () => Promise<void>}>} `gallery` is the address of the newest scenario's, or of the first screen
 */
export async function startProgram({ store, port = 0, world = "ball2d", examples = world === null, samples = 400, seed } = {}) {
  if (!PROGRAM) throw new Error("RETAKE_PROGRAM must name the program to be tested");
  const folder = store ? null : await mkdtemp(join(tmpdir(), "retake-web-"));
  const path = store ?? join(folder, "retake.db");
  const program = spawn(PROGRAM, ["serve", "--listen", `127.0.0.1:${port}`, "--store", path, "--threads", "1", ...(examples ? [] : ["--no-examples"])], {
    stdio: ["ignore", "pipe", "pipe"],
  });
  // A test that failed has not ended its program.
  const endToo = () => program.kill("SIGKILL");
  process.once("exit", endToo);
  program.once("exit", () => process.off("exit", endToo));
  const ended = new Promise((resolve) => program.once("exit", (code, signal) => resolve({ code, signal })));
  let said = "";
  const address = await new Promise((resolve, reject) => {
    const listen = (bytes) => {
      said += bytes;
      const found = said.match(/http:\/\/127\.0\.0\.1:(\d+)\//);
      if (found) resolve(found[0]);
    };
    program.stdout.on("data", listen);
    program.stderr.on("data", (bytes) => (said += bytes));
    ended.then((end) => reject(new Error(`the program ended (${JSON.stringify(end)}) and said: ${said}`)));
  });
  const end = async () => {
    program.kill("SIGTERM");
    const { code, signal } = await ended;
    if (code !== 0) throw new Error(`the program ended with ${code ?? signal} and said: ${said}`);
  };
  const remove = () => (folder ? rm(folder, { recursive: true, force: true }) : undefined);
  const started = { address, gallery: address, port: Number(new URL(address).port), store: path, end, remove };
  if (!store && world !== null) await addExample(started, world, { samples, seed });
  const [newest] = (await api(started, "/v1/scenarios?limit=1")).scenarios;
  return newest ? { ...started, gallery: `${address}?scenario=${newest.id}` } : started;
}

async function addExample(program, world, { samples, seed }) {
  const { worlds } = await api(program, "/v1/worlds");
  const { id } = await api(program, "/v1/scenarios", json(worlds.find(({ name }) => name === world).examples[0]));
  await api(program, `/v1/scenarios/${id}/chains`, json({ count: 2, seed, stop: { samples } }));
}

/** @param {{webgl?: boolean}} [options] */
export function startBrowser({ webgl = true } = {}) {
  return chromium.launch({
    executablePath: CHROMIUM,
    headless: true,
    args: [...QUIET, ...(webgl ? SOFTWARE_WEBGL : ["--disable-gpu", "--disable-3d-apis"])],
  });
}

/**
 * A new page in a new profile. Whatever goes wrong in it is gathered in `faults`: errors and warnings of the console,
 * exceptions, failed requests. What a test brings about itself it names in `expected`.
 * @param {import("playwright-core").Browser} browser @param {object} [options] of the context
 * @param {RegExp} [expected]
 */
export async function newPage(browser, options = {}, expected = /^$/) {
  const context = await browser.newContext({ viewport: { width: 1120, height: 760 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  const faults = [];
  const note = (text) => expected.test(text) || faults.push(text);
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && note(`console ${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => note(`exception: ${error.stack}`));
  page.on("response", (response) => response.status() >= 400 && note(`${response.status()} ${response.url()}`));
  page.on("requestfailed", (request) => {
    const why = request.failure()?.errorText;
    // Leaving a page ends the requests that it still has.
    if (why !== "net::ERR_ABORTED") note(`${why} ${request.url()}`);
  });
  const close = async () => {
    // Answers that a test lays over those of the program may still be under way.
    await page.unrouteAll({ behavior: "ignoreErrors" });
    await context.close();
  };
  return { page, faults, close };
}

/** Waits until the gallery shows at least `count` drawn pictures. */
export async function drawnTiles(page, count = 4) {
  await page.waitForFunction((least) => document.querySelectorAll(".shot.drawn").length >= least, count);
}

/** The query of the page's address. @param {import("playwright-core").Page} page */
export const query = (page) => Object.fromEntries(new URL(page.url()).searchParams);

/** Waits until the address has these parameters; null says that one is absent. */
export async function arrived(page, wanted) {
  await page.waitForFunction((entries) => {
    const now = new URLSearchParams(location.search);
    return entries.every(([key, value]) => now.get(key) === value);
  }, Object.entries(wanted));
}

/** Waits until an element's part of the canvas shows more than `least` different colours. */
export async function shows(page, selector, least) {
  const end = Date.now() + PATIENCE;
  let colors = await colorsOf(page, selector);
  while (colors <= least && Date.now() < end) {
    await new Promise((resolve) => setTimeout(resolve, 50));
    colors = await colorsOf(page, selector);
  }
  assert.ok(colors > least, `${selector} shows ${colors} colours`);
}

/** How many different colours an element's part of the canvas shows. */
function colorsOf(page, selector) {
  return page.evaluate((of) => {
    const canvas = document.querySelector("canvas.stage");
    const origin = canvas.getBoundingClientRect();
    const { left, top, width, height } = document.querySelector(of).getBoundingClientRect();
    const ratio = canvas.width / origin.width;
    const copy = new OffscreenCanvas(Math.round(width), Math.round(height));
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(canvas, (left - origin.left) * ratio, (top - origin.top) * ratio, width * ratio, height * ratio, 0, 0, copy.width, copy.height);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    const colors = new Set();
    for (let at = 0; at < data.length; at += 4) if (data[at + 3]) colors.add((data[at] << 16) | (data[at + 1] << 8) | data[at + 2]);
    return colors.size;
  }, selector);
}

/** Saves a picture of the page where RETAKE_SCREENSHOTS says, if it says so. */
export async function picture(page, name) {
  const folder = process.env.RETAKE_SCREENSHOTS;
  if (!folder) return;
  await mkdir(folder, { recursive: true });
  await page.screenshot({ path: join(folder, `${name}.png`), animations: "disabled" });
}

/** A POST of `body`. */
export const json = (body) => ({ method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });

/** The answer of the API, as JSON. */
export async function api(program, path, options) {
  const response = await fetch(new URL(path, program.address), options);
  return response.json();
}
