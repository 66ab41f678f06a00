// Starting chains: how many, by which method, and when they shall stop. Open while the address says so.
import { Problem } from "./api.js";
import { allWorlds, startChains } from "./catalog.js";
import { h, onDismiss, say } from "./dom.js";
import { METHODS } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { leave, onPlace, place } from "./url_state.js";

export class ChainForm {
  /** @param {import("./types.js").Scenario} scenario */
  constructor(scenario) {
    this.scenario = scenario.id;
    this.world = scenario.world;
    const field = (words, input) => h("label.field", {}, h("span", {}, words), input);
    const number = (name, props) => h("input", { type: "number", inputMode: "numeric", name, ...props });
    this.count = number("count", { min: "1", max: "64", value: "1", required: true });
    this.seed = number("seed", { min: "0", placeholder: "any" });
    this.counted = number("counted", { min: "1", value: "50", placeholder: "never" });
    this.ess = number("ess", { min: "1", max: "1000", placeholder: "never" });
    this.methods = h("div.choices", { role: "radiogroup", "aria-label": "Method" });
    this.fault = h("p.error", { "aria-live": "polite" });
    this.start = h("button.primary", { type: "submit" }, "Start");
    this.element = h(
      "dialog.sheet",
      { "aria-label": "Start chains" },
      h(
        "form.start-chains",
        { onsubmit: (event) => this.#start(event) },
        h("div.sheet-head", {}, h("h2", {}, "Start chains"), h("button.quiet.square", { type: "button", "aria-label": "Close", onclick: () => leave({ start: "" }) }, icon("close"))),
        this.methods,
        h("div.fields", {}, field("Chains", this.count), field("Seed", this.seed)),
        h("fieldset", {}, h("legend", {}, "Each stops after whichever comes first"), h("div.fields", {}, field("Animations that count", this.counted), field("Independent animations", this.ess))),
        this.fault,
        h("div.sheet-foot", {}, h("p.dim", {}, "Several chains can be checked against each other; one alone cannot."), this.start),
      ),
    );
    onDismiss(this.element, () => this.element.isConnected && leave({ start: "" }));
    this.end = onPlace(() => this.show());
  }

  /** Follows the address. On a hidden tab it stays shut: nobody would see it, and the page behind it would not answer. */
  show() {
    const open = place().start === "on" && place().tab === "chains" && this.element.isConnected;
    if (open === this.element.open) return;
    if (!open) return this.element.close();
    this.element.showModal();
    this.#offer();
  }

  close() {
    this.end();
    this.element.close();
  }

  async #offer() {
    if (this.methods.children.length) return;
    const worlds = await allWorlds().catch(complain);
    const world = worlds?.find(({ name }) => name === this.world);
    if (!world || this.methods.children.length) return;
    this.usual = world.default_method;
    const others = (world.methods ?? []).filter((name) => name !== this.usual);
    this.methods.append(...[this.usual, ...others].map((name) => choice(name, name === this.usual)));
    this.methods.querySelector("input").focus();
  }

  async #start(event) {
    event.preventDefault();
    this.start.disabled = true;
    const wanted = { count: this.count.valueAsNumber };
    const stop = {};
    if (this.counted.value) stop.counted = this.counted.valueAsNumber;
    if (this.ess.value) stop.ess = this.ess.valueAsNumber;
    if (Object.keys(stop).length) wanted.stop = stop;
    if (this.seed.value) wanted.seed = this.seed.valueAsNumber;
    const method = this.methods.querySelector(":checked")?.value;
    if (method && method !== this.usual) wanted.method = method;
    say(this.fault, "");
    try {
      await startChains(this.scenario, wanted);
      leave({ start: "" });
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      say(this.fault, [error.message, ...error.errors.map((fault) => `${fault.pointer} ${fault.detail}`)].join(" – "));
    }
    this.start.disabled = false;
  }
}

function choice(name, usual) {
  const { title, summary } = METHODS[name] ?? { title: name, summary: "" };
  const input = h("input", { type: "radio", name: "method", value: name, checked: usual });
  const words = h("span", {}, h("strong", {}, title, h("span.dim", {}, ` ${name}${usual ? " · usual" : ""}`)), h("span.dim", {}, summary));
  return h("label.choice", {}, input, words);
}
