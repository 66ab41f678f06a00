// Several scenarios side by side, a fresh animation of each, played by one clock.
import { pathOf, post, request } from "./api.js";
import { allScenarios } from "./catalog.js";
import { arrange, h, say } from "./dom.js";
import { InStep, playsAll } from "./in_step.js";
import { on } from "./live.js";
import { complain } from "./notice.js";
import { stage } from "./stage.js";
import { Tile } from "./tile.js";
import { place, settle } from "./url_state.js";
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

export class Together {
  /** @type {Map<string, Tile>} by scenario */
  #tiles = new Map();
  #waiting = new Map();
  #asked = new Set();
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
        h("div.wish-act", {}, h("button.primary", { type: "button", onclick: () => settle({ takes: "" }) }, "Fresh ones")),
      ),
      h("div.toolbar", {}, this.clock.button),
      this.grid,
    );
    this.inView = new IntersectionObserver((entries) => {
      for (const entry of entries) entry.target.tile?.setVisible(entry.isIntersecting);
    }, { rootMargin: "240px" });
    this.endings = [
      on("samples", ({ scenario }) => this.#askAgain(scenario)),
      on("resync", () => {
        for (const id of chosen().keys()) this.#askAgain(id);
        for (const tile of this.#tiles.values()) tile.retry();
      }),
    ];
  }

  /** Follows the address and the catalog. */
  show() {
    const pairs = chosen();
    const known = new Map(allScenarios().map((scenario) => [scenario.id, scenario]));
    const series = new Set([...pairs.keys()].map((id) => seriesOf(known.get(id)?.title ?? "")));
    const [name] = series.size === 1 ? series : [""];
    say(this.title, name || `${capital(COUNTS[pairs.size])} ${pairs.size === 1 ? "scenario" : "scenarios together"}`);
    document.title = `${this.title.textContent} – Retake`;
    for (const [id, tile] of this.#tiles) {
      if (pairs.get(id) === tile.sample.id) continue;
      tile.close();
      this.#tiles.delete(id);
    }
    for (const [id, sample] of pairs) if (!this.#tiles.has(id)) this.#ask(id, sample);
    arrange(this.grid, [...pairs.keys()].map((id) => this.#tiles.get(id)?.element ?? this.#place(id, known.get(id))));
    for (const [id, tile] of this.#tiles) tile.name(known.get(id)?.title ?? "");
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
    if (this.#asked.has(id)) return;
    this.#asked.add(id);
    try {
      const sample = wanted ? this.#samples.get(wanted) ?? (await request(pathOf("samples", wanted))) : (await post(pathOf("scenarios", id, "/plays"), {})).sample;
      if (!this.#open) return;
      this.#samples.set(sample.id, sample);
      this.#asked.delete(id);
      const pairs = chosen();
      if (!pairs.has(id) || (pairs.get(id) && pairs.get(id) !== sample.id)) return this.show();
      this.#tiles.set(id, this.#newTile(sample));
      settle(asPlace(pairs.set(id, sample.id)));
      this.show();
    } catch (error) {
      const element = this.#waiting.get(id);
      // What is not there yet is asked for again when the scenario has found something.
      if (error.status === 503) say(element.querySelector(".shot-note"), "Nothing found yet");
      else if (error.status === 404) say(element.querySelector(".shot-note"), "Not here any more");
      else complain(error);
      if (error.status !== 404) this.#asked.delete(id);
      if (error.status === 404 && wanted && this.#open) this.#forget(id);
    }
  }

  /** The sample that the address names is gone: a fresh one takes its place. */
  #forget(id) {
    this.#asked.delete(id);
    settle(asPlace(chosen().set(id, "")));
    this.show();
  }

  #askAgain(id) {
    const pairs = chosen();
    if (pairs.has(id) && !this.#tiles.has(id)) this.#ask(id, pairs.get(id));
  }

  #newTile(sample) {
    const tile = new Tile(sample, { admit() {}, framing: (take) => take.framing, playsAll });
    this.inView.observe(tile.element);
    return tile;
  }
}
