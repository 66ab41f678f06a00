// The large view of one sample. Where it stands, how fast it plays and from where it is seen is in the address.
import { captionsOf } from "./captions.js";
import { meaningOf } from "./catalog.js";
import { h, onDismiss, say } from "./dom.js";
import { Facts } from "./facts.js";
import { Legend } from "./legend.js";
import { icon } from "./icons.js";
import { on } from "./live.js";
import { neighboursOf } from "./neighbours.js";
import { complain, notice, senseless } from "./notice.js";
import { Orbit } from "./orbit.js";
import { stage, View } from "./stage.js";
import { takeOf } from "./takes.js";
import { Transport } from "./transport.js";
import { leave, onPlace, place, settle } from "./url_state.js";
import { capital } from "./words.js";

const HOLD = 0.8; // [s] at the end before it plays again
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** The place without an animation in the large view. */
const NOTHING = { sample: "", t: "", camera: "" };

/** The tile of a sample in the gallery behind. @param {string} id @returns {HTMLElement|null} */
const tileOf = (id) => document.querySelector(`#scenario .tile[data-sample="${CSS.escape(id)}"]`);

export function startPlayer() {
  const player = new Player(document.getElementById("player"));
  const show = () => player.show();
  onPlace(show);
  show();
}

class Player {
  /** @param {HTMLDialogElement} dialog */
  constructor(dialog) {
    this.dialog = dialog;
    this.id = "";
    this.time = 0;
    this.playing = false;
    this.facts = new Facts();
    this.title = h("h2");
    this.more = h("p.player-more.dim");
    this.message = h("p.shot-note");
    this.legend = new Legend();
    this.picture = h("div.picture", { tabIndex: 0, role: "img", "aria-label": "The animation. Drag to turn, wheel to come closer." }, this.message, this.legend.element);
    this.view = new View(this.picture);
    this.orbit = new Orbit(this.view, () => settle({ camera: this.orbit.text }));
    this.transport = new Transport({
      toggle: () => this.#toggle(),
      seek: (time) => this.#seek(time),
      settled: () => this.#settle(),
      speed: (speed) => settle({ speed }),
      loop: () => settle({ loop: place().loop === "on" ? "off" : "on" }),
      path: () => settle({ path: place().path === "on" ? "off" : "on" }),
      reset: () => this.orbit.reset(),
      color: (name) => settle({ color: name }),
    });
    const button = (words, sign, act) => h("button.quiet.square", { type: "button", "aria-label": words, title: words, onclick: act }, icon(sign));
    this.previous = button("Previous animation (J)", "previous", () => this.#neighbour(-1));
    this.next = button("Next animation (K)", "next", () => this.#neighbour(1));
    this.close = button("Close (Esc)", "close", () => this.#leave());
    dialog.append(
      h("div.stage-place"),
      h("div.player-main", {}, this.picture, this.transport.element),
      h("aside.player-side", { "aria-label": "Facts" }, h("div.player-head", {}, this.title, this.previous, this.next, this.close), this.more, this.facts.element),
    );
    onDismiss(dialog, () => this.#leave());
    dialog.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("resize", () => (this.view.stale = true));
    on("resync", () => {
      if (!this.id || this.take || !stage.works) return;
      this.id = "";
      this.show();
    });
  }

  /** Follows the address. */
  show() {
    const { sample, speed, loop, path, t, camera, color } = place();
    if (sample !== this.id) this.#change(sample);
    if (!sample) return;
    this.transport.showChosen({ speed, loop: loop === "on", path: path === "on", color });
    this.view.shown = { path: path === "on", contacts: true, color };
    this.legend.show(this.take?.ground?.legend(color) ?? null);
    this.orbit.text = camera;
    this.view.stale = true;
    stage.request();
    if (t !== "" && Number(t) !== Number(this.time.toFixed(3))) {
      this.playing = false;
      this.#at(Number(t));
    } else if (t === "" && !this.playing && this.take && !this.waits) {
      this.#play();
    }
    this.transport.showPlaying(this.playing);
  }

  async #change(id) {
    const was = this.id;
    this.id = id;
    this.take = null;
    this.view.take = null;
    this.playing = false;
    if (!id) return this.#shut(was);
    this.time = Number(place().t);
    if (!this.dialog.open) this.dialog.showModal();
    if (!was) {
      this.opened = id;
      stage.add(this.view);
      stage.enter(this.dialog, false);
      this.picture.focus();
    }
    this.#findNeighbours();
    const { scenario, together } = place();
    this.captions = scenario && !together ? captionsOf(scenario) : null;
    this.#caption();
    this.picture.classList.remove("drawn");
    this.transport.element.inert = true;
    say(this.message, stage.works ? "" : "No 3D graphics in this browser (WebGL 2 is missing).");
    try {
      await Promise.all([this.facts.show(id).then((sample) => this.#follow(sample)), stage.works && this.#loadTake(id)]);
    } catch (error) {
      if (this.id !== id) return;
      if (error.status === 404) return this.#miss(id);
      say(this.message, "This animation is not available.");
      complain(error);
    }
  }

  /** Says that there is no such animation, and leaves the reader what lies behind it. */
  #miss(id) {
    settle(NOTHING);
    notice(`There is no animation “${id}”; it may have been deleted.`, "bad");
  }

  /** An animation is shown over the gallery of its own scenario, whatever the address said. */
  #follow(sample) {
    if (this.id !== sample?.id) return;
    this.#listen(sample);
    const { scenario, together } = place();
    if (sample.scenario === scenario || together.split(",").includes(sample.scenario)) return;
    if (scenario || together) notice("This animation belongs to another scenario than the address said. That one is open now.");
    settle({ scenario: sample.scenario, together: "", takes: "" });
    this.#findNeighbours();
  }

  async #loadTake(id) {
    const take = await takeOf(id);
    if (this.id !== id) return;
    this.take = take;
    this.view.take = take;
    this.picture.classList.add("drawn");
    this.facts.note(take.notes);
    this.transport.element.inert = false;
    this.transport.showTake(take);
    this.#checkColor();
    this.#caption();
    this.#at(Math.min(this.time, take.duration));
    this.waits = calm.matches;
    this.show();
  }

  /** Its caption is the gallery's, which may learn more of what tells animations apart. */
  #listen(sample) {
    this.deaf?.();
    this.captions = captionsOf(sample.scenario);
    this.captions.admit([sample]);
    this.deaf = this.captions.onChange(() => this.#caption());
    meaningOf(sample.scenario).then(({ measures }) => this.captions.mean(measures), complain);
    this.#caption();
  }

  #caption() {
    if (this.take) this.captions?.witness(this.id, this.take.story, this.take.rate);
    const { gist, more } = this.captions?.of(this.id) ?? { gist: "", more: "" };
    say(this.title, gist ? capital(gist) : "Animation");
    say(this.more, more);
    this.more.hidden = !more;
  }

  #shut(was) {
    stage.remove(this.view);
    stage.enter(document.body, true);
    if (this.dialog.open) this.dialog.close();
    // The gallery is where it was, unless another animation than the one that was opened there is to be in view.
    if (was === this.opened) return;
    const tile = tileOf(was);
    if (!tile) return;
    const reveal = () => this.dialog.open || tile.scrollIntoView({ block: "nearest" });
    reveal();
    tile.querySelector("a").focus({ preventScroll: true });
    // Once more where a step back has put the page to where it was, which browsers do with one of the next frames.
    requestAnimationFrame(() => requestAnimationFrame(reveal));
  }

  #leave() {
    leave(NOTHING);
  }

