// Light, sky and surfaces. Everything the eye judges and physics does not know.
import * as THREE from "../vendor/three.module.js";
import { color } from "./theme.js";

const LIGHT_FROM = new THREE.Vector3(-0.32, 1, 0.34).normalize();
const surfaces = new Map();
const trails = new Map();
let pattern = null;

/** Two tones in octants, like a mark of the centre of mass, so that a turning sphere is seen to turn. */
function octants() {
  if (pattern) return pattern;
  const canvas = document.createElement("canvas");
  canvas.width = 512;
  canvas.height = 256;
  const context = canvas.getContext("2d");
  for (let column = 0; column < 4; ++column) {
    for (let row = 0; row < 2; ++row) {
      context.fillStyle = (column + row) % 2 ? "#ffffff" : "#c4bfb9";
      context.fillRect(column * 128, row * 128, 128, 128);
    }
  }
  pattern = new THREE.CanvasTexture(canvas);
  pattern.colorSpace = THREE.SRGBColorSpace;
  pattern.anisotropy = 4;
  return pattern;
}

const validColor = (text) => (/^#[0-9a-f]{6}$/i.test(text ?? "") ? text : "#8a8f98");

/** The surface of a body. @param {import("./types.js").Body} body */
export function surfaceOf(body) {
  const kind = body.name === "target" ? "target" : body.shape?.type === "sphere" ? "sphere" : "plain";
  const key = `${kind} ${body.color}`;
  if (!surfaces.has(key)) {
    const surface = new THREE.MeshStandardMaterial({ color: validColor(body.color), roughness: 0.58, metalness: 0 });
    if (kind === "sphere") {
      surface.map = octants();
      surface.roughness = 0.42;
    }
    if (kind === "target") {
      Object.assign(surface, { polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2, roughness: 0.9 });
    }
    surfaces.set(key, surface);
  }
  return surfaces.get(key);
}

/** The surface of a shape that is not known. */
export const cageSurface = new THREE.MeshBasicMaterial({ color: "#d0489a", wireframe: true });

/**
 * The colour of a body's path: its own, drawn towards the ink so that it shows on any ground.
 * @param {string} text @param {boolean} [faint]
 */
export function trailSurface(text, faint = false) {
  const key = `${validColor(text)} ${color("--ink")} ${faint}`;
  if (!trails.has(key)) {
    const tone = new THREE.Color(validColor(text)).lerp(new THREE.Color(color("--ink")), 0.25);
    trails.set(key, new THREE.MeshBasicMaterial({ color: tone, transparent: true, opacity: faint ? 0.16 : 0.66, depthWrite: false }));
  }
  return trails.get(key);
}

/** Light and sky around whatever is shown; `root` holds the bodies. */
export class Surroundings {
  constructor() {
    this.scene = new THREE.Scene();
    this.root = new THREE.Group();
    this.ambient = new THREE.HemisphereLight();
    this.sun = new THREE.DirectionalLight();
    this.sun.castShadow = true;
    this.sun.shadow.radius = 3;
    this.sun.shadow.normalBias = 0.02;
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
    gradient.addColorStop(0.62, horizon);
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

  /** Points light, shadow and fog at what the camera looks at. @param {THREE.Box3} box @param {THREE.Camera} camera */
  aim(box, camera) {
    const { center, radius } = box.getBoundingSphere(new THREE.Sphere());
    this.sun.target.position.copy(center);
    this.sun.position.copy(center).addScaledVector(LIGHT_FROM, 2.5 * radius);
    const lens = this.sun.shadow.camera;
    Object.assign(lens, { left: -radius, right: radius, top: radius, bottom: -radius, near: 0.1 * radius, far: 4.5 * radius });
    lens.updateProjectionMatrix();
    const distance = camera.position.distanceTo(center);
    this.scene.fog.near = distance + 1.2 * radius;
    this.scene.fog.far = distance + 7 * radius;
  }
}
