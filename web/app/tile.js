// One tile of the gallery: a sample's picture, which moves, and a line of what it is.
import { h, onPlainClick, say } from "./dom.js";
import { LEARNING } from "./health_words.js";
import { icon } from "./icons.js";
import { complain } from "./notice.js";
import { stage, View } from "./stage.js";
import { TILE_RATE, takeOf } from "./takes.js";
import { address, go } from "./url_state.js";
import { seconds } from "./words.js";

export class Tile {
  #visible = false;

  /**
   * @param {import("./types.js").Sample} sample
   * @param {{admit: (take: object, sample: string) => void, framing: (take: object) => object,
   *   playsAll: () => boolean}} gallery
   */
  constructor(sample, gallery) {
    this.sample = sample;
    this.gallery = gallery;
    this.note = h("span.shot-note");
    this.shot = h("span.shot", {}, this.note, sample.learning && h("span.learning", { title: LEARNING }, icon("sprout")));
    this.view = new View(this.shot);
    this.gist = h("span.tile-gist");
    this.more = h("span.tile-more.dim", { hidden: true });
    this.link = h(
      "a.tile-link",
      {
        href: address({ sample: sample.id }),
        onclick: onPlainClick(() => go({ sample: this.sample.id })),
        onpointerenter: () => this.#attend(),
        onpointerleave: () => this.rest(),
        onfocus: () => this.#attend(),
        onblur: () => this.rest(),
      },
      this.shot,
      h("span.tile-line", {}, this.gist, " ", this.more, " ", h("span.tile-time.dim", {}, seconds(sample.duration))),
    );
    this.element = h("li.tile", {}, this.link);
    this.element.tile = this;
    this.element.dataset.sample = sample.id;
    stage.add(this.view);
    this.caption({ gist: "", more: "" });
  }

  /** Says what it is. @param {import("./captions.js").Caption} caption */
  caption({ gist, more }) {
    say(this.gist, gist);
    say(this.more, more);
    this.more.hidden = !more;
    const { duration, learning } = this.sample;
    this.link.setAttribute("aria-label", ["Animation", gist, more, seconds(duration), learning && LEARNING.toLowerCase()].filter(Boolean).join(", "));
  }

  /** Whether it has a picture that is in the window. */
  get isShown() {
    return this.#visible && this.view.take !== null;
  }

  /** @param {boolean} visible */
  setVisible(visible) {
    this.#visible = visible;
    if (visible) this.#load();
    // Far away it lets go of its take, so that the store of takes can.
    else this.#drop();
  }

  /** Asks again for a picture that did not come. */
  retry() {
    if (this.#visible) this.#load();
  }

  async #load() {
    if (!stage.works || this.view.take || this.loading) return;
    this.loading = true;
    try {
      const take = await takeOf(this.sample.id, TILE_RATE);
      if (!this.#visible || this.closed) return;
      this.view.take = take;
      this.view.time = take.duration;
      this.gallery.admit(take, this.sample.id);
      this.frame();
      this.shot.classList.add("drawn");
      say(this.note, take.notes.join(" "));
      stage.redraw();
    } catch (error) {
      say(this.note, "Not available");
      complain(error);
    } finally {
      this.loading = false;
    }
  }

  #drop() {
    this.alone = false;
    this.view.take = null;
    this.shot.classList.remove("drawn");
  }

  /** Takes the gallery's common framing. */
  frame() {
    if (this.view.take) this.view.framing = this.gallery.framing(this.view.take);
    this.view.stale = true;
  }

  /** For how long it plays [s]: from its opening to its end. */
  get plays() {
    return this.view.take.duration - this.view.take.opening;
  }

  /** Shows what is seen after playing for `time` [s]. @param {number} time */
  playedFor(time) {
    this.#at(this.view.take.opening + Math.min(time, this.plays));
  }

  #at(time) {
    if (time === this.view.time) return;
    this.view.time = time;
    this.view.stale = true;
    stage.request();
  }

  #attend() {
    this.link.href = address({ sample: this.sample.id });
    this.#playAlone();
  }

  #playAlone() {
    if (this.gallery.playsAll() || this.alone || !this.view.take) return;
    this.alone = true;
    const start = performance.now();
    stage.run((now) => {
      if (!this.alone || !this.view.take || this.gallery.playsAll()) return false;
      this.playedFor((Math.max(0, now - start) / 1000) % (this.plays + 0.8));
      return true;
    });
  }

  /** Stands still where it ended, its whole path drawn. */
  rest() {
    this.alone = false;
    if (this.view.take && !this.gallery.playsAll()) this.#at(this.view.take.duration);
  }

  close() {
    this.closed = true;
    this.#drop();
    stage.remove(this.view);
  }
}
