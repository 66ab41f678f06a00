// A new scenario: choose a world, edit one of its examples, and see every fault where it is.
import { Problem } from "./api.js";
import { allWorlds, createScenario, startChains } from "./catalog.js";
import { h, onDismiss, say } from "./dom.js";
import { icon } from "./icons.js";
import { placeOf } from "./json_place.js";
import { complain, notice } from "./notice.js";
import { ELSEWHERE } from "./scenario_list.js";
import { leave, onPlace, place, settle } from "./url_state.js";
import { documentText } from "./words.js";

const FIRST_SAMPLES = 50;

export function startScenarioForm() {
  const dialog = document.getElementById("create");
  const form = new ScenarioForm(dialog);
  const show = () => (place().create ? form.open() : form.close());
  onPlace(show);
  show();
}

class ScenarioForm {
  /** @param {HTMLDialogElement} dialog */
  constructor(dialog) {
    this.dialog = dialog;
    this.worlds = h("div.choices", { role: "radiogroup", "aria-label": "World" });
    this.example = h("select", { onchange: () => this.#fill() });
    this.exampleField = h("label.field", {}, h("span", {}, "Begin with"), this.example);
    this.terms = h("ul.terms");
    this.saying = h("input", { type: "text", maxLength: 80, autocomplete: "off", spellcheck: false, oninput: () => this.#say() });
    this.sayingLabel = h("span");
    this.sayingField = h("label.field.saying", { hidden: true }, this.sayingLabel, this.saying);
    this.text = h("textarea", { id: "scenario-text", spellcheck: false, rows: 11, "aria-describedby": "scenario-faults", oninput: () => this.#forgive() });
    this.faults = h("div.faults", { id: "scenario-faults", "aria-live": "polite" });
    this.search = h("input", { type: "checkbox", checked: true });
    this.submit = h("button.primary", { type: "submit" }, "Create");
    dialog.append(
      h(
        "form",
        { onsubmit: (event) => this.#create(event) },
        h("div.sheet-head", {}, h("h2", { id: "create-title" }, "New scenario"), h("button.quiet.square", { type: "button", "aria-label": "Close", onclick: () => leave({ create: "" }) }, icon("close"))),
        this.worlds,
        h("div.sheet-row", {}, this.exampleField, this.terms),
        this.sayingField,
        h("label.field", { for: "scenario-text" }, h("span", {}, "The scenario, as JSON")),
        this.text,
        this.faults,
        h("div.sheet-foot", {}, h("label.check", {}, this.search, `Start a chain that looks for ${FIRST_SAMPLES} animations`), this.submit),
      ),
    );
    onDismiss(dialog, () => leave({ create: "" }));
  }

  async open() {
    const opens = !this.dialog.open;
    if (opens) this.dialog.showModal();
    try {
      this.known ??= await allWorlds();
    } catch (error) {
      return complain(error);
    }
    const wanted = place().create;
    if (!wanted) return;
    const named = this.known.find(({ name }) => name === wanted);
    if (!named && wanted !== "any") {
      notice(`There is no world “${wanted}”.`, "bad");
      settle({ create: "any" });
    }
    const world = named ?? this.known[0];
    if (world && world !== this.world) this.#offer(world);
    if (opens) (this.sayingField.hidden ? this.text : this.saying).focus();
  }

  #offer(world) {
    this.world = world;
    this.worlds.replaceChildren(...this.known.map((each) => this.#choice(each)));
    const examples = world.examples?.length ? world.examples : [{ world: world.name, title: "", model: {}, constraints: [] }];
    this.examples = examples;
    this.example.replaceChildren(...examples.map((example, at) => h("option", { value: at }, example.title || `Example ${at + 1}`)));
    this.exampleField.hidden = examples.length < 2;
    this.terms.replaceChildren(...(world.constraints ?? []).map(({ kind, summary }) => h("li", {}, h("code", {}, kind), ` ${summary ?? ""}`)));
    this.#fill();
  }

  close() {
    if (this.dialog.open) this.dialog.close();
  }

  #choice(world) {
    const input = h("input", { type: "radio", name: "world", value: world.name, checked: world === this.world, onchange: () => settle({ create: world.name }) });
    return h("label.choice", {}, input, h("span", {}, h("strong", {}, world.name), h("span.dim", {}, world.summary)));
  }

  #fill() {
    const example = this.examples[Number(this.example.value) || 0];
    this.text.value = documentText(example);
    this.text.setSelectionRange(0, 0);
    const worded = wordedOf(example);
    this.saying.value = worded?.text ?? "";
    this.sayingField.hidden = !worded;
    // What its kind says of itself, up to the details.
    say(this.sayingLabel, this.world.constraints.find(({ kind }) => kind === worded?.kind)?.summary.split(":")[0] ?? "");
    this.#forgive();
  }

  /** Writes the words into the example, for whose world they leave it to find a model with room for them. */
  #say() {
    const example = this.examples[Number(this.example.value) || 0];
    const text = this.saying.value.toUpperCase();
    const constraints = example.constraints.map((term) => (typeof term.text === "string" ? { ...term, text } : term));
    this.text.value = documentText({ ...example, title: (example.title ?? "").replace(wordedOf(example).text, () => text), model: {}, constraints });
    this.#forgive();
  }

  #forgive() {
    this.faults.replaceChildren();
    this.text.removeAttribute("aria-invalid");
  }

  async #create(event) {
    event.preventDefault();
    this.submit.disabled = true;
    this.#forgive();
    try {
      const scenario = await createScenario(this.text.value);
      if (this.search.checked && !scenario.samples && !scenario.chains?.running) {
        await startChains(scenario.id, { stop: { samples: FIRST_SAMPLES } }).catch(complain);
      }
      // In the place of the form, which the way back should not meet again.
      settle({ ...ELSEWHERE, scenario: scenario.id, tab: "animations" });
    } catch (error) {
      if (!(error instanceof Problem)) throw error;
      this.#show(error);
    } finally {
      this.submit.disabled = false;
    }
  }

  /** @param {Problem} problem */
  #show(problem) {
    this.text.setAttribute("aria-invalid", "true");
    const list = problem.errors.map((fault) => {
      const go = h("button.fault-place", { type: "button", onclick: () => this.#select(fault.pointer) });
      // A long pointer is broken between its parts.
      go.append(h("span", {}, ...(fault.pointer || "document").split(/(?=\/)/).flatMap((part) => [h("wbr"), part])));
      return h("li", {}, go, h("span", {}, fault.detail));
    });
    const heading = list.length ? problem.title || problem.detail : problem.message;
    this.faults.replaceChildren(h("p", {}, heading), h("ul", {}, ...list));
    this.faults.scrollIntoView({ block: "nearest" });
  }

  #select(pointer) {
    const range = placeOf(this.text.value, pointer);
    this.text.focus();
    if (!range) return;
    this.text.setSelectionRange(...range);
    const line = this.text.value.slice(0, range[0]).split("\n").length;
    const height = this.text.scrollHeight / this.text.value.split("\n").length;
    this.text.scrollTop = Math.max(0, (line - 4) * height);
  }
}

/** The wish of a scenario that has words in it; undefined if none has. @param {{constraints: object[]}} scenario */
function wordedOf({ constraints }) {
  return constraints.find(({ text }) => typeof text === "string");
}
