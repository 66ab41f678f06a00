// Light and sky. Everything around what is shown.
import * as THREE from "../vendor/three.module.js";
import { color } from "./theme.js";

const SHADOW_REACH = 1.35; // radii of what is looked at
const LIGHT_FROM = new THREE.Vector3(-0.32, 1, 0.34).normalize();
const LOW_LIGHT_FROM = new THREE.Vector3(-0.86, 0.62, 0.18).normalize(); // brings out bumps
const SHADOW_TEXELS = 1.5; // by which shadows begin off a surface
const HORIZON = 0.62; // of the height from the top, where the sky's picture has its horizon
const HIGHEST_HORIZON = 0.12; // and where it is at most when the camera looks down

/** Light and sky around whatever is shown; `root` holds the bodies. */
export class Surroundings {
  constructor() {
    this.scene = new THREE.Scene();
    this.root = new THREE.Group();
    this.ambient = new THREE.HemisphereLight();
    this.sun = new THREE.DirectionalLight();
    this.sun.castShadow = true;
    this.sun.shadow.radius = 3;
    this.sun.shadow.bias = -0.0005;
    this.scene.add(this.root, this.ambient, this.sun, this.sun.target);
    this.scene.fog = new THREE.Fog(0, 1, 10);
    this.wearTheme();
  }

  /** Takes the colours of the present theme. */
  wearTheme() {
    const [top, horizon, ground] = ["--sky", "--horizon", "--ground"].map(color);
    const canvas = document.createElement("canvas");
    canvas.width = 4;
    canvas.height = 256;
    const context = canvas.getContext("2d");
    const gradient = context.createLinearGradient(0, 0, 0, 256);
    gradient.addColorStop(0, top);
    gradient.addColorStop(HORIZON, horizon);
    gradient.addColorStop(1, ground);
    context.fillStyle = gradient;
    context.fillRect(0, 0, 4, 256);
    this.scene.background?.dispose();
    this.scene.background = new THREE.CanvasTexture(canvas);
    this.scene.background.colorSpace = THREE.SRGBColorSpace;
    this.scene.fog.color.set(horizon);
    const dark = document.documentElement.dataset.theme === "dark";
    this.ambient.color.set(dark ? "#cfdcf2" : "#ffffff");
    this.ambient.groundColor.set(dark ? "#2b2a33" : "#cbbfb0");
    this.ambient.intensity = dark ? 1.3 : 1.45;
    this.sun.color.set(dark ? "#fff0dc" : "#fff6e8");
    this.sun.intensity = dark ? 2.1 : 2.15;
  }

  /** How fine shadows are. @param {number} size of the shadow map's side */
  sharpen(size) {
    const { shadow } = this.sun;
    if (shadow.mapSize.x === size) return;
    shadow.mapSize.set(size, size);
    shadow.map?.dispose();
    shadow.map = null;
  }

  /**
   * Points light, shadow and fog at what the camera looks at.
   * @param {THREE.Sphere} seen @param {THREE.Camera} camera @param {boolean} low whether the light comes from the side
   */
  aim({ center, radius }, camera, low) {
    const reach = SHADOW_REACH * radius;
    this.sun.target.position.copy(center);
    this.sun.position.copy(center).addScaledVector(low ? LOW_LIGHT_FROM : LIGHT_FROM, 2.5 * reach);
    this.sun.shadow.normalBias = (SHADOW_TEXELS * 2 * reach) / this.sun.shadow.mapSize.x;
    const lens = this.sun.shadow.camera;
    Object.assign(lens, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * reach, far: 4.5 * reach });
    lens.updateProjectionMatrix();
    this.#level(camera);
    const distance = camera.position.distanceTo(center);
    this.scene.fog.near = distance + 1.2 * radius;
    this.scene.fog.far = distance + 7 * radius;
  }

  /** Puts the horizon of the sky's picture where that of a wide floor is. @param {THREE.PerspectiveCamera} camera */
  #level(camera) {
    const { y } = camera.getWorldDirection(new THREE.Vector3());
    const up = Math.tan(Math.asin(-y)) / Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
    const { background } = this.scene;
    background.repeat.y = HORIZON / THREE.MathUtils.clamp(0.5 - 0.5 * up, HIGHEST_HORIZON, HORIZON);
    background.offset.y = 1 - background.repeat.y;
  }
}
