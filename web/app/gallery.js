// The grid of live tiles: pages of samples and their order.
import { pathOf, request } from "./api.js";
import { captionsOf } from "./captions.js";
import { meaningOf } from "./catalog.js";
import { arrange, h, say } from "./dom.js";
import { aspectOf, SharedFraming } from "./framing.js";
import { InStep, playsAll } from "./in_step.js";
import { on } from "./live.js";
import { complain } from "./notice.js";
import { stage } from "./stage.js";
import { Tile } from "./tile.js";
import { onPlace, go, place } from "./url_state.js";
import { count } from "./words.js";

const PAGE = 24;
const TILE_ASPECT = 4 / 3; // as the style sheet has it
const WIDE_ASPECT = 3; // and for what is seen much wider than high
const MUCH = 3.5;
const REFILL = 400; // [ms] between two looks at what is new
const ORDERS = { newest: "Newest", oldest: "Oldest", likely: "Likeliest" };
const calm = matchMedia("(prefers-reduced-motion: reduce)");

export class Gallery {
  /** @param {string} scenario id */
  constructor(scenario) {
    this.scenario = scenario;
    this.total = 0;
    this.framing = new SharedFraming(TILE_ASPECT);
    /** @type {Map<string, Tile>} */
    this.tiles = new Map();
    this.order = "";
    this.cursor = null;
    this.lastCursor = null;
    this.generation = 0;
    this.open = true;
    this.captions = captionsOf(scenario);
    meaningOf(scenario).then(({ measures }) => this.captions.mean(measures), complain);
    this.clock = new InStep(() => this.tiles.values(), () => this.open && place().tab !== "chains");
    this.#build();
    this.endings = [
      on("samples", (event) => event.scenario === scenario && this.#arrived(event.count)),
      on("resync", () => this.#resync()),
      onPlace(() => this.clock.follow()),
      this.captions.onChange(() => this.#caption()),
    ];
  }

  #build() {
    this.orders = Object.entries(ORDERS).map(([name, words]) =>
      h("button", { type: "button", "data-order": name, onclick: () => go({ order: name }) }, words));
    this.fresh = h("button.chip", { type: "button", hidden: true, onclick: () => this.#showFresh() });
    this.grid = h("ul.grid", { "aria-label": "Animations" });
    this.more = h("button.quiet.more", { type: "button", hidden: true, onclick: () => this.#loadMore() }, "Load more");
    this.empty = h("div.empty", { hidden: true }, h("p", {}, "No animation yet."), h("p.dim", {}, "They appear here as soon as a chain finds one."));
    this.element = h(
      "section.gallery",
      {},
      h("div.toolbar", {}, h("div.segments", { role: "group", "aria-label": "Order" }, ...this.orders), this.clock.button, this.fresh),
      this.empty,
      this.grid,
      this.more,
    );
    this.nearEnd = new IntersectionObserver((entries) => entries.at(-1).isIntersecting && this.#loadMore(), { rootMargin: "600px" });
    this.nearEnd.observe(this.more);
    this.inView = new IntersectionObserver((entries) => {
      for (const entry of entries) entry.target.tile.setVisible(entry.isIntersecting);
    }, { rootMargin: "240px" });
  }

  /** @param {import("./types.js").Scenario} scenario */
  show(scenario) {
    this.total = Math.max(this.total, scenario.samples);
    const order = ORDERS[place().order] ? place().order : "newest";
    for (const button of this.orders) button.setAttribute("aria-pressed", String(button.dataset.order === order));
    if (order !== this.order) {
      this.order = order;
      this.#load();
    }
    this.clock.follow();
    this.#count();
  }

  close() {
    this.open = false;
    for (const end of this.endings) end();
    this.nearEnd.disconnect();
    this.inView.disconnect();
    for (const tile of this.tiles.values()) tile.close();
  }

  async #ask(cursor) {
    const query = new URLSearchParams({ limit: String(PAGE), order: this.order });
    if (cursor) query.set("cursor", cursor);
    return request(`${pathOf("scenarios", this.scenario, "/samples")}?${query}`);
  }

  /** The first page anew; tiles that stay keep their pictures. */
  async #load() {
    const generation = ++this.generation;
    try {
      const page = await this.#ask();
      if (generation !== this.generation || !this.open) return;
      this.lastCursor = null;
      this.cursor = page.next_cursor ?? null;
      this.#arrange(page.samples);
    } catch (error) {
      complain(error);
    }
  }

  #loadMore() {
    if (this.cursor) this.#append(this.cursor);
  }

  /** Adds what a page has that is not shown yet. @param {string|null} cursor of the page; null: the first */
  async #append(cursor) {
    if (this.loading) return;
    const generation = this.generation;
    this.loading = true;
    try {
      const page = await this.#ask(cursor);
      if (generation !== this.generation || !this.open) return;
      this.lastCursor = cursor;
      this.cursor = page.next_cursor ?? null;
      this.#arrange([...[...this.tiles.values()].map((tile) => tile.sample), ...page.samples]);
    } catch (error) {
      complain(error);
    } finally {
      this.loading = false;
    }
  }

  #arrange(samples) {
    const next = new Map();
    for (const sample of samples) {
      if (next.has(sample.id)) continue;
      const tile = this.tiles.get(sample.id) ?? this.#newTile(sample);
      tile.sample = sample;
      next.set(sample.id, tile);
    }
    for (const [id, tile] of this.tiles) if (!next.has(id)) tile.close();
    this.tiles = next;
    this.captions.admit(samples);
    this.#caption();
    arrange(this.grid, [...next.values()].map((tile) => tile.element));
    this.more.hidden = !this.cursor;
    // Watched anew, so that a page that does not reach the end of the window loads the next one.
    this.nearEnd.unobserve(this.more);
    this.nearEnd.observe(this.more);
    this.#count();
    stage.redraw();
  }

  #caption() {
    for (const [id, tile] of this.tiles) tile.caption(this.captions.of(id));
  }

  #newTile(sample) {
    const tile = new Tile(sample, {
      admit: (take, id) => {
        this.captions.witness(id, take.story, take.rate);
        this.#admit(take.framing);
      },
      framing: (take) => this.framing.of(take.framing),
      playsAll,
    });
    this.inView.observe(tile.element);
    return tile;
  }

