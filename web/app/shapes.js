// Geometry of the shapes that a keyframe document may hold, each built once and shared.
import * as THREE from "../vendor/three.module.js";

/** @type {Object<string, (shape: any) => THREE.BufferGeometry>} */
const BUILD = {
  sphere: ({ radius }) => new THREE.SphereGeometry(radius, 48, 32),
  box: ({ half_extents: [x, y, z] }) => new THREE.BoxGeometry(2 * x, 2 * y, 2 * z),
  cylinder: ({ radius, height }) => new THREE.CylinderGeometry(radius, radius, height, 64),
  revolution: ({ profile }) => new THREE.LatheGeometry(upwards(profile).map(([radius, y]) => new THREE.Vector2(radius, y)), 40),
  mesh({ positions, indices }) {
    const flat = new THREE.BufferGeometry();
    flat.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    flat.setIndex(indices);
    // Facets stay facets: corners are not shared, so normals are the faces' own.
    const faceted = flat.toNonIndexed();
    faceted.computeVertexNormals();
    return faceted;
  },
};

/** A profile from its lowest point up, which makes the surface face outwards. @param {number[][]} profile */
const upwards = (profile) => (profile[0][1] <= profile.at(-1)[1] ? profile : [...profile].reverse());

const shared = new Map();

/** Whether a shape can be drawn. @param {{type: string}} shape */
export const isKnown = (shape) => Object.hasOwn(BUILD, shape?.type);

/**
 * The geometry of a known shape. Meshes belong to the caller, who disposes of them; the others are shared for good.
 * @param {import("./types.js").Shape} shape
 * @returns {{geometry: THREE.BufferGeometry, owned: boolean}}
 */
export function geometryOf(shape) {
  if (shape.type === "mesh") return { geometry: finish(BUILD.mesh(shape)), owned: true };
  const key = JSON.stringify(shape);
  if (!shared.has(key)) shared.set(key, finish(BUILD[shape.type](shape)));
  return { geometry: shared.get(key), owned: false };
}

/** What stands in for a shape that is not known: a cage that nobody takes for a body. */
export function placeholder() {
  const cage = new THREE.IcosahedronGeometry(0.25, 0);
  return finish(cage);
}

function finish(geometry) {
  geometry.computeBoundingSphere();
  geometry.computeBoundingBox();
  return geometry;
}
