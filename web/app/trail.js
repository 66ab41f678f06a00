// The path of a moving body as a thin tube, which can be shown up to a moment.
import * as THREE from "../vendor/three.module.js";

const SIDES = 6;
const STILL = 1e-4; // [m] moves shorter than this add nothing to see

/**
 * @param {ArrayLike<number>} positions 3 numbers a frame @param {number} radius [m]
 * @returns {{geometry: THREE.BufferGeometry, indexCountAt: Uint32Array}} how many indices show the path up to each frame
 */
export function trailOf(positions, radius) {
  const frames = positions.length / 3;
  const points = [];
  const ringOfFrame = new Uint32Array(frames);
  for (let frame = 0; frame < frames; ++frame) {
    const point = new THREE.Vector3().fromArray(positions, 3 * frame);
    const gap = points.length ? point.distanceTo(points.at(-1)) : Infinity;
    if (gap > Math.max(STILL, radius * 0.25)) {
      points.push(point);
    }
    ringOfFrame[frame] = points.length - 1;
  }
  const geometry = tube(points, radius);
  return { geometry, indexCountAt: ringOfFrame.map((ring) => ring * SIDES * 6) };
}

/** How far a path goes [m]. @param {ArrayLike<number>} positions 3 numbers a frame */
export function lengthOf(positions) {
  let length = 0;
  for (let at = 3; at < positions.length; at += 3) {
    length += Math.hypot(positions[at] - positions[at - 3], positions[at + 1] - positions[at - 2], positions[at + 2] - positions[at - 1]);
  }
  return length;
}

function tube(points, radius) {
  const rings = points.length;
  const vertices = new Float32Array(rings * SIDES * 3);
  const tangent = new THREE.Vector3();
  const across = new THREE.Vector3(0, 0, 1);
  const other = new THREE.Vector3();
  for (let ring = 0; ring < rings; ++ring) {
    tangent.subVectors(points[Math.min(ring + 1, rings - 1)], points[Math.max(ring - 1, 0)]);
    if (tangent.lengthSq() === 0) tangent.set(1, 0, 0);
    tangent.normalize();
    // The frame is carried along, so that the tube does not twist.
    across.addScaledVector(tangent, -across.dot(tangent));
    if (across.lengthSq() < 1e-8) across.set(tangent.y, tangent.z, tangent.x).cross(tangent);
    across.normalize();
    other.crossVectors(tangent, across);
    for (let side = 0; side < SIDES; ++side) {
      const angle = (2 * Math.PI * side) / SIDES;
      const at = 3 * (ring * SIDES + side);
      for (const [axis, name] of ["x", "y", "z"].entries()) {
        vertices[at + axis] = points[ring][name] + radius * (Math.cos(angle) * across[name] + Math.sin(angle) * other[name]);
      }
    }
  }
  const indices = [];
  for (let ring = 0; ring + 1 < rings; ++ring) {
    for (let side = 0; side < SIDES; ++side) {
      const a = ring * SIDES + side;
      const b = ring * SIDES + ((side + 1) % SIDES);
      indices.push(a, b, a + SIDES, b, b + SIDES, a + SIDES);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(vertices, 3));
  geometry.setIndex(indices);
  geometry.computeBoundingSphere();
  return geometry;
}
