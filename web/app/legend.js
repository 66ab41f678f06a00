// What the colours of the ground mean: a bar of them with its numbers.
import { h, say } from "./dom.js";
import { capital, number, spaced } from "./words.js";

export class Legend {
  constructor() {
    this.name = h("span.scale-name");
    this.bar = h("span.scale-bar");
    this.low = h("span");
    this.middle = h("span");
    this.high = h("span");
    this.element = h("div.scale", { role: "img", hidden: true }, this.name, this.bar, h("span.scale-numbers", {}, this.low, this.middle, this.high));
  }

  /** @param {import("./ground.js").Legend|null} legend null: nothing is coloured */
  show(legend) {
    this.element.hidden = !legend;
    if (!legend) return;
    const { name, low, high, colors } = legend;
    say(this.name, capital(spaced(name)));
    this.bar.style.background = `linear-gradient(to right, ${colors.join(", ")})`;
    for (const [element, value] of [[this.low, low], [this.middle, (low + high) / 2], [this.high, high]]) say(element, number(value, 2));
    this.element.setAttribute("aria-label", `${capital(spaced(name))}, from ${number(low, 2)} in dark blue to ${number(high, 2)} in yellow`);
  }
}
