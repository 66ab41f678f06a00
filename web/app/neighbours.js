// What comes before and after an animation in the gallery that the address names, whether its tile is there or not.
import { pathOf, request } from "./api.js";

const PAGE = 500; // the most that the server gives at once

/** The ids of a gallery in its order, as far as they were asked for. */
class Line {
  #ids = [];
  #cursor = "";
  #asking = null;

  /** @param {string} scenario @param {string} order */
  constructor(scenario, order) {
    this.scenario = scenario;
    this.order = order;
  }

  has(id) {
    return this.#ids.includes(id);
  }

  /** What stands before and after `id`; neither if it is not in the line. @returns {Promise<(string|undefined)[]>} */
  async beside(id) {
    while (this.#cursor !== null && (!this.has(id) || this.#ids.at(-1) === id)) {
      this.#asking ??= this.#ask().finally(() => (this.#asking = null));
      await this.#asking;
    }
    return beside(this.#ids, id);
  }

  async #ask() {
    const query = new URLSearchParams({ limit: String(PAGE), order: this.order });
    if (this.#cursor) query.set("cursor", this.#cursor);
    const page = await request(`${pathOf("scenarios", this.scenario, "/samples")}?${query}`);
    this.#ids.push(...page.samples.map(({ id }) => id));
    this.#cursor = page.next_cursor ?? null;
  }
}

let line = new Line("", "");

function beside(ids, id) {
  const at = ids.indexOf(id);
  return at < 0 ? [] : [ids[at - 1], ids[at + 1]];
}

/** The samples before and after the one that is open; undefined at an end. @param {import("./url_state.js").Place} place */
export async function neighboursOf({ scenario, together, takes, order, sample }) {
  if (together) return beside(takes.split(",").filter(Boolean), sample);
  if (!scenario) return [];
  // Asked for anew where it lacks the sample: what is found meanwhile stands before all others.
  if (line.scenario !== scenario || line.order !== order || !line.has(sample)) line = new Line(scenario, order);
  return line.beside(sample);
}
