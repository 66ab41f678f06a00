// The chains of a scenario: starting them, watching them, and what they say of themselves.
import { allWorlds, startChains } from "./catalog.js";
import { ChainRow } from "./chain_row.js";
import { Diagnostics } from "./diagnostics.js";
import { TracePlot } from "./trace_plot.js";
import { arrange, h } from "./dom.js";
import { complain } from "./notice.js";

const COLUMNS = ["Chain", "State", "Iterations", "per s", "Accepted", "Animations", "First after", ""];

export class ChainPanel {
  /** @param {import("./types.js").Scenario} scenario */
  constructor(scenario) {
    this.scenario = scenario.id;
    this.world = scenario.world;
    /** @type {Map<string, ChainRow>} */
    this.rows = new Map();
    this.body = h("tbody");
    this.none = h("p.dim", {}, "No chain has been started yet.");
    this.plot = new TracePlot();
    this.diagnostics = new Diagnostics(scenario.id);
    this.table = h("table.chains", {}, h("thead", {}, h("tr", {}, ...COLUMNS.map((words) => h("th", { scope: "col" }, words || h("span.unseen", {}, "Controls"))))), this.body);
    this.element = h(
      "section.chain-panel",
      {},
      this.#form(),
      h("div.scroller", {}, this.table),
      this.none,
      this.plot.element,
      this.diagnostics.element,
    );
  }

  /** @param {import("./types.js").Chain[]} chains */
  show(chains) {
    for (const chain of chains) {
      if (!this.rows.has(chain.id)) this.rows.set(chain.id, new ChainRow(chain.id));
      this.rows.get(chain.id).show(chain);
    }
    arrange(this.body, chains.map((chain) => this.rows.get(chain.id).element));
    this.none.hidden = chains.length > 0;
    this.table.hidden = !chains.length;
    this.plot.show(chains);
    this.diagnostics.show(chains);
  }

  close() {
    this.plot.close();
    this.diagnostics.close();
  }

  #form() {
    const field = (words, input) => h("label.field", {}, h("span", {}, words), input);
    const number = (props) => h("input", { type: "number", inputMode: "numeric", ...props });
    const howMany = number({ name: "count", min: "1", max: "64", value: "1", required: true });
    const samples = number({ name: "samples", min: "1", value: "50", placeholder: "never" });
    const seed = number({ name: "seed", min: "0", placeholder: "any" });
    const method = h("select", { name: "method" }, h("option", { value: "" }, "the world’s own"));
    allWorlds().then((worlds) => {
      const world = worlds.find(({ name }) => name === this.world);
      if (!world) return;
      method.options[0].text = `${world.default_method} (usual)`;
      method.append(...(world.methods ?? []).filter((name) => name !== world.default_method).map((name) => h("option", { value: name }, name)));
    }, complain);
    const start = h("button.primary", { type: "submit" }, "Start");
    const submit = async (event) => {
      event.preventDefault();
      start.disabled = true;
      const wanted = { count: howMany.valueAsNumber };
      if (samples.value) wanted.stop = { samples: samples.valueAsNumber };
      if (seed.value) wanted.seed = seed.valueAsNumber;
      if (method.value) wanted.method = method.value;
      await startChains(this.scenario, wanted).catch(complain);
      start.disabled = false;
    };
    return h(
      "form.start-chains",
      { onsubmit: submit, "aria-label": "Start chains" },
      field("Chains", howMany),
      field("Stop after animations", samples),
      field("Method", method),
      field("Seed", seed),
      start,
    );
  }
}
