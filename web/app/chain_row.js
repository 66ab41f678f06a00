// One chain in the table: how far it is, and the buttons that hold it, let it go on and end it.
import { tellChain } from "./catalog.js";
import { h, say } from "./dom.js";
import { phaseInWords } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { count, pace, percent, seconds, spaced } from "./words.js";

const isGoing = ({ state }) => state === "running" || state === "queued";

export class ChainRow {
  /** @param {string} id */
  constructor(id) {
    const cell = (label) => h("td", { "data-label": label });
    this.name = h("th", { scope: "row" });
    this.state = h("span.state");
    this.phase = h("p.phase");
    this.error = h("p.error", { hidden: true });
    this.iteration = cell("Iterations");
    this.pace = cell("per s");
    this.accepted = cell("Accepted");
    this.samples = cell("Animations");
    this.independent = cell("Independent");
    this.independent.title = "As this chain judges itself, which claims too much";
    this.first = cell("First after");
    const button = (what, words, sign) =>
      h("button.quiet.square", { type: "button", title: words, "aria-label": words, onclick: () => this.#tell(id, what) }, icon(sign));
    this.pause = button("pause", "Pause", "pause");
    this.resume = button("resume", "Resume", "play");
    this.stop = button("stop", "Stop", "stop");
    this.element = h(
      "tr",
      {},
      this.name,
      h("td", { "data-label": "State" }, this.state, this.phase, this.error),
      this.iteration,
      this.pace,
      this.accepted,
      this.samples,
      this.independent,
      this.first,
      h("td.controls", {}, this.pause, this.resume, this.stop),
    );
    this.element.dataset.chain = id;
  }

  /** @param {import("./types.js").Chain} chain */
  show(chain) {
    say(this.name, `${chain.index + 1}`);
    this.name.append(h("span.dim", {}, ` ${chain.method}, seed ${chain.seed}${chain.ratios === "paper" ? ", the paper’s ratios" : ""}${chain.lesson ? `, from lesson ${chain.lesson}` : ""}`));
    say(this.state, chain.state);
    this.state.dataset.state = chain.state;
    this.phase.hidden = !isGoing(chain) && chain.state !== "paused";
    say(this.phase, phaseInWords(chain));
    this.error.hidden = !chain.error;
    say(this.error, chain.error ?? "");
    say(this.iteration, count(chain.iteration));
    say(this.pace, chain.state === "running" ? pace(chain.iterations_per_second) : "–");
    say(this.accepted, percent(chain.accepted, chain.iteration));
    this.accepted.title = (chain.kernels ?? []).map((kernel) => `${spaced(kernel.name)}: ${percent(kernel.accepted, kernel.proposed)} of ${count(kernel.proposed)}`).join("\n");
    say(this.samples, count(chain.samples));
    this.samples.title = chain.counted < chain.samples ? `${count(chain.counted)} of them count, the others were found while it was learning` : "";
    say(this.independent, typeof chain.effective_samples === "number" ? count(chain.effective_samples) : "–");
    say(this.first, chain.first_sample ? seconds(chain.first_sample.seconds) : "–");
    const going = isGoing(chain);
    this.pause.hidden = !going;
    this.resume.hidden = chain.state !== "paused";
    this.stop.hidden = !going && chain.state !== "paused";
  }

  async #tell(id, what) {
    await tellChain(id, what).catch(complain);
    // The pressed button may be gone; the keyboard stays in its row.
    const next = [this.pause, this.resume, this.stop].find((button) => !button.hidden);
    if (!this.element.contains(document.activeElement) || document.activeElement.hidden) next?.focus();
  }
}
