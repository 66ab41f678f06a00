// The list of scenarios at the side.
import { allScenarios, hasMoreScenarios, loadScenarios, onCatalog, openScenario } from "./catalog.js";
import { arrange, h, say } from "./dom.js";
import { rarityOf } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { address, go, onPlace } from "./url_state.js";
import { count } from "./words.js";

/** Parameters of the address that belong to one scenario and end with it. */
export const ELSEWHERE = { sample: "", t: "", camera: "", chain: "", quantity: "", quantities: "worst", start: "", create: "" };

const rows = new Map();

export function startScenarioList() {
  const list = document.getElementById("scenario-list");
  const more = document.getElementById("more-scenarios");
  const create = document.getElementById("new-scenario");
  create.prepend(icon("plus"));
  create.addEventListener("click", () => go({ create: "any" }));
  more.addEventListener("click", () => loadScenarios({ more: true }).catch(complain));
  const show = () => {
    const scenarios = allScenarios();
    const open = openScenario()?.id;
    arrange(list, scenarios.map((scenario) => rowOf(scenario, scenario.id === open)));
    for (const id of rows.keys()) if (!scenarios.some((scenario) => scenario.id === id)) rows.delete(id);
    more.hidden = !hasMoreScenarios();
  };
  onCatalog(show);
  onPlace(show);
}

function rowOf(scenario, open) {
  let row = rows.get(scenario.id);
  if (!row) {
    row = newRow(scenario.id);
    rows.set(scenario.id, row);
  }
  const { title, world, samples, rarity, running, link } = row.parts;
  say(title, scenario.title || "Untitled");
  say(world, scenario.world);
  say(samples, `${count(scenario.samples)} ${scenario.samples === 1 ? "animation" : "animations"}`);
  const rare = rarityOf(scenario);
  say(rarity, rare ? rare.word.toLowerCase() : "");
  rarity.title = rare?.odds ?? "";
  rarity.hidden = !rare;
  const active = scenario.chains?.running ?? 0;
  say(running, active ? `${active} running` : "");
  running.hidden = !active;
  link.setAttribute("aria-current", open ? "page" : "false");
  link.href = address({ scenario: scenario.id, ...ELSEWHERE });
  return row;
}

function newRow(id) {
  const parts = {
    title: h("span.scenario-title"),
    world: h("span.tag"),
    samples: h("span.scenario-count"),
    rarity: h("span.rarity"),
    running: h("span.running"),
  };
  const link = h(
    "a.scenario-link",
    {
      onclick(event) {
        if (event.metaKey || event.ctrlKey || event.shiftKey || event.button) return;
        event.preventDefault();
        go({ scenario: id, ...ELSEWHERE });
      },
    },
    parts.title,
    h("span.scenario-facts", {}, parts.world, parts.rarity, parts.samples, parts.running),
  );
  const row = h("li", {}, link);
  row.dataset.scenario = id;
  row.parts = { ...parts, link };
  return row;
}
