// The open scenario: its wish, its tabs, and what to do with it.
import { deleteScenario, isMissing, isReady, onCatalog, openChains, openScenario, startChains, worldOf } from "./catalog.js";
import { FirstScreen } from "./first_screen.js";
import { Gallery } from "./gallery.js";
import { ChainPanel } from "./chain_panel.js";
import { h, say } from "./dom.js";
import { rarityOf, triesOf } from "./health_words.js";
import { complain } from "./notice.js";
import { ELSEWHERE } from "./scenario_list.js";
import { Together } from "./together.js";
import { go, onPlace, place, settle } from "./url_state.js";
import { count, documentText, pace, wish } from "./words.js";

const MORE = 50;

export function startScenarioView() {
  const host = document.getElementById("scenario");
  let open = null;
  const put = (view) => {
    open?.close();
    open = view;
    host.replaceChildren(view ? view.element : "");
  };
  const show = () => {
    const { scenario: wanted, together } = place();
    const scenario = openScenario();
    if (together) {
      if (!isReady()) return;
      if (!(open instanceof Together)) put(new Together());
    } else if (!wanted) {
      if (!(open instanceof FirstScreen)) put(new FirstScreen());
    } else if (scenario) {
      if (open?.id !== wanted) put(new ScenarioView(scenario));
    } else if (open) {
      put(null);
    }
    if (open) open.show(scenario);
    else host.replaceChildren(isMissing(wanted) ? nothing() : "");
  };
  onCatalog(show);
  onPlace(show);
  show();
}

function nothing() {
  document.title = "Retake";
  return h("div.empty", {}, h("h1", {}, "This scenario is not here"), h("p", {}, "It may have been deleted, or the address is not right. Pick one from the list, or wish for something new."), h("button.primary", { type: "button", onclick: () => go({ scenario: "", ...ELSEWHERE, create: "any" }) }, "New scenario"));
}

class ScenarioView {
  /** @param {import("./types.js").Scenario} scenario */
  constructor(scenario) {
    this.id = scenario.id;
    this.gallery = new Gallery(scenario.id);
    this.chains = new ChainPanel(scenario);
    this.tabs = { animations: tab("animations", "Animations"), chains: tab("chains", "Chains") };
    this.panels = { animations: this.gallery.element, chains: this.chains.element };
    for (const [name, panel] of Object.entries(this.panels)) {
      panel.id = `panel-${name}`;
      panel.setAttribute("role", "tabpanel");
      panel.setAttribute("aria-labelledby", `tab-${name}`);
    }
    this.rarity = h("p.rarity-line");
    this.pace = h("span.pace", { "aria-live": "off" });
    this.more = h("button.primary", { type: "button", onclick: () => this.#findMore() }, `Find ${MORE} more`);
    this.remove = h("button.quiet.danger", { type: "button", onclick: () => this.#remove() }, "Delete scenario");
    const { id, world, world_version, title, model, constraints } = scenario;
    this.element = h(
      "article",
      {},
      h(
        "header.wish",
        {},
        h("div.wish-words", {}, h("h1", {}, scenario.title || "Untitled"), h("p.sentence", {}, wish(scenario)), this.rarity),
        h("div.wish-act", {}, this.pace, this.more),
      ),
      h(
        "details.document",
        {},
        h("summary", {}, "The scenario as it was asked for"),
        h("pre", { tabIndex: 0 }, documentText({ world, title, model, constraints, id, world_version })),
        this.remove,
      ),
      h("div.tabs", { role: "tablist", "aria-label": "What to see", onkeydown: (event) => this.#turn(event) }, ...Object.values(this.tabs)),
      ...Object.values(this.panels),
    );
  }

  /** @param {import("./types.js").Scenario} scenario */
  show(scenario) {
    document.title = `${scenario.title || "Untitled"} – Retake`;
    const chains = openChains();
    const running = chains.filter((chain) => chain.state === "running");
    say(this.tabs.animations.lastChild, count(scenario.samples));
    say(this.tabs.chains.lastChild, count(Object.values(scenario.chains ?? {}).reduce((sum, each) => sum + each, 0)));
    this.#showRarity(scenario);
    const tries = running.reduce((sum, chain) => sum + (chain.iterations_per_second ?? 0), 0);
    say(this.pace, running.length ? `${running.length} ${running.length === 1 ? "chain" : "chains"} searching · ${pace(tries)} tries a second` : "");
    this.pace.hidden = !running.length;
    const active = this.panels[place().tab] ? place().tab : "animations";
    for (const name of Object.keys(this.panels)) {
      this.panels[name].hidden = name !== active;
      this.tabs[name].setAttribute("aria-selected", String(name === active));
      this.tabs[name].tabIndex = name === active ? 0 : -1;
    }
    if (active === "animations") this.gallery.show(scenario);
    else this.chains.show(scenario, chains);
  }

  close() {
    this.gallery.close();
    this.chains.close();
  }

  #showRarity(scenario) {
    const rarity = rarityOf(scenario, triesOf(worldOf(scenario.world)));
    const text = rarity ? `${rarity.word}: ${rarity.odds}` : "";
    if (this.rarity.textContent !== text) this.rarity.replaceChildren(...(rarity ? [h("strong", {}, rarity.word), `: ${rarity.odds}`] : []));
  }

  #turn(event) {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    const next = place().tab === "chains" ? "animations" : "chains";
    go({ tab: next });
    this.tabs[next].focus();
  }

  async #findMore() {
    this.more.disabled = true;
    await startChains(this.id, { stop: { samples: MORE } }).catch(complain);
    this.more.disabled = false;
  }

  async #remove() {
    if (!this.remove.dataset.sure) {
      this.remove.dataset.sure = "yes";
      say(this.remove, "Delete it with all its animations?");
      this.remove.addEventListener("blur", () => {
        delete this.remove.dataset.sure;
        say(this.remove, "Delete scenario");
      }, { once: true });
      return;
    }
    await deleteScenario(this.id).then(() => settle({ scenario: "", ...ELSEWHERE }), complain);
  }
}

function tab(name, words) {
  return h("button.tab", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `panel-${name}`, onclick: () => go({ tab: name }) }, `${words} `, h("span.number", {}, ""));
}
