// A reel: animations of one scenario in one picture, one after another, without an end.
import { h, say } from "./dom.js";
import { playsAll } from "./in_step.js";
import { SharedFraming } from "./framing.js";
import { complain } from "./notice.js";
import { stage, View } from "./stage.js";
import { TILE_RATE, takeOf } from "./takes.js";
import { onPlace, place } from "./url_state.js";

const HOLD = 1.2; // [s] for which an outcome is shown
const RETRY = 4000; // [ms] before an animation that did not come is asked for again

export class Reel {
  #samples = [];
  #at = 0;
  #visible = false;
  #ticking = false;
  #changing = false;
  #start = 0;
  #drawn = 0;

  /** @param {{aspect: number, onTake?: (id: string) => void}} look how wide it is, in heights; what to do when another
   *   animation begins */
  constructor({ aspect, onTake = () => {} }) {
    this.onTake = onTake;
    this.note = h("span.shot-note");
    this.shot = h("span.shot", {}, this.note);
    this.view = new View(this.shot);
    this.framing = new SharedFraming(aspect);
    stage.add(this.view);
    this.end = onPlace(() => this.#follow());
    this.inView = new IntersectionObserver((entries) => {
      this.#visible = entries.at(-1).isIntersecting;
      this.#follow();
    }, { rootMargin: "120px" });
    this.inView.observe(this.shot);
  }

  get isEmpty() {
    return !this.#samples.length;
  }

  /** @param {string[]} samples ids */
  show(samples) {
    this.#samples = samples;
    this.#at = 0;
    this.#follow();
  }

  /** What stands there instead of a picture. @param {string} text */
  say(text) {
    say(this.note, text);
  }

  close() {
    this.closed = true;
    this.end();
    this.inView.disconnect();
    stage.remove(this.view);
  }

  /** Plays or rests, as the address says; out of sight it rests. */
  #follow() {
    if (!this.#visible || this.closed || !this.#samples.length || !stage.works) return;
    if (!this.view.take) return this.#change(this.#samples[this.#at]);
    if (!playsAll()) return this.#pose(this.view.take.duration);
    if (this.#ticking || place().sample) return;
    this.#ticking = true;
    this.#start = performance.now();
    stage.run((now) => this.#tick(now));
  }

  async #change(id) {
    if (this.#changing) return;
    this.#changing = true;
    try {
      const take = await takeOf(id, TILE_RATE);
      if (this.closed) return;
      this.framing.admit(take.framing);
      this.view.take = take;
      this.view.framing = this.framing.of(take.framing);
      this.shot.classList.add("drawn");
      this.say(take.notes.join(" "));
      this.#start = performance.now();
      this.#pose(playsAll() ? take.opening : take.duration);
      stage.redraw();
      this.onTake(id);
      this.#changing = false;
      this.#follow();
      // The next one is there when this one ends.
      takeOf(this.#next, TILE_RATE).catch(() => {});
    } catch (error) {
      if (this.closed) return;
      complain(error);
      // It may be gone: the one after it.
      setTimeout(() => {
        this.#changing = false;
        this.#at = (this.#at + 1) % this.#samples.length;
        this.#follow();
      }, RETRY);
    }
  }

  get #next() {
    return this.#samples[(this.#at + 1) % this.#samples.length];
  }

  #tick(now) {
    this.#ticking = playsAll() && !place().sample && this.#visible && !this.closed;
    if (!this.#ticking) return false;
    if (now - this.#drawn < 1000 / TILE_RATE - 4) return true;
    this.#drawn = now;
    const { opening, duration } = this.view.take;
    const time = opening + Math.max(0, now - this.#start) / 1000;
    this.#pose(Math.min(time, duration));
    if (time > duration + HOLD && !this.#changing) {
      this.#at = (this.#at + 1) % this.#samples.length;
      this.#change(this.#samples[this.#at]);
    }
    return true;
  }

  #pose(time) {
    if (time === this.view.time) return;
    this.view.time = time;
    this.view.stale = true;
    stage.request();
  }
}
