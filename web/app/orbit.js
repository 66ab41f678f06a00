// Moves a view's camera by mouse, touch and keys: turn, pan, come closer.
import * as THREE from "../vendor/three.module.js";
import { FIELD_OF_VIEW, fit } from "./framing.js";
import { stage } from "./stage.js";

const TURN = 0.0055; // [rad] for a pixel
const LOWEST = -0.25; // [rad] just below the ground line
const HIGHEST = 1.53;
const NEAREST = 0.15; // of the distance that shows everything
const FARTHEST = 4;

/** @typedef {{azimuth: number, elevation: number, distance: number, target: THREE.Vector3}} CameraPose */

export class Orbit {
  /** @param {import("./stage.js").View} view @param {() => void} settled called when a gesture ended */
  constructor(view, settled) {
    this.view = view;
    this.settled = settled;
    this.pointers = new Map();
    const { element } = view;
    element.addEventListener("pointerdown", (event) => this.#press(event));
    element.addEventListener("pointermove", (event) => this.#drag(event));
    for (const kind of ["pointerup", "pointercancel"]) element.addEventListener(kind, (event) => this.#lift(event));
    element.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("dblclick", () => this.reset());
  }

  /** Back to the framing that shows everything. */
  reset() {
    this.#show(null);
    this.settled();
  }

  /** The camera as the address holds it; empty while nobody has moved it. */
  get text() {
    const pose = this.view.cameraPose;
    return pose ? [pose.azimuth, pose.elevation, pose.distance, ...pose.target.toArray()].map((part) => part.toFixed(3)).join(",") : "";
  }

  set text(text) {
    if (text === this.text) return;
    const parts = text.split(",").map(Number);
    const sound = parts.length === 6 && parts.every(Number.isFinite) && parts[2] > 0;
    this.#show(sound ? { azimuth: parts[0], elevation: parts[1], distance: parts[2], target: new THREE.Vector3(...parts.slice(3)) } : null);
  }

  /** @param {number} by below 1 comes closer */
  zoom(by) {
    const pose = this.#pose();
    if (!pose) return;
    const whole = this.#whole().distance;
    this.#show({ ...pose, distance: THREE.MathUtils.clamp(pose.distance * by, NEAREST * whole, FARTHEST * whole) });
  }

  #aspect() {
    return this.view.element.clientWidth / Math.max(1, this.view.element.clientHeight);
  }

  #whole() {
    return fit(this.view.framing ?? this.view.take.framing, this.#aspect());
  }

  /** @returns {CameraPose|null} */
  #pose() {
    if (!this.view.take) return null;
    return this.view.cameraPose ?? { ...(this.view.framing ?? this.view.take.framing), ...this.#whole() };
  }

  #show(pose) {
    this.view.cameraPose = pose;
    this.view.stale = true;
    stage.request();
  }

  #turn(dx, dy) {
    const pose = this.#pose();
    if (!pose) return;
    const elevation = THREE.MathUtils.clamp(pose.elevation + dy * TURN, LOWEST, HIGHEST);
    this.#show({ ...pose, azimuth: pose.azimuth - dx * TURN, elevation });
  }

  #pan(dx, dy) {
    const pose = this.#pose();
    if (!pose) return;
    const metres = (2 * pose.distance * Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2))) / Math.max(1, this.view.element.clientHeight);
    const target = pose.target.clone();
    target.x -= dx * metres * Math.cos(pose.azimuth);
    target.z += dx * metres * Math.sin(pose.azimuth);
    target.y += dy * metres;
    this.#show({ ...pose, target });
  }

  #press(event) {
    this.view.element.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, event);
  }

  #drag(event) {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const dx = event.clientX - last.clientX;
    const dy = event.clientY - last.clientY;
    if (this.pointers.size === 1) {
      if (event.shiftKey || event.buttons & 2 || event.buttons & 4) this.#pan(dx, dy);
      else this.#turn(dx, dy);
    } else {
      const other = [...this.pointers.values()].find(({ pointerId }) => pointerId !== event.pointerId);
      const apart = (point) => Math.hypot(point.clientX - other.clientX, point.clientY - other.clientY) || 1;
      this.zoom(apart(last) / apart(event));
      this.#pan(dx / 2, dy / 2);
    }
    this.pointers.set(event.pointerId, event);
  }

  #lift(event) {
    if (this.pointers.delete(event.pointerId) && !this.pointers.size) this.settled();
  }

  #wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(THREE.MathUtils.clamp(event.deltaY, -120, 120) * 0.0015));
    clearTimeout(this.resting);
    this.resting = setTimeout(this.settled, 300);
  }
}
