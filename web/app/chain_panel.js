// The chains of a scenario: starting them, watching them, and what they say of themselves.
import { ChainForm } from "./chain_form.js";
import { ChainRow } from "./chain_row.js";
import { arrange, h } from "./dom.js";
import { Health } from "./health.js";
import { icon } from "./icons.js";
import { TracePlot } from "./trace_plot.js";
import { go } from "./url_state.js";

const COLUMNS = ["Chain", "State", "Iterations", "per s", "Accepted", "Animations", "Independent", "First after", ""];

export class ChainPanel {
  /** @param {import("./types.js").Scenario} scenario */
  constructor(scenario) {
    /** @type {Map<string, ChainRow>} */
    this.rows = new Map();
    this.body = h("tbody");
    this.none = h("p.dim", {}, "No chain has been started yet.");
    this.plot = new TracePlot();
    this.health = new Health(scenario);
    this.form = new ChainForm(scenario);
    this.table = h("table.chains", {}, h("thead", {}, h("tr", {}, ...COLUMNS.map((words) => h("th", { scope: "col" }, words || h("span.unseen", {}, "Controls"))))), this.body);
    this.element = h(
      "section.chain-panel",
      {},
      this.health.element,
      h("section.all-chains", {}, h("div.section-head", {}, h("h2", {}, "Chains"), h("button.quiet", { type: "button", onclick: () => go({ start: "on" }) }, icon("plus"), "Start chains")), h("div.scroller", {}, this.table), this.none),
      this.plot.element,
      this.form.element,
    );
  }

  /** @param {import("./types.js").Scenario} scenario @param {import("./types.js").Chain[]} chains */
  show(scenario, chains) {
    for (const chain of chains) {
      if (!this.rows.has(chain.id)) this.rows.set(chain.id, new ChainRow(chain.id));
      this.rows.get(chain.id).show(chain);
    }
    arrange(this.body, chains.map((chain) => this.rows.get(chain.id).element));
    this.none.hidden = chains.length > 0;
    this.table.hidden = !chains.length;
    this.plot.show(chains);
    this.health.show(scenario, chains);
    this.form.show();
  }

  close() {
    this.plot.close();
    this.health.close();
    this.form.close();
  }
}
