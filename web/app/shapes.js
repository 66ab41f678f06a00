// Geometry of the shapes that a keyframe document may hold, each built once and shared.
import * as THREE from "../vendor/three.module.js";
import { isLaid, isMarking, isShade, surfaceName } from "./surfaces.js";

/** @type {Object<string, (shape: any, detail?: number) => THREE.BufferGeometry>} */
const BUILD = {
  sphere: ({ radius }, detail) => new THREE.SphereGeometry(radius, 48 * detail, 32 * detail),
  "eased box": easedBox,
  slices,
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

const SLICES = 28; // of a box of shade, along x
const DENSER = 1.6; // power by which they stand denser where it begins
const EASE = 0.42; // radius of an eased edge, share of half the box's shortest side
const EASE_PARTS = 2; // of the eighth of a circle that each side has of an edge
const PANEL = 3; // a box that is less than so many times as long as it is wide shows its grain twice along it

/** Slices of a box, across x: what lies deep in it is seen through many of them. */
function slices({ half_extents: [x, y, z] }) {
  const positions = [];
  const indices = [];
  for (let slice = 0; slice < SLICES; ++slice) {
    const at = x * (2 * ((slice + 0.5) / SLICES) ** DENSER - 1);
    const first = positions.length / 3;
    positions.push(at, -y, -z, at, -y, z, at, y, z, at, y, -z);
    indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  geometry.setIndex(indices);
  return geometry;
}

/** A box whose edges have been taken off, as a joiner does, with its grain along its longest side. */
function easedBox({ half_extents: half }) {
  const ease = EASE * Math.min(...half);
  const sides = half.map((extent) => {
    const core = extent - ease;
    const line = (part) => core + ease * Math.tan((Math.PI / 4) * (part / EASE_PARTS));
    const beyond = Array.from({ length: EASE_PARTS + 1 }, (_, part) => line(part));
    return [...beyond.map((at) => -at).reverse(), ...beyond];
  });
  const order = [0, 1, 2].sort((a, b) => half[b] - half[a]);
  const repeats = half[order[0]] < PANEL * half[order[1]] ? 2 : 1;
  const positions = [];
  const normals = [];
  const uvs = [];
  const indices = [];
  for (const axis of [0, 1, 2]) {
    for (const side of [-1, 1]) {
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      const [along, across] = half[u] >= half[v] ? [u, v] : [v, u];
      const first = positions.length / 3;
      for (const atU of sides[u]) {
        for (const atV of sides[v]) {
          const place = new THREE.Vector3().setComponent(axis, side * half[axis]).setComponent(u, atU).setComponent(v, atV);
          const core = half.map((extent, at) => THREE.MathUtils.clamp(place.getComponent(at), ease - extent, extent - ease));
          const inner = new THREE.Vector3().fromArray(core);
          const normal = place.clone().sub(inner).normalize();
          positions.push(...inner.addScaledVector(normal, ease).toArray());
          normals.push(...normal.toArray());
          const scale = repeats / (2 * half[order[0]]);
          uvs.push(place.getComponent(along) * scale, place.getComponent(across) * scale + 0.37 * axis);
        }
      }
      const width = sides[v].length;
      for (let i = 0; i + 1 < sides[u].length; ++i) {
        for (let j = 0; j + 1 < width; ++j) {
          const [a, b, c, d] = [0, width, width + 1, 1].map((step) => first + i * width + j + step);
          indices.push(...(side > 0 ? [a, b, c, a, c, d] : [a, c, b, a, d, c]));
        }
      }
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
  geometry.setAttribute("uv", new THREE.Float32BufferAttribute(uvs, 2));
  geometry.setIndex(indices);
  return geometry;
}

/** Which geometry a body has; its surface says whether a box is sharp, eased, or nothing but shade. */
function buildOf(body) {
  if (body.shape.type !== "box") return body.shape.type;
  if (isShade(body)) return "slices";
  return isLaid(body) || isMarking(body) || surfaceName(body) === "plain" ? "box" : "eased box";
}

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
const TYPES = new Set(["sphere", "box", "cylinder", "revolution", "mesh"]);

/** Whether a shape can be drawn. @param {{type: string}} shape */
export const isKnown = (shape) => TYPES.has(shape?.type);

/**
 * The geometry of a body of a known shape. Meshes belong to the caller, who disposes of them; the others are shared for good.
 * @param {import("./types.js").Body} body @param {number} [detail] of spheres, relative to the usual
 * @returns {{geometry: THREE.BufferGeometry, owned: boolean}}
 */
export function geometryOf(body, detail = 1) {
  const { shape } = body;
  if (shape.type === "mesh") return { geometry: finish(BUILD.mesh(shape)), owned: true };
  const build = buildOf(body);
  const key = JSON.stringify([build, shape, detail]);
  if (!shared.has(key)) shared.set(key, finish(BUILD[build](shape, detail)));
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
