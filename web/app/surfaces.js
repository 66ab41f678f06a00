// What bodies are drawn with: a material for each surface that a document can tell, by colour and shape.
import * as THREE from "../vendor/three.module.js";
import { DARK, boards, grain, hall, luminance, octants, swirls } from "./patterns.js";
import { color } from "./theme.js";

const VARNISH = 0.86; // share of a mirroring floor's own colour
const LIGHT = 0.4; // luminance above which what shines is a light ground
const SLICE = 0.3; // share of light that one slice of a shade takes

const made = new Map();
const images = new Map();
const trails = new Map();
const patterns = new Map();

function pattern(key, make) {
  if (!patterns.has(key)) patterns.set(key, make());
  return patterns.get(key);
}

const validColor = (text) => (/^#[0-9a-f]{6}$/i.test(text ?? "") ? text : "#8a8f98");

/** @typedef {{text: string, tone: THREE.Color, type: string, map: THREE.Texture|null, paint: string}} Look a body's colour and
 *   shape; a sphere wears octants, which have the colour in them, so that it is seen to turn */

/** @type {Object<string, (look: Look) => THREE.Material>} */
const MAKE = {
  /** What a record says that tells no surface: by its shape. */
  plain(look) {
    const shines = look.type === "revolution" || (look.type === "sphere" && luminance(look.tone) < DARK);
    return shines ? glossy(look) : dull(look, look.type === "sphere" ? 0.42 : 0.58);
  },
  wood: (look) => dull({ ...look, map: look.map ?? pattern("grain", grain) }, 0.5),
  boards: (look) => dull({ ...look, map: pattern("boards", boards) }, 0.34),
  // Drawn over the images in it, although not among what is transparent: all else is drawn after it.
  varnished: (look) => Object.assign(MAKE.boards(look), { opacity: VARNISH, blending: THREE.CustomBlending, depthFunc: THREE.AlwaysDepth }),
  felt: (look) => dull(look, 0.95),
  cloth: (look) => dull(look, 1),
  plastic: (look) => Object.assign(glossy(look), { reflectivity: 0.08 }),
  polished: (look) => glossy(look),
  glass: ({ text, tone }) => glass(tone, pattern(`swirls ${text}`, () => swirls(tone))),
  metal: (look) => Object.assign(glossy(look), { combine: THREE.MixOperation, reflectivity: 0.4, shininess: 40 }),
  rubber: (look) => dull(look, 0.62),
  stone: (look) => dull(look, 0.7),
  plaster: (look) => dull(look, 0.95),
  marking: (look) => Object.assign(dull(look, 0.9), { polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2 }),
  lamp: ({ text }) => new THREE.MeshBasicMaterial({ color: text }),
  shade: ({ text }) => new THREE.MeshBasicMaterial({ color: text, transparent: true, opacity: SLICE, depthWrite: false, side: THREE.DoubleSide, fog: false }),
};

/** What a body's surface is; plain where it is not told or not known. @param {import("./types.js").Body} body */
export const surfaceName = (body) => (Object.hasOwn(MAKE, body.surface ?? "") ? body.surface : "plain");

/** Whether a body lies on another one, without a thickness. @param {import("./types.js").Body} body */
export const isMarking = (body) => surfaceName(body) === "marking";

/** Whether a body mirrors what is above it. @param {import("./types.js").Body} body */
export const isMirror = (body) => surfaceName(body) === "varnished";

/** Whether a body has no surface, only takes light. @param {import("./types.js").Body} body */
export const isShade = (body) => surfaceName(body) === "shade";

/** Whether a body gives light. @param {import("./types.js").Body} body */
export const isLamp = (body) => surfaceName(body) === "lamp";

/** Whether a body is laid of boards from edge to edge, so that its picture fits its sides. @param {import("./types.js").Body} body */
export const isLaid = (body) => ["boards", "varnished"].includes(surfaceName(body));

/** What a body is drawn with. @param {import("./types.js").Body} body */
export function surfaceOf(body) {
  const type = body.shape?.type;
  const key = `${surfaceName(body)} ${["sphere", "revolution"].includes(type) ? type : ""} ${body.color}`;
  if (!made.has(key)) made.set(key, MAKE[surfaceName(body)](lookOf(body)));
  return made.get(key);
}

/** @param {import("./types.js").Body} body @returns {Look} */
function lookOf({ color: told, shape }) {
  const text = validColor(told);
  const tone = new THREE.Color(text);
  const sphere = shape?.type === "sphere";
  return { text, tone, type: shape?.type, map: sphere ? pattern(`octants ${text}`, () => octants(tone)) : null, paint: sphere ? "#ffffff" : text };
}

/** @param {Look} look @param {number} roughness */
function dull({ paint, map }, roughness) {
  return new THREE.MeshStandardMaterial({ color: paint, map, roughness, metalness: 0 });
}

/** What shines reflects the lights of a hall: added to a dark ground, mixed into a light one. @param {Look} look */
function glossy({ tone, paint, map }) {
  const dark = luminance(tone) < LIGHT;
  return new THREE.MeshPhongMaterial({
    color: paint,
    map,
    specular: "#4a4a4a",
    shininess: 90,
    envMap: pattern("hall", hall),
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
    envMap: pattern("hall", hall),
    combine: THREE.AddOperation,
    reflectivity: 0.1,
    emissive: tone.clone().multiplyScalar(0.22),
  });
}

/** Where images are seen: the part of the view that a mirroring floor covers. */
export const windowSurface = new THREE.MeshBasicMaterial({
  colorWrite: false, depthWrite: false, stencilWrite: true, stencilRef: 1, stencilZPass: THREE.ReplaceStencilOp,
});

/** The surface of a body's mirror image, seen through that window alone. @param {import("./types.js").Body} body */
export function imageSurface(body) {
  const own = surfaceOf(body);
  if (!images.has(own)) {
    const Kind = own.isMeshBasicMaterial ? THREE.MeshBasicMaterial : THREE.MeshLambertMaterial;
    images.set(own, new Kind({ map: own.map, color: own.color, fog: false, stencilWrite: true, stencilRef: 1, stencilFunc: THREE.EqualStencilFunc }));
  }
  return images.get(own);
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