  /** The first one decides how wide tiles are. */
  #admit(framing) {
    if (!this.framing.framing && aspectOf(framing) > MUCH) {
      this.framing = new SharedFraming(WIDE_ASPECT);
      this.grid.classList.add("wide");
    }
    if (!this.framing.admit(framing)) return;
    for (const tile of this.tiles.values()) tile.frame();
    stage.redraw();
  }

  /**
   * New samples fill the first page by themselves, and an open end; others wait to be asked for, so that nothing jumps.
   * @param {number} total
   */
  #arrived(total) {
    this.total = total;
    this.#count();
    const fills = this.order === "oldest" ? !this.cursor && this.tiles.size < total : this.tiles.size < PAGE;
    if (!this.order || !fills) return;
    this.filling ??= setTimeout(() => {
      this.filling = null;
      if (!this.open) return;
      if (this.order === "oldest") this.#append(this.lastCursor);
      else this.#load();
    }, REFILL);
  }

  /** What may have been missed: a first page that is not full, pictures that did not come. The rest says the chip. */
  #resync() {
    if (this.order && this.tiles.size < PAGE) this.#load();
    for (const tile of this.tiles.values()) tile.retry();
  }

  #showFresh() {
    this.seen = this.total;
    this.element.scrollIntoView({ block: "start", behavior: calm.matches ? "auto" : "smooth" });
    this.#load();
  }

  #count() {
    this.empty.hidden = this.tiles.size > 0 || this.total > 0;
    const atTop = this.tiles.size < PAGE;
    if (atTop || this.seen === undefined) this.seen = this.total;
    const fresh = this.order !== "oldest" ? this.total - this.seen : 0;
    this.fresh.hidden = fresh <= 0;
    say(this.fresh, `${count(fresh)} new`);
  }
}
