// The trace of a chain: one quantity over its iterations.
import uPlot from "../vendor/uplot.js";
import { pathOf, request } from "./api.js";
import { meaningOf } from "./catalog.js";
import { h } from "./dom.js";
import { complain, senseless } from "./notice.js";
import { color, onTheme } from "./theme.js";
import { onPlace, place, settle } from "./url_state.js";
import { number, quantity, spaced } from "./words.js";

const REFRESH = 2000; // [ms] while the chain runs
const HEIGHT = 220;

export class TracePlot {
  constructor() {
    this.chain = h("select", { "aria-label": "Chain", onchange: () => settle({ chain: this.chain.value }) });
    this.quantity = h("select", { "aria-label": "Quantity", onchange: () => settle({ quantity: this.quantity.value }) });
    this.box = h("div.plot");
    this.empty = h("p.dim", { hidden: true }, "The trace appears with the first iterations.");
    this.element = h("section.trace", { hidden: true }, h("div.section-head", {}, h("h2", {}, "Trace"), this.quantity, this.chain), this.box, this.empty);
    this.width = new ResizeObserver(() => this.plot?.setSize(this.#size()));
    this.width.observe(this.box);
    this.endings = [onTheme(() => this.#redraw()), onPlace((now, before) => {
      if (now.chain !== before.chain) this.#load();
      else if (now.quantity !== before.quantity) this.#redraw();
    })];
  }

  /** @param {import("./types.js").Chain[]} chains */
  show(chains) {
    this.chains = chains;
    this.element.hidden = !chains.length;
    if (!chains.length) return;
    if (place().chain && this.#chosen().id !== place().chain) {
      senseless("chain", place().chain);
      return settle({ chain: "" });
    }
    options(this.chain, chains.map((chain) => [chain.id, `chain ${chain.index + 1}`]), this.#chosen().id);
    if (this.shown !== this.#chosen().id) this.#load();
    else if (this.#chosen().iteration !== this.iteration) this.#later();
  }

  close() {
    this.closed = true;
    clearTimeout(this.timer);
    this.width.disconnect();
    for (const end of this.endings) end();
    this.plot?.destroy();
  }

  #chosen() {
    return this.chains.find((chain) => chain.id === place().chain) ?? this.chains[0];
  }

  #later() {
    this.timer ??= setTimeout(() => {
      this.timer = null;
      if (!this.closed && this.element.offsetParent) this.#load();
    }, REFRESH);
  }

  async #load() {
    const chain = this.#chosen();
    if (!chain) return;
    this.shown = chain.id;
    this.iteration = chain.iteration;
    try {
      const [trace, { measures }] = await Promise.all([request(`${pathOf("chains", chain.id)}/trace?points=1000`), meaningOf(chain.scenario)]);
      if (this.closed || this.shown !== chain.id) return;
      this.trace = withTarget(trace);
      this.units = new Map(measures.map(({ name, unit }) => [name, unit]));
      this.#redraw();
    } catch (error) {
      complain(error);
    }
  }

  #size() {
    return { width: Math.max(200, this.box.clientWidth), height: HEIGHT };
  }

  #redraw() {
    if (!this.trace || this.closed) return;
    const names = Object.keys(this.trace).filter((name) => name !== "iteration" && name !== "satisfied" && isPlotted(this.trace[name]));
    if (names.length && place().quantity && !names.includes(place().quantity)) {
      senseless("quantity", place().quantity);
      return settle({ quantity: "" });
    }
    const usual = names.includes("log_constraint") ? "log_constraint" : names[0];
    const name = names.includes(place().quantity) ? place().quantity : usual;
    options(this.quantity, names.map((each) => [each, spaced(each)]), name);
    this.empty.hidden = this.trace.iteration.length > 0;
    this.box.hidden = !this.empty.hidden;
    if (this.box.hidden || !name) return;
    const satisfied = this.trace.satisfied ?? [];
    const values = this.trace[name];
    const data = [this.trace.iteration, values, values.map((value, at) => (satisfied[at] ? value : null))];
    const look = `${name} ${document.documentElement.dataset.theme}`;
    if (this.look === look) return void this.plot.setData(data);
    this.look = look;
    this.plot?.destroy();
    this.plot = new uPlot(drawing(name, this.units.get(name), this.#size()), data, this.box);
  }
}

/** With the logarithm of what a walk's steps are weighed by, the paper's log p(A). @param {object} trace */
function withTarget(trace) {
  const { iteration, log_prior, log_constraint, ...rest } = trace;
  return { iteration, log_prior, log_constraint, log_target: log_prior.map((value, at) => (value === null || log_constraint[at] === null ? null : value + log_constraint[at])), ...rest };
}

/** Numbers alone make a curve, with gaps where there is none. */
function isPlotted(values) {
  return Array.isArray(values) && values.every((value) => value === null || typeof value === "number");
}

function drawing(name, unit, size) {
  const axis = { stroke: color("--ink-2"), grid: { stroke: color("--line"), width: 1 }, ticks: { stroke: color("--line"), width: 1 }, font: "12px Inter, system-ui, sans-serif" };
  return {
    ...size,
    scales: { x: { time: false } },
    legend: { live: true },
    cursor: { points: { size: 6 } },
    axes: [{ ...axis }, { ...axis, size: 64, values: (_, ticks) => ticks.map((tick) => number(tick)) }],
    series: [
      { label: "iteration" },
      { label: spaced(name), stroke: color("--line-strong"), width: 1, points: { show: false }, value: (_, value) => quantity(value, unit) },
      { label: "satisfied", stroke: color("--accent"), width: 0, paths: () => null, points: { show: true, size: 4, fill: color("--accent"), stroke: color("--accent") }, value: (_, value) => (value === null ? "–" : "yes") },
    ],
  };
}

/** Gives a select its options, touching it only when they differ. */
function options(select, entries, chosen) {
  const key = JSON.stringify(entries);
  if (select.dataset.key !== key) {
    select.dataset.key = key;
    select.replaceChildren(...entries.map(([value, words]) => h("option", { value }, words)));
  }
  select.value = chosen;
}
