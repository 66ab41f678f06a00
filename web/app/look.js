// Light, sky and surfaces. Everything the eye judges and physics does not know.
import * as THREE from "../vendor/three.module.js";
import { color } from "./theme.js";

const SHADOW_REACH = 1.35; // radii of what is looked at
const LIGHT_FROM = new THREE.Vector3(-0.32, 1, 0.34).normalize();
const LOW_LIGHT_FROM = new THREE.Vector3(-0.86, 0.62, 0.18).normalize(); // brings out bumps
const SHADOW_TEXELS = 1.5; // by which shadows begin off a surface
/** Bodies by name whose top mirrors what stands on it, and those that are laid of boards. */
export const MIRROR = new Set(["lane"]);
const BOARDED = new Set(["lane", "approach"]);
const FLAT = new Set(["target", "markings", "finger_holes"]); // lie on other bodies
const BOARDS = 39;
const VARNISH = 0.86; // share of a mirroring floor's own colour
const DARK = 0.12; // luminance below which the second tone of a sphere is the lighter one

const LIGHT = 0.4; // luminance above which what shines is a light ground

const surfaces = new Map();
const images = new Map();
const trails = new Map();
const patterns = new Map();
let hallSeen = null;

/** @param {number} width @param {number} height @param {(context: CanvasRenderingContext2D) => void} paint */
function painted(width, height, paint) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width, height });
  paint(canvas.getContext("2d"));
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.anisotropy = 4;
  return texture;
}

/** Two tones in octants, like a mark of the centre of mass, so that a turning sphere is seen to turn. @param {THREE.Color} tone */
function octants(tone) {
  const hsl = tone.getHSL({});
  const dark = hsl.l < 0.5 && luminance(tone) < DARK;
  const other = dark ? tone.clone().lerp(new THREE.Color("#dce8ff"), 0.3) : tone.clone().multiply(new THREE.Color("#c4bfb9"));
  return painted(512, 256, (context) => {
    for (let column = 0; column < 4; ++column) {
      for (let row = 0; row < 2; ++row) {
        context.fillStyle = `#${((column + row) % 2 ? tone : other).getHexString()}`;
        context.fillRect(column * 128, row * 128, 128, 128);
      }
    }
  });
}

/** Twisted bands in clear glass, like those in a marble. @param {THREE.Color} tone */
function swirls(tone) {
  const clear = tone.clone().lerp(new THREE.Color("#ffffff"), 0.06);
  const bands = [tone.clone().multiplyScalar(0.5), tone.clone().lerp(new THREE.Color("#ffffff"), 0.8), tone.clone().multiplyScalar(0.66)];
  return painted(512, 256, (context) => {
    const style = (color) => `#${color.getHexString()}`;
    context.fillStyle = style(clear);
    context.fillRect(0, 0, 512, 256);
    context.filter = "blur(2px)";
    bands.forEach((band, at) => {
      context.fillStyle = style(band);
      // Each band goes from pole to pole and turns on its way; what leaves the picture comes back in.
      for (const around of [-512, 0, 512]) {
        const left = (y) => around + 512 * (at / bands.length) + 150 * (y / 256) + 26 * Math.sin(y / 40 + 2 * at);
        const width = (y) => 12 + 50 * Math.sin((Math.PI * y) / 256);
        context.beginPath();
        for (let y = 0; y <= 256; y += 8) context.lineTo(left(y), y);
        for (let y = 256; y >= 0; y -= 8) context.lineTo(left(y) + width(y), y);
        context.fill();
      }
    });
  });
}

const luminance = ({ r, g, b }) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/** Boards side by side, each joined of pieces of slightly different tone. */
function boards() {
  let seed = 7;
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
  return painted(2048, 16 * BOARDS, (context) => {
    for (let board = 0; board < BOARDS; ++board) {
      const top = 16 * board;
      for (let from = -400 * random(), length = 0; from < 2048; from += length) {
        length = 260 + 420 * random();
        const light = 84 + 13 * random();
        context.fillStyle = `hsl(${34 + 8 * random()} ${30 + 40 * random()}% ${light}%)`;
        context.fillRect(from, top, length, 16);
        for (let streak = 0; streak < 26; ++streak) {
          context.fillStyle = `rgb(96 52 12 / ${2 + 5 * random()}%)`;
          context.fillRect(from + length * random(), top + 16 * random(), 30 + 160 * random(), 0.6 + random());
        }
        context.fillStyle = "rgb(60 32 10 / 30%)";
        context.fillRect(from, top, 1, 16);
      }
      context.fillStyle = "rgb(60 32 10 / 26%)";
      context.fillRect(0, top, 2048, 1);
    }
  });
}

function pattern(key, make) {
  if (!patterns.has(key)) patterns.set(key, make());
  return patterns.get(key);
}

