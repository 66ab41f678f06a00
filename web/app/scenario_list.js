// The list of scenarios at the side.
import { allScenarios, hasMoreScenarios, loadScenarios, onCatalog, openScenario } from "./catalog.js";
import { arrange, h, say } from "./dom.js";
import { rarityOf } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { isChosen, isFull, MOST, seriesOf, toggled } from "./together.js";
import { address, go, onPlace, place } from "./url_state.js";
import { count } from "./words.js";

/** Parameters of the address that belong to one scenario and end with it. */
export const ELSEWHERE = { together: "", takes: "", sample: "", t: "", camera: "", chain: "", quantity: "", quantities: "worst", start: "", create: "" };

const rows = new Map();
const series = new Map();

export function startScenarioList() {
  const list = document.getElementById("scenario-list");
  const more = document.getElementById("more-scenarios");
  const choose = document.getElementById("choose-scenarios");
  const create = document.getElementById("new-scenario");
  create.prepend(icon("plus"));
  choose.append(icon("together"));
  create.addEventListener("click", () => go({ create: "any" }));
  choose.addEventListener("click", () => go({ choose: place().choose === "on" ? "" : "on" }));
  more.addEventListener("click", () => loadScenarios({ more: true }).catch(complain));
  const show = () => {
    const scenarios = allScenarios();
    const open = place().together ? "" : openScenario()?.id;
    choose.setAttribute("aria-pressed", String(place().choose === "on"));
    const inSeries = Map.groupBy(scenarios, ({ world, title }) => (seriesOf(title) ? `${world} ${seriesOf(title)}` : ""));
    arrange(list, scenarios.flatMap((scenario) => {
      const mates = inSeries.get(`${scenario.world} ${seriesOf(scenario.title)}`) ?? [];
      const leads = mates[0] === scenario && mates.length > 1 && mates.length <= MOST;
      return [...(leads ? [seriesRow(mates)] : []), rowOf(scenario, scenario.id === open)];
    }));
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
  const { title, world, samples, rarity, running, link, box } = row.parts;
  box.hidden = place().choose !== "on";
  box.checked = isChosen(scenario.id);
  box.disabled = !box.checked && isFull();
  box.setAttribute("aria-label", `Show “${scenario.title}” together with others`);
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
  const box = h("input.pick", { type: "checkbox", hidden: true, onchange: () => go({ ...ELSEWHERE, ...toggled(id) }) });
  const row = h("li", {}, box, link);
  row.dataset.scenario = id;
  row.parts = { ...parts, link, box };
  return row;
}

/** One click that shows a whole series together. @param {import("./types.js").Scenario[]} mates */
function seriesRow(mates) {
  const name = seriesOf(mates[0].title);
  const ids = [...mates].sort((a, b) => a.title.localeCompare(b.title, "en", { numeric: true })).map(({ id }) => id);
  const key = `${mates[0].world} ${name}`;
  if (!series.has(key)) {
    const link = h("a.series-link", {
      onclick(event) {
        if (event.metaKey || event.ctrlKey || event.shiftKey || event.button) return;
        event.preventDefault();
        go({ ...ELSEWHERE, together: link.dataset.ids });
      },
    }, icon("together"), h("span"));
    series.set(key, h("li.series", {}, link));
  }
  const row = series.get(key);
  const link = row.firstChild;
  link.dataset.ids = ids.join(",");
  link.href = address({ ...ELSEWHERE, together: link.dataset.ids });
  link.setAttribute("aria-current", place().together === link.dataset.ids ? "page" : "false");
  say(link.lastChild, `${name}: all ${mates.length} together`);
  return row;
}
