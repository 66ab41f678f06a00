// Geometry of the shapes that a keyframe document may hold, each built once and shared.
import * as THREE from "../vendor/three.module.js";

/** @type {Object<string, (shape: any, detail?: number) => THREE.BufferGeometry>} */
const BUILD = {
  sphere: ({ radius }, detail) => new THREE.SphereGeometry(radius, 48 * detail, 32 * detail),
  box: ({ half_extents: [x, y, z] }) => new THREE.BoxGeometry(2 * x, 2 * y, 2 * z),
  cylinder: ({ radius, height }) => new THREE.CylinderGeometry(radius, radius, height, 64),
  revolution: ({ profile }) => revolution(upwards(profile)),
  mesh({ positions, indices }) {
    const shared = new THREE.BufferGeometry();
    shared.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
    shared.setIndex(indices);
    shared.computeVertexNormals();
    if (isSmooth(shared)) return shared;
    // Facets stay facets: corners are not shared, so normals are the faces' own.
    const faceted = shared.toNonIndexed();
    faceted.computeVertexNormals();
    return faceted;
  },
};

/** A profile from its lowest point up, which makes the surface face outwards. @param {number[][]} profile */
const upwards = (profile) => (profile[0][1] <= profile.at(-1)[1] ? profile : [...profile].reverse());

const AROUND = 32; // facets of a solid of revolution
const CREASE = 0.75; // [rad] a bend that is sharper than this stays an edge

/** Whether no two faces that meet in a vertex bend by more than a crease. @param {THREE.BufferGeometry} mesh with the mean normals */
function isSmooth(mesh) {
  const { position, normal } = mesh.attributes;
  const [a, b, c, face, mean] = Array.from({ length: 5 }, () => new THREE.Vector3());
  const least = Math.cos(CREASE / 2);
  for (let at = 0; at < mesh.index.count; at += 3) {
    const corners = [0, 1, 2].map((corner) => mesh.index.getX(at + corner));
    [a, b, c].forEach((place, corner) => place.fromBufferAttribute(position, corners[corner]));
    face.crossVectors(b.sub(a), c.sub(a));
    const length = face.length();
    if (corners.some((corner) => face.dot(mean.fromBufferAttribute(normal, corner)) < least * length)) return false;
  }
  return true;
}

/** A solid of revolution that is smooth but for its edges, and round where it meets its axis. @param {number[][]} profile */
function revolution(profile) {
  const rings = ringsOf(profile);
  const positions = [];
  const normals = [];
  for (const { radius, y, out, up } of rings) {
    for (let side = 0; side <= AROUND; ++side) {
      const angle = (2 * Math.PI * side) / AROUND;
      positions.push(radius * Math.sin(angle), y, radius * Math.cos(angle));
      normals.push(out * Math.sin(angle), up, out * Math.cos(angle));
    }
  }
  const indices = [];
  for (let ring = 0; ring + 1 < rings.length; ++ring) {
    if (rings[ring].edge) continue;
    for (let side = 0; side < AROUND; ++side) {
      const a = ring * (AROUND + 1) + side;
      const above = a + AROUND + 1;
      indices.push(a, a + 1, above + 1, a, above + 1, above);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
  geometry.setIndex(indices);
  return geometry;
}

/** The rings of a profile with the normals of its surface. An `edge` is two rings at one place. @param {number[][]} profile */
function ringsOf(profile) {
  const slopes = profile.slice(1).map(([radius, y], at) => Math.atan2(profile[at][0] - radius, y - profile[at][1]));
  const rings = [];
  profile.forEach(([radius, y], at) => {
    const below = slopes[at - 1] ?? slopes[at];
    const above = slopes[at] ?? slopes[at - 1];
    const ring = (slope, edge = false) => rings.push({ radius, y, out: Math.cos(slope), up: Math.sin(slope), edge });
    if (Math.abs(above - below) > CREASE) {
      ring(below, true);
      ring(above);
    } else if (radius < 1e-9 && Math.abs(above) > Math.PI / 2 - CREASE) {
      ring(Math.sign(above) * (Math.PI / 2));
    } else {
      ring((below + above) / 2);
    }
  });
  return rings;
}

const shared = new Map();

/** Whether a shape can be drawn. @param {{type: string}} shape */
export const isKnown = (shape) => Object.hasOwn(BUILD, shape?.type);

/**
 * The geometry of a known shape. Meshes belong to the caller, who disposes of them; the others are shared for good.
 * @param {import("./types.js").Shape} shape @param {number} [detail] of spheres, relative to the usual
 * @returns {{geometry: THREE.BufferGeometry, owned: boolean}}
 */
export function geometryOf(shape, detail = 1) {
  if (shape.type === "mesh") return { geometry: finish(BUILD.mesh(shape)), owned: true };
  const key = JSON.stringify([shape, detail]);
  if (!shared.has(key)) shared.set(key, finish(BUILD[shape.type](shape, detail)));
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
