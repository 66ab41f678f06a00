// The list of scenarios at the side.
import { allScenarios, hasMoreScenarios, loadScenarios, onCatalog, worldOf } from "./catalog.js";
import { arrange, h, onPlainClick, say } from "./dom.js";
import { rarityOf, triesOf } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { isChosen, isFull, MOST, seriesOf, toggled } from "./together.js";
import { address, go, onPlace, place } from "./url_state.js";
import { count } from "./words.js";

/** Parameters of the address that belong to one scenario and end with it. */
export const ELSEWHERE = { together: "", takes: "", sample: "", t: "", camera: "", chain: "", quantity: "", quantities: "worst", start: "", create: "" };

const CLEAR = 12; // [px] between what is brought into view and the edge

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
  let seen = null;
  const show = () => {
    const scenarios = allScenarios();
    choose.setAttribute("aria-pressed", String(place().choose === "on"));
    const inSeries = Map.groupBy(scenarios, ({ world, title }) => (seriesOf(title) ? `${world} ${seriesOf(title)}` : ""));
    arrange(list, scenarios.flatMap((scenario) => {
      const mates = inSeries.get(`${scenario.world} ${seriesOf(scenario.title)}`) ?? [];
      if (mates.length < 2 || mates.length > MOST) return [rowOf(scenario)];
      const leads = mates[0] === scenario ? [seriesRow(mates)] : [];
      return isUnfolded(mates) ? [...leads, rowOf(scenario, true)] : leads;
    }));
    for (const id of rows.keys()) if (!scenarios.some((scenario) => scenario.id === id)) rows.delete(id);
    more.hidden = !hasMoreScenarios();
    const open = list.querySelector('[aria-current="page"]');
    if (open && open !== seen) bringIntoView(open, list);
    seen = open;
  };
  onCatalog(show);
  onPlace(show);
}

/** Scrolls what holds the list, and never the page. @param {Element} row @param {Element} list */
function bringIntoView(row, list) {
  for (const box of [list, list.closest("nav")]) {
    const [frame, inside] = [box.getBoundingClientRect(), row.getBoundingClientRect()];
    const past = (low, high, from, to) => (low < from + CLEAR ? low - from - CLEAR : high > to - CLEAR ? Math.min(high - to + CLEAR, low - from - CLEAR) : 0);
    if (box.scrollHeight > box.clientHeight) box.scrollTop += past(inside.top, inside.bottom, frame.top, frame.bottom);
    if (box.scrollWidth > box.clientWidth) box.scrollLeft += past(inside.left, inside.right, frame.left, frame.right);
  }
}

/** A series shows its scenarios one by one while one of them is open, or while they are chosen. */
function isUnfolded(mates) {
  const { choose, together, scenario } = place();
  const shown = together ? together.split(",") : [scenario];
  return choose === "on" || mates.some(({ id }) => shown.includes(id));
}

function rowOf(scenario, isMember = false) {
  let row = rows.get(scenario.id);
  if (!row) {
    row = newRow(scenario.id);
    rows.set(scenario.id, row);
  }
  const { box, link } = row.parts;
  row.classList.toggle("member", isMember);
  box.hidden = place().choose !== "on";
  box.checked = isChosen(scenario.id);
  box.disabled = !box.checked && isFull();
  box.setAttribute("aria-label", `Show “${scenario.title}” together with others`);
  const rare = rarityOf(scenario, triesOf(worldOf(scenario.world)));
  fill(row.parts, {
    title: scenario.title || "Untitled",
    world: scenario.world,
    rarity: rare ? rare.word.toLowerCase() : "",
    samples: animations(scenario.samples),
    running: running(scenario.chains?.running),
  });
  row.parts.rarity.title = rare?.odds ?? "";
  link.setAttribute("aria-current", !place().together && place().scenario === scenario.id ? "page" : "false");
  link.href = address({ scenario: scenario.id, ...ELSEWHERE });
  return row;
}

function newRow(id) {
  const parts = newParts(() => go({ scenario: id, ...ELSEWHERE }));
  const box = h("input.pick", { type: "checkbox", hidden: true, onchange: () => go({ ...ELSEWHERE, ...toggled(id) }) });
  const row = h("li", {}, box, parts.link);
  row.dataset.scenario = id;
  row.parts = { ...parts, box };
  return row;
}

/** What every entry says. @param {() => void} open */
function newParts(open) {
  const parts = {
    title: h("span.scenario-title"),
    world: h("span.tag"),
    rarity: h("span.rarity"),
    samples: h("span.scenario-count"),
    running: h("span.running"),
  };
  const { title, ...facts } = parts;
  return { ...parts, link: h("a.scenario-link", { onclick: onPlainClick(open) }, title, h("span.scenario-facts", {}, ...Object.values(facts))) };
}

/** @param {Object<string, Element>} parts @param {Object<string, string>} words by part; an empty one is not there */
function fill(parts, words) {
  for (const [name, text] of Object.entries(words)) {
    say(parts[name], text);
    parts[name].hidden = !text;
  }
}

const animations = (samples) => `${count(samples)} ${samples === 1 ? "animation" : "animations"}`;
const running = (chains) => (chains ? `${chains} running` : "");

/** One entry for a whole series, which is shown together. @param {import("./types.js").Scenario[]} mates */
function seriesRow(mates) {
  const name = seriesOf(mates[0].title);
  const ids = [...mates].sort((a, b) => a.title.localeCompare(b.title, "en", { numeric: true })).map(({ id }) => id).join(",");
  const key = `${mates[0].world} ${name}`;
  if (!series.has(key)) {
    const parts = newParts(() => go({ ...ELSEWHERE, together: series.get(key).dataset.ids }));
    const row = h("li.series", {}, parts.link);
    row.parts = parts;
    parts.title.before(icon("together"));
    series.set(key, row);
  }
  const row = series.get(key);
  row.dataset.ids = ids;
  const sum = (of) => mates.reduce((total, mate) => total + of(mate), 0);
  fill(row.parts, {
    title: name,
    world: mates[0].world,
    rarity: `${mates.length} together`,
    samples: animations(sum(({ samples }) => samples)),
    running: running(sum(({ chains }) => chains?.running ?? 0)),
  });
  row.parts.link.href = address({ ...ELSEWHERE, together: ids });
  row.parts.link.setAttribute("aria-current", place().together === ids ? "page" : "false");
  return row;
}
