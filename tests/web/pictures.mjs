// Pictures of the page beside kept ones: grey and at half its size or less, which is enough to see what moved, vanished
// or changed its tone, and keeps all of them small.
import { mkdir, mkdtemp, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import pixelmatch from "pixelmatch";
import { PNG } from "pngjs";

const KEPT = new URL("pictures/", import.meta.url);
const RENEW = process.env.RETAKE_RENEW_PICTURES === "1";
const TONES = 32; // kept of 256: a third of the size, and less than anti-aliasing differs by
const THRESHOLD = 0.1; // how much a pixel may differ, of black and white; anti-aliased edges do not count
const WINDOW = 24; // [px] of a picture: differences count where they are together
const MOST = 12; // pixels that may differ in such a window: a letter and a half

export class Pictures {
  #seen = new Set();
  #differing = "";

  /** @param {import("playwright-core").Page} page */
  constructor(page) {
    this.page = page;
  }

  /**
   * Takes a picture and holds it against the kept one.
   * @param {string} name @param {number} scale @param {{x: number, y: number, width: number, height: number}} clip
   * @returns {Promise<string>} what differs and where both can be looked at; "" if nothing does
   */
  async compare(name, scale, clip) {
    this.#seen.add(`${name}.png`);
    this.browser ??= await this.page.context().newCDPSession(this.page);
    const { data } = await this.browser.send("Page.captureScreenshot", { format: "png", optimizeForSpeed: true, clip: { ...clip, scale } });
    const actual = gray(PNG.sync.read(Buffer.from(data, "base64")));
    if (RENEW) {
      await mkdir(KEPT, { recursive: true });
      await writeFile(new URL(`${name}.png`, KEPT), packed(actual));
      return "";
    }
    const bytes = await readFile(new URL(`${name}.png`, KEPT)).catch(() => null);
    const kept = bytes && PNG.sync.read(bytes);
    const difference = new PNG({ width: actual.width, height: actual.height });
    let what = "";
    if (!kept) what = "there is no kept picture";
    else if (kept.width !== actual.width || kept.height !== actual.height) what = `it is ${actual.width} x ${actual.height} and was ${kept.width} x ${kept.height}`;
    else {
      const most = pixelmatch(kept.data, actual.data, difference.data, actual.width, actual.height, { threshold: THRESHOLD, windowSize: WINDOW });
      if (most > MOST) what = `${most} pixels differ in one place`;
    }
    if (!what) return "";
    this.#differing ||= await mkdtemp(join(tmpdir(), "retake-pictures-"));
    await writeFile(join(this.#differing, `${name}.png`), packed(actual));
    if (what.includes("differ")) await writeFile(join(this.#differing, `${name}.difference.png`), PNG.sync.write(difference));
    return `the picture: ${what}; see ${join(this.#differing, name)}*.png (to keep it: RETAKE_RENEW_PICTURES=1)`;
  }

  /** Kept pictures that nothing was held against; renewing takes them away. @returns {Promise<string[]>} */
  async orphans() {
    const names = (await readdir(KEPT)).filter((name) => !this.#seen.has(name));
    if (!RENEW) return names;
    await Promise.all(names.map((name) => rm(new URL(name, KEPT))));
    return [];
  }
}

/** The picture with few tones of grey. @param {PNG} picture */
function gray(picture) {
  const { data } = picture;
  for (let at = 0; at < data.length; at += 4) {
    const luminance = 0.299 * data[at] + 0.587 * data[at + 1] + 0.114 * data[at + 2];
    const tone = Math.round((Math.round((luminance / 255) * (TONES - 1)) * 255) / (TONES - 1));
    data[at] = data[at + 1] = data[at + 2] = tone;
  }
  return picture;
}

const packed = (picture) => PNG.sync.write(picture, { colorType: 0, deflateLevel: 9, filterType: 0 });
