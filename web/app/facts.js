// What is known of the sample in the large view: measures, where it came from, every variable, and its proof.
import { pathOf, post, request } from "./api.js";
import { meaningOf } from "./catalog.js";
import { h, say } from "./dom.js";
import { LEARNING } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { keyframesPath } from "./takes.js";
import { count, number, quantity, seconds, spaced, variableUnit } from "./words.js";

export class Facts {
  constructor() {
    this.learning = h("p.learning", { hidden: true, title: LEARNING }, icon("sprout"), `${LEARNING}.`);
    this.measures = h("dl.facts");
    this.origin = h("dl.facts");
    this.variables = h("dl.facts.variables");
    this.variablesTitle = h("summary");
    this.notes = h("div.notes", { "aria-live": "polite" });
    this.verdict = h("p.verdict", { "aria-live": "polite" });
    this.verify = h("button.quiet", { type: "button", onclick: () => this.#verify() }, icon("check"), "Verify");
    this.keyframes = h("a.button.quiet", { target: "_blank", rel: "noopener" }, "Keyframes");
    this.element = h(
      "div.facts-panel",
      {},
      this.learning,
      this.notes,
      h("section", {}, h("h3", {}, "Measures"), this.measures),
      h("section", {}, h("h3", {}, "Where it comes from"), this.origin),
      h("div.row", {}, this.verify, this.keyframes),
      this.verdict,
      h("details", {}, this.variablesTitle, this.variables),
    );
  }

  /** @param {string} id @returns {Promise<import("./types.js").Sample|null>} null when another is shown meanwhile */
  async show(id) {
    this.id = id;
    say(this.verdict, "");
    delete this.verdict.dataset.identical;
    this.notes.replaceChildren();
    this.learning.hidden = true;
    this.keyframes.href = keyframesPath(id);
    /** @type {import("./types.js").Sample} */
    const sample = await request(pathOf("samples", id));
    const { measures, variable_units } = await meaningOf(sample.scenario);
    if (this.id !== id) return null;
    this.learning.hidden = !sample.learning;
    const told = new Map(measures.map((measure) => [measure.name, measure]));
    const names = [...told.keys()].filter((name) => name in sample.measures);
    names.push(...Object.keys(sample.measures).filter((name) => !told.has(name)));
    fill(this.measures, names.map((name) => [spaced(name), quantity(sample.measures[name], told.get(name)?.unit), told.get(name)?.summary]));
    fill(this.origin, [
      ["duration", seconds(sample.duration)],
      ["iteration", count(sample.iteration)],
      ["counts", sample.learning ? "not at all" : sample.weight === 1 ? "once" : `${count(sample.weight)} times`],
      ["log prior", number(sample.log_prior)],
      ["log constraint", number(sample.log_constraint)],
      ["plays", count(sample.plays)],
      ["found", new Date(sample.created_at).toLocaleString("en-GB", { dateStyle: "medium", timeStyle: "short" })],
      ["digest", sample.digest],
    ]);
    const variables = Object.entries(sample.variables ?? {});
    say(this.variablesTitle, `${count(variables.length)} random ${variables.length === 1 ? "variable" : "variables"}`);
    fill(this.variables, variables.map(([name, value]) => [spaced(name), quantity(value, variableUnit(variable_units, name), 6)]));
    return sample;
  }

  /** @param {string[]} notes */
  note(notes) {
    this.notes.replaceChildren(...notes.map((text) => h("p.note", {}, text)));
  }

  async #verify() {
    const { id } = this;
    this.verify.disabled = true;
    say(this.verdict, "Simulating it again …");
    try {
      const { identical } = await post(pathOf("samples", id, "/verify"));
      if (this.id !== id) return;
      this.verdict.dataset.identical = String(identical);
      say(this.verdict, identical ? "Identical: simulated again, bit for bit the same." : "Not identical: simulated again, it came out differently.");
    } catch (error) {
      say(this.verdict, "");
      complain(error);
    } finally {
      this.verify.disabled = false;
    }
  }
}

/** @param {HTMLElement} list @param {[name: string, value: any, summary?: string][]} entries */
function fill(list, entries) {
  list.replaceChildren(...entries.map(([name, value, summary]) => h("div", {}, h("dt", { title: summary ?? "" }, name), h("dd", { title: String(value) }, value))));
}
