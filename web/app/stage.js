// The one WebGL canvas of the page. Views are elements; each is drawn into the rectangle that it covers, and only
// when something in it changed.
import * as THREE from "../vendor/three.module.js";
import { aimCamera, fit, lookedAt, newCamera } from "./framing.js";
import { Surroundings } from "./look.js";
import { onTheme } from "./theme.js";

const MOST_PIXELS_PER_POINT = 2;
const TILE_SHADOW = 512;
const LARGE_SHADOW = 2048;

/** A rectangle of the page that shows a take. */
export class View {
  /** @param {HTMLElement} element transparent, in front of the canvas */
  constructor(element) {
    this.element = element;
    /** @type {import("./take.js").Take|null} */
    this.take = null;
    this.time = 0;
    /** @type {import("./framing.js").Framing|null} */
    this.framing = null;
    /** A camera pose of the view's own; without it the framing decides. */
    this.cameraPose = null;
    this.shown = { path: true, contacts: false };
    this.stale = true;
  }
}

class Stage {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.canvas.className = "stage";
    this.canvas.setAttribute("aria-hidden", "true");
    this.views = new Set();
    this.clocks = new Set();
    this.camera = newCamera();
    this.pending = 0;
    this.layout = "";
    this.renderer = this.#start();
    if (!this.renderer) return;
    this.surroundings = new Surroundings();
    this.canvas.addEventListener("webglcontextrestored", () => this.redraw());
    addEventListener("resize", () => this.request());
    addEventListener("scroll", () => this.request(), { passive: true });
    onTheme(() => {
      this.surroundings.wearTheme();
      this.redraw();
    });
  }

  /** Whether anything can be drawn at all. */
  get works() {
    return this.renderer !== null;
  }

  #start() {
    const context = this.canvas.getContext("webgl2", { antialias: true, alpha: true, stencil: true, preserveDrawingBuffer: true });
    if (!context) return null;
    const renderer = new THREE.WebGLRenderer({ canvas: this.canvas, context, antialias: true, alpha: true, stencil: true });
    renderer.shadowMap.enabled = true;
    return renderer;
  }

  /** Moves the canvas behind the views of `host`; views elsewhere rest. @param {HTMLElement} host @param {boolean} scrolls */
  enter(host, scrolls) {
    this.host = host;
    this.scrolls = scrolls;
    host.querySelector(".stage-place").append(this.canvas);
    this.surroundings?.sharpen(scrolls ? TILE_SHADOW : LARGE_SHADOW);
    this.redraw();
  }

  add(view) {
    this.views.add(view);
    this.request();
  }

  remove(view) {
    this.views.delete(view);
    this.request();
  }

  /** Runs `clock(now)` before each picture for as long as it answers true. @param {(now: number) => boolean} clock */
  run(clock) {
    this.clocks.add(clock);
    this.request();
  }

  /** Draws everything anew. */
  redraw() {
    this.layout = "";
    this.request();
  }

  request() {
    if (this.renderer && !this.pending) this.pending = requestAnimationFrame((now) => this.#tick(now));
  }

  #tick(now) {
    this.pending = 0;
    for (const clock of this.clocks) if (!clock(now)) this.clocks.delete(clock);
    this.#draw();
    if (this.clocks.size) this.request();
  }

  #draw() {
    const width = document.documentElement.clientWidth;
    const height = innerHeight;
    const ratio = Math.min(devicePixelRatio, MOST_PIXELS_PER_POINT);
    if (this.size !== `${width} ${height} ${ratio}`) {
      this.size = `${width} ${height} ${ratio}`;
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height);
      this.layout = "";
    }
    const top = this.scrolls ? scrollY : 0;
    this.canvas.style.transform = `translateY(${top}px)`;

    const visible = this.#visible(width, height);
    const layout = visible.map(({ rectangle }) => Object.values(rectangle)).join(" ") + ` at ${top}`;
    const all = layout !== this.layout;
    this.layout = layout;
    if (all) {
      this.renderer.setScissorTest(false);
      // Said again each time: drawing shadows leaves another colour behind.
      this.renderer.setClearColor(0x000000, 0);
      this.renderer.clear();
    }
    this.renderer.setScissorTest(true);
    for (const { view, rectangle } of visible) if (all || view.stale) this.#drawView(view, rectangle, width, height);
  }

  #visible(width, height) {
    const visible = [];
    for (const view of this.views) {
      if (!view.take || !this.host?.contains(view.element)) continue;
      const { left, top, right, bottom } = view.element.getBoundingClientRect();
      if (right <= 0 || bottom <= 0 || left >= width || top >= height || right <= left) continue;
      const x = Math.round(left);
      const y = Math.round(top);
      visible.push({ view, rectangle: { x, y, width: Math.round(right) - x, height: Math.round(bottom) - y } });
    }
    return visible;
  }

  #drawView(view, { x, y, width, height }, pageWidth, pageHeight) {
    const { renderer, camera, surroundings } = this;
    const aspect = width / height;
    const framing = view.framing ?? view.take.framing;
    aimCamera(camera, view.cameraPose ?? { ...framing, ...fit(framing, aspect) }, aspect);
    view.take.pose(view.time, view.shown);
    surroundings.root.clear();
    surroundings.root.add(view.take.group);
    surroundings.aim(lookedAt(framing, view.cameraPose), camera, Boolean(view.take.ground));
    renderer.setViewport(x, pageHeight - y - height, width, height);
    const left = Math.max(x, 0);
    const bottom = Math.max(pageHeight - y - height, 0);
    const right = Math.min(x + width, pageWidth);
    renderer.setScissor(left, bottom, right - left, Math.min(pageHeight - y, pageHeight) - bottom);
    renderer.render(surroundings.scene, camera);
    view.stale = false;
  }
}

export const stage = new Stage();
