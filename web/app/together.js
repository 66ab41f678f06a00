// Several scenarios side by side, a fresh animation of each, played by one clock.
import { pathOf, post, request } from "./api.js";
import { allScenarios } from "./catalog.js";
import { arrange, h, say } from "./dom.js";
import { InStep, playsAll } from "./in_step.js";
import { on } from "./live.js";
import { complain, notice } from "./notice.js";
import { stage } from "./stage.js";
import { Tile } from "./tile.js";
import { go, place, settle } from "./url_state.js";
import { capital } from "./words.js";

export const MOST = 12;
const COUNTS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"];

/** What a title begins with that is one of a series: "Figure 9: die 1" is of "Figure 9". @param {string} title */
export const seriesOf = (title) => title.match(/^(.+?): /)?.[1] ?? "";

/** The scenarios that are shown together, each with the sample that is shown of it, "" for a fresh one. */
function chosen() {
  const takes = place().takes.split(",");
  const pairs = place().together.split(",").map((id, at) => [id, takes[at] ?? ""]);
  return new Map(pairs.filter(([id]) => id).slice(0, MOST));
}

/** @param {Map<string, string>} pairs of a scenario and its sample */
const asPlace = (pairs) => ({ together: [...pairs.keys()].join(","), takes: [...pairs.values()].join(",").replace(/^,+$/, "") });

export const isChosen = (id) => chosen().has(id);
export const isFull = () => chosen().size >= MOST;

/** The change of place that shows a scenario together with the others, or no longer. @param {string} id */
export function toggled(id) {
  const pairs = chosen();
  if (!pairs.delete(id)) pairs.set(id, "");
  return asPlace(pairs);
}

/** Whoever reads this page in this tab, as a player: what is fresh to one reader is not to another. */
function reader() {
  const anew = () => `gallery-${[...crypto.getRandomValues(new Uint32Array(4))].map((part) => part.toString(36)).join("-")}`;
  try {
    return (sessionStorage.reader ??= anew());
  } catch {
    return anew(); // a browser that keeps nothing
  }
}
const READER = reader();

export class Together {
  /** @type {Map<string, Tile>} by scenario */
  #tiles = new Map();
  #waiting = new Map();
  #asked = new Set();
  /** What gave no sample is not asked again before something happened. */
  #dry = new Set();
  #samples = new Map();
  #open = true;

  constructor() {
    this.id = "together";
    this.title = h("h1");
    this.clock = new InStep(() => this.#tiles.values(), () => this.#open);
    this.grid = h("ul.grid", { "aria-label": "Animations" });
    this.element = h(
      "article.together",
      {},
      h(
        "header.wish",
        {},
        h("div.wish-words", {}, this.title, h("p.sentence", {}, "One clock for all, and a fresh animation of each.")),
        h("div.wish-act", {}, h("button.primary", { type: "button", onclick: () => go({ takes: "" }) }, "Fresh ones")),
      ),
      h("div.toolbar", {}, this.clock.button),
      this.grid,
    );
    this.inView = new IntersectionObserver((entries) => {
      for (const entry of entries) entry.target.tile?.setVisible(entry.isIntersecting);
    }, { rootMargin: "240px" });
    this.endings = [
      on("samples", ({ scenario }) => this.#dry.delete(scenario)),
      on("resync", () => {
        this.#dry.clear();
        for (const tile of this.#tiles.values()) tile.retry();
        this.show();
      }),
    ];
  }

  /** Follows the address and the catalog. */
  show() {
    const pairs = chosen();
    const known = new Map(allScenarios().map((scenario) => [scenario.id, scenario]));
    const series = new Set([...pairs.keys()].map((id) => seriesOf(known.get(id)?.title ?? "")));
    const [name] = series.size === 1 && pairs.size > 1 ? series : [""];
    say(this.title, name || `${capital(COUNTS[pairs.size])} ${pairs.size === 1 ? "scenario" : "scenarios together"}`);
    document.title = `${this.title.textContent} – Retake`;
    for (const [id, tile] of this.#tiles) {
      if (pairs.get(id) === tile.sample.id) continue;
      tile.close();
      this.#tiles.delete(id);
    }
    arrange(this.grid, [...pairs.keys()].map((id) => this.#tiles.get(id)?.element ?? this.#place(id, known.get(id))));
    for (const [id, sample] of pairs) {
      if (this.#tiles.has(id)) continue;
      if (!sample && known.get(id)?.samples === 0) this.#note(id, "Nothing found yet");
      else this.#ask(id, sample);
    }
    for (const [id, tile] of this.#tiles) tile.caption({ gist: known.get(id)?.title ?? "", more: "" });
    // A layout that moved is drawn anew.
    stage.request();
    this.clock.follow();
  }

  close() {
    this.#open = false;
    for (const end of this.endings) end();
    this.inView.disconnect();
    for (const tile of this.#tiles.values()) tile.close();
  }

  /** Where a tile is going to be. */
  #place(id, scenario) {
    if (!this.#waiting.has(id)) this.#waiting.set(id, h("li.tile", {}, h("span.shot", {}, h("span.shot-note")), h("span.tile-line", {}, h("span.tile-gist"))));
    const element = this.#waiting.get(id);
    say(element.querySelector(".tile-gist"), scenario?.title ?? "");
    return element;
  }

  /** Asks for a sample of a scenario: the one that the address names, else a fresh one, which it names then. */
  async #ask(id, wanted) {
    if (this.#asked.has(id) || this.#dry.has(id)) return;
    this.#asked.add(id);
    try {
      const sample = wanted ? this.#samples.get(wanted) ?? (await request(pathOf("samples", wanted))) : (await post(pathOf("scenarios", id, "/plays"), { player: READER })).sample;
      if (!this.#open) return;
      if (sample.scenario !== id) {
        notice(`The animation “${sample.id}” is of another scenario; a fresh one takes its place.`);
        this.#asked.delete(id);
        settle(asPlace(chosen().set(id, "")));
        return this.show();
      }
      this.#samples.set(sample.id, sample);
      this.#asked.delete(id);
      this.#note(id, "");
      const pairs = chosen();
      if (!pairs.has(id) || (pairs.get(id) && pairs.get(id) !== sample.id)) return this.show();
      this.#tiles.set(id, this.#newTile(sample));
      settle(asPlace(pairs.set(id, sample.id)));
      this.show();
    } catch (error) {
      this.#asked.delete(id);
      if (!this.#open) return;
      if (error.status === 404 && wanted) {
        notice(`There is no animation “${wanted}” any more; a fresh one takes its place.`);
        settle(asPlace(chosen().set(id, "")));
        return this.show();
      }
      this.#dry.add(id);
      this.#note(id, error.status === 404 ? "Not here any more" : error.status === 503 ? "Nothing found yet" : "Not available");
      if (error.status !== 404 && error.status !== 503) complain(error);
    }
  }

  #note(id, text) {
    say(this.#waiting.get(id).querySelector(".shot-note"), text);
  }

  #newTile(sample) {
    const tile = new Tile(sample, { admit() {}, framing: (take) => take.framing, playsAll });
    this.inView.observe(tile.element);
    return tile;
  }
}
