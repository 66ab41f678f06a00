// How often the neighbours of a ladder trade places: a small plot for each chain that has one, the weakest step first.
import { h, say, svg } from "./dom.js";
import { number, percent } from "./words.js";

const MOST = 4; // ladders; more say no more
const HEIGHT = 48; // [px]
const USUAL_RATE = 0.4; // fills the height unless a rate is larger

export class SwapPlot {
  constructor() {
    this.ladders = h("ul.ladders");
    this.weakest = h("p.dim");
    this.element = h("section.swaps", { hidden: true }, h("div.section-head", {}, h("h3", {}, "Trades of places along the ladder")), this.weakest, this.ladders);
  }

  /** @param {import("./types.js").Swap[]} swaps @param {import("./types.js").Chain[]} chains */
  show(swaps, chains) {
    const tried = swaps.filter(({ proposed }) => proposed > 0);
    this.element.hidden = !tried.length;
    if (!tried.length) return;
    const weakest = tried.reduce((least, swap) => (rate(swap) < rate(least) ? swap : least));
    say(this.weakest, `From chance, on the left, to the whole wish. The weakest step trades ${number(100 * rate(weakest), 2)} % of the time, between ${number(weakest.low, 2)} and ${number(weakest.high, 2)} of the wish.`);
    const ladders = Object.entries(Object.groupBy(tried, ({ chain }) => chain));
    const least = ([, steps]) => Math.min(...steps.map(rate));
    const shown = ladders.sort((a, b) => least(a) - least(b)).slice(0, MOST);
    const most = Math.max(USUAL_RATE, ...tried.map(rate));
    this.ladders.replaceChildren(...shown.map(([id, steps]) => ladder(nameOf(chains.find((chain) => chain.id === id)), steps, most)));
  }
}

const rate = ({ accepted, proposed }) => accepted / proposed;
const nameOf = (chain) => (chain ? `Chain ${chain.index + 1}` : "A chain");

function ladder(name, steps, most) {
  const rungs = [...steps].sort((a, b) => a.low - b.low);
  const wide = 100 / rungs.length;
  const columns = rungs.map((swap, at) => {
    const height = Math.max(1, (HEIGHT * rate(swap)) / most);
    const column = svg("rect.step", { x: `${((at + 0.15) * wide).toFixed(2)}%`, width: `${(0.7 * wide).toFixed(2)}%`, y: HEIGHT - height, height, rx: 2 });
    column.append(svg("title", {}, `${percent(swap.accepted, swap.proposed)} of ${swap.proposed}, β ${number(swap.low, 2)} to ${number(swap.high, 2)}`));
    return column;
  });
  const rates = rungs.map(rate);
  const range = `${number(100 * Math.min(...rates), 2)} to ${number(100 * Math.max(...rates), 2)} %`;
  const said = `${name}: ${rungs.length} ${rungs.length === 1 ? "step" : "steps"}, trades succeed ${range} of the time`;
  const floor = svg("line.floor", { x1: 0, x2: "100%", y1: HEIGHT, y2: HEIGHT });
  return h("li", {}, svg("svg.ladder", { height: HEIGHT + 1, role: "img", "aria-label": said }, ...columns, floor), h("div.ladder-line", { "aria-hidden": "true" }, h("span", {}, name), h("span", {}, range)));
}
