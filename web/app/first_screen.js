// What a reader sees first: an animation that plays, and a card with a picture for every world.
import { pathOf, request } from "./api.js";
import { allScenarios, allWorlds, isReady, worldOf } from "./catalog.js";
import { h, onPlainClick, say } from "./dom.js";
import { rarityOf, triesOf } from "./health_words.js";
import { newPlaySwitch, showPlaySwitch } from "./in_step.js";
import { complain } from "./notice.js";
import { Reel } from "./reel.js";
import { ELSEWHERE } from "./scenario_list.js";
import { stage } from "./stage.js";
import { address, go } from "./url_state.js";
import { capital, count, wish } from "./words.js";

const HERO_ASPECT = 21 / 9; // as the style sheet has them
const CARD_ASPECT = 4 / 3;
const IN_HERO = 8; // animations that it shows in turn
const IN_CARD = 3;
const COURTESY = 2500; // [ms] for which the first world is waited for, though others have an animation already

/** A link whose place is told by `lead`. @param {string} tag @param {...Node} children */
function newLink(tag, ...children) {
  const link = h(tag, { onclick: onPlainClick(() => go(link.to)) }, ...children);
  return link;
}

/** @param {HTMLAnchorElement} link @param {Partial<import("./url_state.js").Place>} to */
function lead(link, to) {
  link.to = { ...ELSEWHERE, tab: "animations", ...to };
  link.href = address(link.to);
}

/** The scenarios of a world, its examples before all others, in the order in which the world tells them.
 * @param {import("./types.js").World} world */
function scenariosOf({ name, examples }) {
  const titles = examples.map(({ title }) => title);
  const rank = ({ title }) => (titles.includes(title) ? titles.indexOf(title) : titles.length);
  return allScenarios().filter(({ world }) => world === name).sort((one, other) => rank(one) - rank(other));
}

/** Some samples of a scenario, the newest first; those found early only where there are no others. */
async function samplesOf(scenario, most) {
  const { samples } = await request(`${pathOf("scenarios", scenario.id, "/samples")}?limit=${3 * most}`);
  const counted = samples.filter(({ learning }) => !learning);
  return (counted.length ? counted : samples).slice(0, most).map(({ id }) => id);
}

export class FirstScreen {
  /** @type {Card[]} */
  #cards = [];
  #opened = performance.now();
  #open = true;

  constructor() {
    this.id = "first";
    this.reel = new Reel({ aspect: HERO_ASPECT, onTake: (id) => this.#name(id) });
    this.play = newPlaySwitch();
    this.picture = newLink("a.hero-link", this.reel.shot);
    this.sentence = h("p.sentence");
    this.rarity = h("p.rarity-line");
    this.all = newLink("a.button.primary");
    this.create = h("button.quiet", { type: "button", onclick: () => go({ create: "any" }) }, "Wish for something new");
    this.worlds = h("ul.worlds");
    this.element = h(
      "article.first",
      {},
      this.picture,
      h(
        "header.wish",
        {},
        h("div.wish-words", {}, h("h1", {}, "You decide the outcome. Physics finds the way."), this.sentence, this.rarity),
        h("div.wish-act", {}, this.play, this.create, this.all),
      ),
      h("h2", {}, "Worlds"),
      this.worlds,
    );
    this.element.classList.toggle("plain", !stage.works);
    // Words that come later move the pictures below them.
    this.moves = new ResizeObserver(() => stage.request());
    this.moves.observe(this.element);
    allWorlds().then((worlds) => this.#offer(worlds), complain);
  }

  /** Follows the catalog. */
  show() {
    document.title = "Retake";
    showPlaySwitch(this.play);
    for (const card of this.#cards) card.show();
    this.#choose();
    const { hero } = this;
    const running = allScenarios().some(({ chains }) => chains?.running);
    const none = running ? "The first animation is on its way." : allScenarios().length ? "No scenario has an animation yet." : "There is no scenario yet.";
    if (!hero) this.reel.say(isReady() ? none : "");
    say(this.sentence, hero ? `${hero.title || "Untitled"}: ${wish(hero).replace(/^./, (letter) => letter.toLowerCase())}` : isReady() ? none : "");
    const rare = hero && rarityOf(hero, triesOf(worldOf(hero.world)));
    say(this.rarity, rare ? `By chance ${rare.odds.replace(/^./, (letter) => letter.toLowerCase())}; here every one, and no two alike.` : "");
    this.all.hidden = !hero;
    say(this.all, hero ? `All ${count(hero.samples)} animations` : "");
  }

  close() {
    this.#open = false;
    this.moves.disconnect();
    this.reel.close();
    for (const card of this.#cards) card.close();
  }

  /** The scenario that is played: of the first world that has an animation, once and for all. */
  #choose() {
    if (this.hero) {
      this.hero = allScenarios().find(({ id }) => id === this.hero.id) ?? this.hero;
      return;
    }
    const scenarios = this.#cards.flatMap(({ world }) => scenariosOf(world));
    const found = scenarios.find(({ samples }) => samples > 0);
    if (!found) return;
    const wait = this.#opened + COURTESY - performance.now();
    if (found.world !== this.#cards[0].world.name && wait > 0) {
      // The timer may be early by a fraction of a millisecond, and is set again then.
      clearTimeout(this.later);
      this.later = setTimeout(() => this.#open && this.show(), wait);
      return;
    }
    this.hero = found;
    lead(this.picture, { scenario: found.id });
    lead(this.all, { scenario: found.id });
    samplesOf(found, IN_HERO).then((samples) => this.#open && this.reel.show(samples), complain);
  }

  /** The picture leads to the animation that is in it. */
  #name(sample) {
    lead(this.picture, { scenario: this.hero.id, sample });
    this.picture.setAttribute("aria-label", `Animation: ${this.hero.title || "Untitled"}`);
  }

  #offer(worlds) {
    if (!this.#open) return;
    this.#cards = worlds.map((world) => new Card(world));
    this.worlds.replaceChildren(...this.#cards.map(({ element }) => element));
    this.show();
  }
}

/** A world: one of its animations, its name and what it is. It opens its first example. */
class Card {
  /** @param {import("./types.js").World} world */
  constructor(world) {
    this.world = world;
    this.reel = new Reel({ aspect: CARD_ASPECT });
    this.link = newLink("a.tile-link", this.reel.shot, h("strong", {}, capital(world.name)), h("span.dim", {}, world.summary));
    this.element = h("li.world", {}, this.link);
    this.element.dataset.world = world.name;
  }

  show() {
    const scenarios = scenariosOf(this.world);
    lead(this.link, scenarios.length ? { scenario: scenarios[0].id } : { scenario: "", create: this.world.name });
    const found = scenarios.find(({ samples }) => samples > 0);
    if (this.asked || !found) return;
    this.asked = true;
    samplesOf(found, IN_CARD).then((samples) => this.reel.show(samples), complain);
  }

  close() {
    this.reel.close();
  }
}
