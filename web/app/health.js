// How a scenario fares: the odds of its wish, how many of its animations are independent, and what they cost.
import { pathOf, request } from "./api.js";
import { worldOf } from "./catalog.js";
import { h, say } from "./dom.js";
import { agreementOf, basisInWords, busyInWords, difficultyInWords, difficultyNotes, independenceInWords, independenceNotes, isGuided, oddsInWords, timeInWords, timeNotes, triesOf } from "./health_words.js";
import { complain } from "./notice.js";
import { oddsLine } from "./odds_line.js";
import { QuantityPlot } from "./quantity_plot.js";
import { SwapPlot } from "./swap_plot.js";

const REFRESH = 4000; // [ms]

export class Health {
  /** @param {import("./types.js").Scenario} scenario */
  constructor(scenario) {
    this.path = pathOf("scenarios", scenario.id, "/diagnostics");
    this.odds = new Card("odds", "Odds");
    this.independence = new Card("independence", "Independence");
    this.time = new Card("time", "Time");
    this.quantities = new QuantityPlot();
    this.swaps = new SwapPlot();
    this.element = h(
      "section.health",
      { "aria-label": "Health" },
      h("h2.unseen", {}, "Health"),
      h("div.cards", {}, this.odds.element, this.independence.element, this.time.element),
      this.quantities.element,
      this.swaps.element,
    );
  }

  /** @param {import("./types.js").Scenario} scenario @param {import("./types.js").Chain[]} chains */
  show(scenario, chains) {
    this.scenario = scenario;
    this.tries = triesOf(worldOf(scenario.world)); // of worlds that may have come since
    const news = chains.length !== this.chains?.length;
    this.chains = chains;
    this.#showOdds();
    this.#showIndependence();
    if (news) this.#showSwaps();
    const key = chains.map(({ id, state, iteration }) => `${id} ${state} ${iteration}`).join();
    if (key === this.key || this.timer) return;
    const wait = this.key === undefined ? 0 : REFRESH;
    this.key = key;
    this.timer = setTimeout(() => {
      this.timer = null;
      if (!this.closed) this.#load();
    }, wait);
  }

  close() {
    this.closed = true;
    clearTimeout(this.timer);
    this.quantities.close();
  }

  async #load() {
    try {
      const diagnostics = await request(this.path);
      if (this.closed) return;
      this.diagnostics = diagnostics;
      this.#showOdds();
      this.#showIndependence();
      this.time.show(timeInWords(diagnostics), timeNotes(diagnostics, this.chains.some(({ state }) => state === "running")));
      this.quantities.show(diagnostics.quantities, diagnostics.quantity_count);
      this.#showSwaps();
    } catch (error) {
      complain(error);
    }
  }

  #showOdds() {
    const { difficulty, samples } = this.scenario;
    const odds = this.diagnostics?.odds ?? this.scenario.odds;
    // A first look that saw a hit says more than chains that have not.
    if (odds && (odds.probability > 0 || !difficulty?.hits)) {
      const { often, interval } = oddsInWords(odds, this.tries);
      this.odds.show(often, [interval && `${interval}, with 95 % confidence.`, basisInWords(odds, this.tries)], oddsLine, odds);
    } else if (difficulty) {
      const notes = difficultyNotes(difficulty, this.tries, this.chains.some(isGuided));
      this.odds.show(difficultyInWords(difficulty, this.tries, samples), notes, oddsLine, estimateOf(difficulty));
    } else {
      this.odds.show("Not known yet", ["Plain draws, or chains that have learned, tell how rare the wish is."]);
    }
  }

  /** The names of the chains may come after the diagnostics. */
  #showSwaps() {
    if (this.diagnostics) this.swaps.show(this.diagnostics.swaps, this.chains);
  }

  #showIndependence() {
    const { diagnostics } = this;
    if (!diagnostics) return;
    this.independence.show(independenceInWords(diagnostics.effective), independenceNotes(diagnostics, busyInWords(this.chains)), agreementSign, agreementOf(diagnostics));
  }
}

function agreementSign({ words, agree, rhat }) {
  const sign = h("p.agreement", {}, `${words} `, h("span.dim", {}, `R-hat ${rhat.toFixed(2)} at worst`));
  sign.dataset.agree = String(agree);
  return sign;
}

/** What a first look says, as the odds line draws it. @param {import("./types.js").Difficulty} difficulty */
function estimateOf({ one_in, at_least }) {
  const probability = one_in === null ? 0 : 1 / one_in;
  return { probability, low: probability, high: 1 / at_least };
}

/** A few words that count, and below them where they come from. */
class Card {
  constructor(name, title) {
    this.words = h("p.headline");
    this.figure = h("div.figure");
    this.notes = h("div.card-notes");
    this.element = h("section.card", {}, h("h3", {}, title), this.words, this.figure, this.notes);
    this.element.dataset.card = name;
  }

  /**
   * @param {string} words @param {string[]} notes the empty ones are left out
   * @param {(data: any) => Element} [draw] @param {any} [data] nothing is drawn without
   */
  show(words, notes, draw, data = null) {
    const told = JSON.stringify([words, notes, data]);
    if (told === this.told) return;
    this.told = told;
    say(this.words, words);
    this.figure.hidden = !data;
    this.figure.replaceChildren(...(data ? [draw(data)] : []));
    this.notes.replaceChildren(...notes.filter(Boolean).map((note) => h("p", {}, note)));
  }
}
