// The controls of the large view: play, the scrub bar with its contacts, speed, loop.
import { h, say } from "./dom.js";
import { icon } from "./icons.js";
import { SPEEDS } from "./url_state.js";
import { capital, spaced } from "./words.js";

const MOST_TICKS = 200;

export class Transport {
  /**
   * @param {{toggle: () => void, seek: (time: number) => void, settled: () => void, speed: (value: string) => void,
   *   loop: () => void, path: () => void, reset: () => void, color: (name: string) => void}} player
   */
  constructor(player) {
    const button = (words, sign, act) => h("button.quiet.square", { type: "button", "aria-label": words, title: words, onclick: act }, icon(sign));
    this.play = h("button.primary.round", { type: "button", onclick: player.toggle });
    this.scrub = h("input.scrub", {
      type: "range",
      min: "0",
      "aria-label": "Time",
      oninput: () => player.seek(this.scrub.valueAsNumber),
      onchange: player.settled,
    });
    this.ticks = h("div.ticks", { "aria-hidden": "true" });
    this.time = h("output.time");
    this.speed = h("select", { "aria-label": "Speed", onchange: () => player.speed(this.speed.value) }, ...SPEEDS.map((speed) => h("option", { value: speed }, `${speed}×`)));
    this.color = h("select", { "aria-label": "Colour of the ground", hidden: true, onchange: () => player.color(this.color.value) });
    this.loop = button("Play again and again (L)", "repeat", player.loop);
    this.path = button("Show the path (P)", "path", player.path);
    this.reset = button("Show everything (0)", "frame", player.reset);
    this.element = h(
      "div.transport",
      { role: "group", "aria-label": "Playback" },
      this.play,
      h("div.bar", {}, this.ticks, this.scrub),
      this.time,
      this.color,
      this.speed,
      this.loop,
      this.path,
      this.reset,
    );
    this.showPlaying(false);
  }

  /** @param {import("./take.js").Take} take */
  showTake(take) {
    this.duration = take.duration;
    this.scrub.max = String(take.duration);
    this.scrub.step = String(1 / take.rate);
    const names = take.ground?.names ?? [];
    this.color.hidden = !names.length;
    this.color.replaceChildren(h("option", { value: "" }, "Plain"), ...names.map((name) => h("option", { value: name }, capital(spaced(name)))));
    const hardest = Math.max(...take.events.map((event) => event.impulse ?? 0), 1e-9);
    const loudest = [...take.events].sort((a, b) => (b.impulse ?? 0) - (a.impulse ?? 0)).slice(0, MOST_TICKS);
    this.ticks.replaceChildren(
      ...loudest.map((event) => {
        const tick = h("span.tick", { title: `${event.kind} ${(event.bodies ?? []).join(", ")} at ${event.time.toFixed(2)} s` });
        tick.style.left = `${(100 * event.time) / take.duration}%`;
        tick.style.height = `${4 + 8 * Math.sqrt((event.impulse ?? 0) / hardest)}px`;
        return tick;
      }),
    );
  }

  /** @param {number} time [s] */
  showTime(time) {
    this.scrub.value = String(time);
    this.scrub.style.setProperty("--done", `${(100 * time) / this.duration}%`);
    const text = `${time.toFixed(2)} / ${this.duration.toFixed(2)} s`;
    say(this.time, text);
    this.scrub.setAttribute("aria-valuetext", text);
  }

  /** @param {boolean} playing */
  showPlaying(playing) {
    this.play.replaceChildren(icon(playing ? "pause" : "play"));
    this.play.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.play.title = `${playing ? "Pause" : "Play"} (space)`;
  }

  /** @param {{speed: string, loop: boolean, path: boolean, color: string}} chosen */
  showChosen({ speed, loop, path, color }) {
    this.speed.value = speed;
    this.color.value = color;
    this.loop.setAttribute("aria-pressed", String(loop));
    this.path.setAttribute("aria-pressed", String(path));
  }
}