const validColor = (text) => (/^#[0-9a-f]{6}$/i.test(text ?? "") ? text : "#8a8f98");

/** What a surface is like, by the body's name and shape. @param {import("./types.js").Body} body */
function kindOf({ name, shape }) {
  if (shape?.type === "sphere" && name?.startsWith("marble_")) return "glass";
  if (BOARDED.has(name)) return MIRROR.has(name) ? "varnished boards" : "boards";
  if (FLAT.has(name)) return "flat";
  if (name?.startsWith("die_")) return "die";
  return { sphere: "sphere", revolution: "revolution" }[shape?.type] ?? "plain";
}

/** Whether a body lies on another one, and has no shadow of its own. @param {import("./types.js").Body} body */
export const isFlat = (body) => FLAT.has(body.name);

/** The surface of a body. @param {import("./types.js").Body} body */
export function surfaceOf(body) {
  const kind = kindOf(body);
  const key = `${kind} ${body.color}`;
  if (!surfaces.has(key)) surfaces.set(key, surface(kind, validColor(body.color)));
  return surfaces.get(key);
}

function surface(kind, text) {
  const tone = new THREE.Color(text);
  if (kind === "glass") return glass(tone, pattern(`swirls ${text}`, () => swirls(tone)));
  const map = kind === "sphere" ? pattern(`octants ${text}`, () => octants(tone)) : kind.includes("board") ? pattern("boards", boards) : null;
  const paint = kind === "sphere" ? "#ffffff" : text; // the octants have the colour in them
  if (kind === "die") return Object.assign(glossy(paint, null, luminance(tone) < LIGHT), { reflectivity: 0.08 });
  if (kind === "revolution" || (kind === "sphere" && luminance(tone) < DARK)) return glossy(paint, map, luminance(tone) < LIGHT);
  const made = new THREE.MeshStandardMaterial({ color: paint, map, roughness: 0.58, metalness: 0 });
  if (kind === "sphere") made.roughness = 0.42;
  if (kind === "flat") Object.assign(made, { polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2, roughness: 0.9 });
  if (map && kind !== "sphere") made.roughness = 0.34;
  // Drawn over the images in it, although not among what is transparent: all else is drawn after it.
  if (kind === "varnished boards") Object.assign(made, { opacity: VARNISH, blending: THREE.CustomBlending, depthFunc: THREE.AlwaysDepth });
  return made;
}

/** What shines reflects the lights of a hall: added to a dark ground, mixed into a light one. */
function glossy(paint, map, dark) {
  return new THREE.MeshPhongMaterial({
    color: paint,
    map,
    specular: "#4a4a4a",
    shininess: 90,
    envMap: (hallSeen ??= hall()),
    combine: dark ? THREE.AddOperation : THREE.MixOperation,
    reflectivity: dark ? 0.3 : 0.07,
    emissive: dark ? "#000000" : new THREE.Color(paint).multiplyScalar(0.09),
  });
}

/** Coloured glass: bright from within, with the lights of a hall on it. @param {THREE.Color} tone @param {THREE.Texture} map */
function glass(tone, map) {
  return new THREE.MeshPhongMaterial({
    map,
    specular: "#8a8a8a",
    shininess: 140,
    envMap: (hallSeen ??= hall()),
    combine: THREE.AddOperation,
    reflectivity: 0.13,
    emissive: tone.clone().multiplyScalar(0.16),
  });
}

/** A dim hall with strips of light on its ceiling, as a cube. */
function hall() {
  const side = (paint) => {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = 128;
    paint(canvas.getContext("2d"));
    return canvas;
  };
  const wall = side((context) => {
    const shade = context.createLinearGradient(0, 0, 0, 128);
    shade.addColorStop(0, "#6b727b");
    shade.addColorStop(0.5, "#2e3238");
    shade.addColorStop(1, "#1c1a18");
    context.fillStyle = shade;
    context.fillRect(0, 0, 128, 128);
  });
  const ceiling = side((context) => {
    context.fillStyle = "#5b626b";
    context.fillRect(0, 0, 128, 128);
    context.filter = "blur(3px)";
    context.fillStyle = "#ffffff";
    for (const from of [12, 54, 96]) context.fillRect(from, 8, 20, 112);
  });
  const floor = side((context) => {
    context.fillStyle = "#1c1a18";
    context.fillRect(0, 0, 128, 128);
  });
  const cube = new THREE.CubeTexture([wall, wall, ceiling, floor, wall, wall]);
  cube.colorSpace = THREE.SRGBColorSpace;
  cube.needsUpdate = true;
  return cube;
}

/** Where images are seen: the part of the view that a mirroring floor covers. */
export const windowSurface = new THREE.MeshBasicMaterial({
  colorWrite: false, depthWrite: false, stencilWrite: true, stencilRef: 1, stencilZPass: THREE.ReplaceStencilOp,
});

/** The surface of a body's mirror image, seen through that window alone. @param {import("./types.js").Body} body */
export function imageSurface(body) {
  const key = `${kindOf(body)} ${body.color}`;
  if (!images.has(key)) {
    const { map, color: tone } = surfaceOf(body);
    images.set(key, new THREE.MeshLambertMaterial({ map, color: tone, fog: false, stencilWrite: true, stencilRef: 1, stencilFunc: THREE.EqualStencilFunc }));
  }
  return images.get(key);
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
    const tone = new THREE.Color(validColor(text)).lerp(new THREE.Color(color("--ink")), 0.36);
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
    const distance = camera.position.distanceTo(center);
    this.scene.fog.near = distance + 1.2 * radius;
    this.scene.fog.far = distance + 7 * radius;
  }
}