  #at(time) {
    this.time = Math.max(0, this.take ? Math.min(time, this.take.duration) : time);
    this.view.time = this.time;
    this.view.stale = true;
    if (this.take) this.transport.showTime(this.time);
    stage.request();
  }

  #play() {
    this.playing = true;
    this.transport.showPlaying(true);
    let last = performance.now();
    const run = (this.run = Symbol("run"));
    let held = 0;
    stage.run((now) => {
      if (!this.playing || !this.take || this.run !== run) return false;
      const passed = Math.min(Math.max(0, (now - last) / 1000), 0.25);
      last = now;
      const time = this.time + passed * (Number(place().speed) || 1);
      if (time < this.take.duration) {
        this.#at(time);
        return true;
      }
      this.#at(this.take.duration);
      held += passed;
      if (place().loop !== "on") {
        this.#settle();
        return false;
      }
      if (held >= HOLD) {
        held = 0;
        this.#at(0);
      }
      return true;
    });
  }

  #toggle() {
    if (!this.take) return;
    this.waits = false;
    if (this.playing) return this.#settle();
    if (this.time >= this.take.duration) this.#at(0);
    settle({ t: "" });
    if (!this.playing) this.#play();
  }

  #seek(time) {
    this.playing = false;
    this.transport.showPlaying(false);
    this.#at(time);
  }

  /** Stands still here; the address says where. */
  #settle() {
    this.playing = false;
    this.transport.showPlaying(false);
    settle({ t: this.time.toFixed(3) });
  }

  #checkColor() {
    const { color } = place();
    const names = this.take.ground?.names ?? [];
    if (!color || !names.length || names.includes(color)) return;
    senseless("color", color);
    settle({ color: "" });
  }

  #nextColor() {
    const all = ["", ...(this.take.ground?.names ?? [])];
    return all[(all.indexOf(place().color) + 1) % all.length];
  }

  /** From the tiles, as far as they are there. */
  async #findNeighbours() {
    const { id } = this;
    const tile = tileOf(id);
    const beside = [tile?.previousElementSibling?.dataset.sample, tile?.nextElementSibling?.dataset.sample];
    this.#offer(beside);
    if (beside[0] && beside[1]) return;
    try {
      const found = await neighboursOf({ ...place(), sample: id });
      if (this.id === id) this.#offer(beside.map((each, at) => each ?? found[at]));
    } catch (error) {
      // A sample that is not there says so itself.
      if (error.status !== 404) complain(error);
    }
  }

  #offer(beside) {
    this.beside = beside;
    this.previous.disabled = !beside[0];
    this.next.disabled = !beside[1];
  }

  /** One step aside is none in the history: the way back leads to the gallery. */
  #neighbour(step) {
    const id = this.beside[step < 0 ? 0 : 1];
    if (id) settle({ sample: id, t: "" });
  }

  #key(event) {
    const { target, key } = event;
    if (event.metaKey || event.ctrlKey || event.altKey || target.matches("select")) return;
    const frame = this.take ? 1 / this.take.rate : 0;
    const step = (by) => {
      this.#seek(this.time + by);
      this.#settle();
    };
    const acts = {
      " ": () => !target.matches("button, a, summary") && (this.#toggle(), true),
      ArrowLeft: () => step(-frame * (event.shiftKey ? 10 : 1)),
      ArrowRight: () => step(frame * (event.shiftKey ? 10 : 1)),
      Home: () => step(-Infinity),
      End: () => step(this.take.duration),
      l: () => settle({ loop: place().loop === "on" ? "off" : "on" }),
      p: () => settle({ path: place().path === "on" ? "off" : "on" }),
      c: () => settle({ color: this.#nextColor() }),
      j: () => this.#neighbour(-1),
      k: () => this.#neighbour(1),
      "0": () => this.orbit.reset(),
      "+": () => this.orbit.zoom(0.85),
      "-": () => this.orbit.zoom(1 / 0.85),
    };
    const act = acts[key.length === 1 ? key.toLowerCase() : key];
    if (!act || (!this.take && !["j", "k"].includes(key))) return;
    if (act() !== false) event.preventDefault();
  }
}
