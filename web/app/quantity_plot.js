// How many independent values each quantity has: one row for each, the worst first, with the figures beside the bars.
import { h, say, svg } from "./dom.js";
import { AGREEING_RHAT } from "./health_words.js";
import { onPlace, place, settle } from "./url_state.js";
import { count, quantity as quantityInWords, spaced } from "./words.js";

const WORST = 6;
const ROW = 22; // [px] high
/** What a row draws; the last one lies behind. @type {{key: string, words: string, y: number, height: number}[]} */
const BARS = [
  { key: "bulk", words: "All chains together", y: 4, height: 8 },
  { key: "tail", words: "Rare: at the extremes", y: 14, height: 4 },
  { key: "across", words: "Spread: what their means allow", y: 1, height: 20 },
  { key: "within", words: "Alone: what each claims by itself", y: 2, height: 18 },
];
const COLUMNS = ["Quantity", "Independent values", "All", "Rare", "Spread", "Alone", "R-hat", "Mean", "SD"];

export class QuantityPlot {
  constructor() {
    this.body = h("tbody");
    this.all = h("button.quiet", { type: "button", onclick: () => settle({ quantities: place().quantities === "all" ? "worst" : "all" }) });
    this.rest = h("p.dim", {});
    const legend = BARS.map(({ key, words }) => h("li", {}, svg("svg.swatch", { width: 22, height: ROW }, bar(key, key === "across" ? 0.5 : 1)), words));
    this.element = h(
      "section.quantities",
      { hidden: true },
      h("div.section-head", {}, h("h3", {}, "Independent values of each quantity, the fewest first"), h("ul.legend", { "aria-hidden": "true" }, ...legend)),
      h("div.scroller", {}, h("table", {}, h("thead", {}, h("tr", {}, ...COLUMNS.map((words) => h("th", { scope: "col" }, words)))), this.body)),
      h("div.row", {}, this.all, this.rest),
    );
    this.end = onPlace((now, before) => now.quantities !== before.quantities && this.#redraw());
  }

  /** @param {import("./types.js").Quantity[]} quantities @param {number} all how many there are, judged or not */
  show(quantities, all) {
    this.unseen = all - quantities.length;
    this.quantities = [...quantities].sort((a, b) => worth(a) - worth(b));
    this.#redraw();
  }

  close() {
    this.end();
  }

  #redraw() {
    if (!this.quantities) return;
    const more = this.quantities.length - WORST;
    const shown = more > 1 && place().quantities !== "all" ? this.quantities.slice(0, WORST) : this.quantities;
    const most = Math.max(1, ...shown.flatMap(({ ess_bulk, ess_tail, ess_within }) => [ess_bulk ?? 0, ess_tail ?? 0, ess_within ?? 0]));
    this.element.hidden = !shown.length;
    this.body.replaceChildren(...shown.map((quantity) => row(quantity, most)));
    this.all.hidden = more <= 1;
    say(this.all, shown.length < this.quantities.length ? `Show all ${count(this.quantities.length)}` : `Show the ${WORST} worst`);
    say(this.rest, this.unseen > 0 ? `Another ${count(this.unseen)} move more freely or not at all.` : "");
    this.all.setAttribute("aria-expanded", String(shown.length === this.quantities.length));
  }
}

/** What a quantity allows to claim; one that never changes limits nothing. */
const worth = ({ ess_bulk, ess_across }) => Math.min(ess_bulk ?? Infinity, ess_across ?? Infinity);

function bar(key, share) {
  const { y, height } = BARS.find((each) => each.key === key);
  const end = `${(100 * share).toFixed(2)}%`;
  // A limit is a line, an amount a bar.
  if (key === "across") return svg("line.across", { x1: end, x2: end, y1: y, y2: y + height });
  return svg(`rect.${key}`, { x: 0, y, height, rx: Math.min(3, height / 2), width: end });
}

/** @param {import("./types.js").Quantity} quantity */
function row(quantity, most) {
  const { name, unit, rhat, ess_bulk, ess_tail, ess_within, ess_across, mean, sd } = quantity;
  const limits = ess_across !== null && ess_across < ess_bulk;
  const values = { within: ess_within, bulk: ess_bulk, tail: ess_tail, across: limits ? ess_across : null };
  const bars = BARS.toReversed().filter(({ key }) => values[key] > 0).map(({ key }) => bar(key, values[key] / most));
  const figure = (value, words = count, kind = "td") => h(kind, {}, typeof value === "number" ? words(value) : "–");
  const inUnit = (value) => quantityInWords(value, unit);
  const agreement = figure(rhat, (value) => value.toFixed(3));
  if (rhat > AGREEING_RHAT) agreement.className = "alarming";
  return h(
    "tr",
    {},
    h("th", { scope: "row" }, spaced(name)),
    h("td.bars", {}, svg("svg.bars", { height: ROW, "aria-hidden": "true" }, ...bars)),
    figure(ess_bulk, count, limits ? "td" : "td.counting"),
    figure(ess_tail),
    figure(ess_across, count, limits ? "td.counting" : "td"),
    figure(ess_within),
    agreement,
    figure(mean, inUnit),
    figure(sd, inUnit),
  );
}
