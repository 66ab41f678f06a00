// Whether the chains agree: R-hat, effective sample sizes, and the odds of the wish.
import { pathOf, request } from "./api.js";
import { h, say } from "./dom.js";
import { complain } from "./notice.js";
import { count, number, spaced } from "./words.js";

const REFRESH = 4000; // [ms]
const COLUMNS = [["name", "Quantity"], ["rhat", "R-hat"], ["ess_bulk", "ESS bulk"], ["ess_tail", "ESS tail"], ["mean", "Mean"], ["sd", "SD"]];
const ALARMING_RHAT = 1.05;

export class Diagnostics {
  /** @param {string} scenario id */
  constructor(scenario) {
    this.path = pathOf("scenarios", scenario, "/diagnostics");
    this.odds = h("p.odds", { hidden: true });
    this.body = h("tbody");
    this.element = h(
      "section.diagnostics",
      { hidden: true },
      h("div.section-head", {}, h("h2", {}, "Do the chains agree?"), this.odds),
      h("div.scroller", {}, h("table", {}, h("thead", {}, h("tr", {}, ...COLUMNS.map(([, words]) => h("th", { scope: "col" }, words)))), this.body)),
    );
  }

  /** @param {import("./types.js").Chain[]} chains */
  show(chains) {
    const samples = chains.reduce((sum, chain) => sum + chain.samples, 0);
    if (!samples || samples === this.samples || this.timer) return;
    const wait = this.samples === undefined ? 0 : REFRESH;
    this.samples = samples;
    this.timer = setTimeout(() => {
      this.timer = null;
      if (!this.closed) this.#load();
    }, wait);
  }

  close() {
    this.closed = true;
    clearTimeout(this.timer);
  }

  async #load() {
    try {
      const { quantities = [], odds } = await request(this.path);
      this.element.hidden = !quantities.length && !odds;
      this.body.replaceChildren(...quantities.map(row));
      this.odds.hidden = typeof odds?.probability !== "number";
      if (!this.odds.hidden) say(this.odds, oddsInWords(odds));
    } catch (error) {
      complain(error);
    }
  }
}

function oddsInWords({ probability, low, high }) {
  if (!(probability > 0)) return "By chance it has not happened yet.";
  const once = (share) => number(1 / share, 3);
  const range = low > 0 && high > 0 ? ` (${once(high)} to ${once(low)})` : "";
  return `By chance it happens once in ${once(probability)} tries${range}.`;
}

function row(quantity) {
  const cells = COLUMNS.map(([key]) => {
    if (key === "name") return h("th", { scope: "row" }, spaced(quantity.name));
    const value = quantity[key];
    const cell = h("td", {}, typeof value !== "number" ? "–" : key === "rhat" ? value.toFixed(3) : key.startsWith("ess") ? count(value) : number(value));
    if (key === "rhat" && quantity.rhat > ALARMING_RHAT) cell.className = "alarming";
    return cell;
  });
  return h("tr", {}, ...cells);
}
