// Tiles that play in step: they start together, and together they show how it came out.
import { h } from "./dom.js";
import { icon } from "./icons.js";
import { stage } from "./stage.js";
import { TILE_RATE } from "./takes.js";
import { go, place } from "./url_state.js";

const HOLD = 1.4; // [s] for which the outcome is shown before all start again
const calm = matchMedia("(prefers-reduced-motion: reduce)");

/** Whether all tiles play: as the address says, else unless the reader wants less motion. */
export const playsAll = () => (place().play || (calm.matches ? "off" : "on")) === "on";

/** The switch that makes everything play. */
export const newPlaySwitch = () => h("button.quiet.toggle", { type: "button", onclick: () => go({ play: playsAll() ? "off" : "on" }) }, icon("repeat"), "Play all");

/** @param {HTMLButtonElement} button */
export const showPlaySwitch = (button) => button.setAttribute("aria-pressed", String(playsAll()));

export class InStep {
  #ticking = false;
  #start = 0;
  #drawn = 0;

  /** @param {() => Iterable<import("./tile.js").Tile>} tiles @param {() => boolean} isOpen whether they are in the page */
  constructor(tiles, isOpen) {
    this.tiles = tiles;
    this.isOpen = isOpen;
    this.button = newPlaySwitch();
  }

  /** Plays or rests, as the address says. */
  follow() {
    showPlaySwitch(this.button);
    if (!playsAll()) {
      for (const tile of this.tiles()) tile.rest();
    } else if (!this.#ticking) {
      this.#ticking = true;
      this.#start = performance.now();
      stage.run((now) => this.#tick(now));
    }
  }

  #tick(now) {
    this.#ticking = playsAll() && !place().sample && this.isOpen();
    if (!this.#ticking) return false;
    if (now - this.#drawn < 1000 / TILE_RATE - 4) return true;
    this.#drawn = now;
    const shown = [...this.tiles()].filter((tile) => tile.isShown);
    const longest = Math.max(0.5, ...shown.map((tile) => tile.plays));
    const time = ((now - this.#start) / 1000) % (longest + HOLD);
    for (const tile of shown) tile.playedFor(time);
    return true;
  }
}
