// Bumpy ground, such as a table of dice: bumps that light brings out, an edge that fades, and on demand a colour for
// what it is like from place to place.
import * as THREE from "../vendor/three.module.js";

const RELIEF = 5; // slopes are lit as if they were so many times as steep: a millimetre in a centimetre is hardly seen
const CONTOUR = 0.00025; // [m] of height from one contour line to the next
const CORNER = 0.4; // radius of the corners, share of the shorter side
const FADE = 0.17; // share of the shorter side over which the edge fades
const STEP = 0.1; // a scale begins and ends at a multiple of it
/** Viridis (Smith and van der Walt, 2015), eleven of its colours: equal steps look equally far. */
const SCALE = ["#440154", "#482475", "#414487", "#355f8d", "#2a788e", "#21918c", "#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"];

/** Whether a body is such ground. @param {import("./types.js").Body} body */
export const isGround = (body) => body.shape?.type === "mesh" && body.shape.attributes !== undefined && body.track === undefined;

const material = new THREE.MeshStandardMaterial({ vertexColors: true, transparent: true, roughness: 0.95, metalness: 0 });
// The edge, and contour lines that are a pixel wide at any distance; where they would be dense they fade.
material.onBeforeCompile = (shader) => {
  shader.vertexShader = `attribute vec2 reach;\nvarying vec2 beside;\nvarying vec2 halves;\nvarying float bump;\n${shader.vertexShader}`
    .replace("#include <begin_vertex>", "#include <begin_vertex>\nbeside = uv;\nhalves = reach;\nbump = position.y;");
  shader.fragmentShader = `varying vec2 beside;\nvarying vec2 halves;\nvarying float bump;\n${shader.fragmentShader}`
    .replace("#include <color_fragment>", `#include <color_fragment>
      float level = bump / ${CONTOUR.toFixed(6)};
      float apart = fwidth(level);
      float line = 1.0 - smoothstep(0.5, 1.3, abs(fract(level - 0.5) - 0.5) / max(apart, 1e-6));
      diffuseColor.rgb *= 1.0 - 0.2 * line * (1.0 - smoothstep(0.15, 0.4, apart));
      float side = 2.0 * min(halves.x, halves.y);
      float corner = ${CORNER.toFixed(3)} * side;
      float inward = corner - length(max(abs(beside) - halves + corner, 0.0));
      diffuseColor.a *= smoothstep(0.0, ${FADE.toFixed(3)} * side, inward);`);
};

/** @typedef {{name: string, low: number, high: number, colors: string[]}} Legend */

export class Ground {
  /** @param {import("./types.js").Body} body @param {THREE.BufferGeometry} geometry its own, which is made to look so */
  constructor({ shape, color }, geometry) {
    this.attributes = shape.attributes;
    this.plain = new THREE.Color(color);
    this.mesh = new THREE.Mesh(geometry, material);
    this.mesh.receiveShadow = true;
    /** What it is coloured by; empty: nothing. */
    this.shown = "";
    steepen(geometry);
    findEdge(geometry);
    geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(geometry.getAttribute("position").array.length), 3));
    this.#paint(null);
  }

  /** What it can be coloured by. @type {string[]} */
  get names() {
    return Object.keys(this.attributes);
  }

  /** The colours and numbers of an attribute; null if it has none of this name. @param {string} name @returns {Legend|null} */
  legend(name) {
    if (!Object.hasOwn(this.attributes, name)) return null;
    const values = this.attributes[name];
    const low = Math.floor(Math.min(...values) / STEP) * STEP;
    const high = Math.ceil(Math.max(...values) / STEP) * STEP;
    return { name, low, high: Math.max(high, low + STEP), colors: SCALE };
  }

  /** @param {string} name of an attribute; any other: its own colour */
  colorBy(name) {
    const legend = this.legend(name);
    const shown = legend ? name : "";
    if (shown === this.shown) return;
    this.shown = shown;
    this.#paint(legend);
  }

  /** @param {Legend|null} legend */
  #paint(legend) {
    const colors = this.mesh.geometry.getAttribute("color");
    const scale = SCALE.map((text) => new THREE.Color(text));
    const tone = this.plain.clone();
    for (let at = 0; at < colors.count; ++at) {
      if (legend) {
        const place = ((this.attributes[legend.name][at] - legend.low) / (legend.high - legend.low)) * (SCALE.length - 1);
        const below = THREE.MathUtils.clamp(Math.floor(place), 0, SCALE.length - 2);
        tone.lerpColors(scale[below], scale[below + 1], THREE.MathUtils.clamp(place - below, 0, 1));
      }
      colors.setXYZ(at, tone.r, tone.g, tone.b);
    }
    colors.needsUpdate = true;
  }
}

function steepen(geometry) {
  const normals = geometry.getAttribute("normal");
  const normal = new THREE.Vector3();
  for (let at = 0; at < normals.count; ++at) {
    normal.fromBufferAttribute(normals, at);
    normal.x *= RELIEF;
    normal.z *= RELIEF;
    normals.setXYZ(at, ...normal.normalize().toArray());
  }
}

/** Tells every vertex where it is beside the middle of the ground, and how far that reaches. @param {THREE.BufferGeometry} geometry */
function findEdge(geometry) {
  const places = geometry.getAttribute("position");
  const box = new THREE.Box3().setFromBufferAttribute(places);
  const middle = box.getCenter(new THREE.Vector3());
  const beside = new Float32Array(2 * places.count);
  const reach = new Float32Array(2 * places.count);
  for (let at = 0; at < places.count; ++at) {
    beside.set([places.getX(at) - middle.x, places.getZ(at) - middle.z], 2 * at);
    reach.set([box.max.x - middle.x, box.max.z - middle.z], 2 * at);
  }
  geometry.setAttribute("uv", new THREE.BufferAttribute(beside, 2));
  geometry.setAttribute("reach", new THREE.BufferAttribute(reach, 2));
}
