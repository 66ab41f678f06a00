// The odds as a point with its interval on a line from "always" to "once in a million" and beyond.
import { svg } from "./dom.js";

const FEWEST_DECADES = 6;
const SHORT = ["1", "10", "100", "1k", "10k", "100k", "1M", "10M", "100M"];
const MARGIN = 4; // [%] at both ends, for the words below

/**
 * @param {{probability: number, low: number, high: number}} odds probability 0: only `high` is known
 * @returns {SVGElement} says nothing that the words beside it do not
 */
export function oddsLine({ probability, low, high }) {
  const rarest = probability > 0 ? 1 / (low || probability) : 10 / high;
  const decades = Math.max(FEWEST_DECADES, Math.min(SHORT.length - 1, Math.ceil(Math.log10(rarest))));
  const at = (share) => MARGIN + (100 - 2 * MARGIN) * Math.min(1, Math.max(0, -Math.log10(share) / decades));
  const percent = (value) => `${value.toFixed(2)}%`;
  const line = (kind, from, to) => svg(`line.${kind}`, { x1: percent(from), x2: percent(to), y1: 12, y2: 12 });
  const parts = [line("axis", at(1), 100 - MARGIN)];
  for (let decade = 0; decade <= decades; ++decade) {
    const x = percent(at(10 ** -decade));
    parts.push(svg("line.tick", { x1: x, x2: x, y1: 9, y2: 15 }), svg("text", { x, y: 31 }, SHORT[decade]));
  }
  if (probability > 0) parts.push(line("interval", at(high), at(low || 10 ** -decades)), svg("circle.point", { cx: percent(at(probability)), cy: 12, r: 5 }));
  else parts.push(fading(), svg("rect.open", { x: percent(at(high)), width: percent(100 - MARGIN - at(high)), y: 8.5, height: 7, rx: 3.5 }));
  return svg("svg.odds-line", { height: 36, "aria-hidden": "true" }, ...parts);
}

/** Somewhere to the right, nobody knows how far. There is one such line on the page. */
function fading() {
  return svg("linearGradient", { id: "fading-odds" }, svg("stop", { offset: "0%" }), svg("stop", { offset: "100%", "stop-opacity": 0 }));
}
