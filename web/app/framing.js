// Where the camera stands: where the world says, else chosen from what moves, and where.
import * as THREE from "../vendor/three.module.js";
import { isMarking } from "./surfaces.js";

/** @typedef {{box: THREE.Box3, azimuth: number, elevation: number}} Framing angles in radians; azimuth 0 looks along -z */

export const FIELD_OF_VIEW = 26; // degrees: a long lens, so that distances read true
const MARGIN = 1.09;
const FLAT = 0.02;
const LONG = 5;
const FARTHEST = 1.5; // a shared camera stands at most so many times as far away as the nearest one would

/** The framing of one take: what its world asks for, else chosen. @param {import("./take.js").Take} take
 * @param {import("./types.js").Viewpoint} [view] @returns {Framing} */
export function framingOf(take, view) {
  const asked = framingOfView(view);
  if (asked) return asked;
  const reach = new THREE.Box3();
  const centers = new THREE.Box3();
  const ball = new THREE.Sphere();
  for (const { mesh, positions } of take.movers) {
    for (let frame = 0; frame < positions.length; frame += 3) {
      ball.center.fromArray(positions, frame);
      centers.expandByPoint(ball.center);
      ball.radius = mesh.geometry.boundingSphere.radius;
      reach.union(ball.getBoundingBox(new THREE.Box3()));
    }
  }
  const { still } = take;
  if (reach.isEmpty()) for (const { mesh } of still) reach.union(new THREE.Box3().setFromObject(mesh));
  if (reach.isEmpty()) reach.set(new THREE.Vector3(-1, -1, -1), new THREE.Vector3(1, 1, 1));
  includeStill(reach, still);
  return { box: reach, ...direction(centers) };
}

/** The framing that a viewpoint asks for; null if it is none. @param {any} view @returns {Framing|null} */
function framingOfView(view) {
  const isPoint = (point) => Array.isArray(point) && point.length === 3 && point.every(Number.isFinite);
  if (!isPoint(view?.center) || !isPoint(view.half_extents)) return null;
  if (!Number.isFinite(view.azimuth) || !Number.isFinite(view.elevation) || Math.abs(view.elevation) >= Math.PI / 2) return null;
  if (Math.min(...view.half_extents) < 0 || Math.max(...view.half_extents) === 0) return null;
  const size = new THREE.Vector3().fromArray(view.half_extents).multiplyScalar(2);
  const box = new THREE.Box3().setFromCenterAndSize(new THREE.Vector3().fromArray(view.center), size);
  return { box, azimuth: view.azimuth, elevation: view.elevation };
}

/** Marks, and small still bodies near the motion, are part of the picture; large ones only where the motion is. */
function includeStill(reach, still) {
  const size = reach.getSize(new THREE.Vector3()).length();
  const near = reach.clone().expandByScalar(0.15 * size);
  for (const { mesh, body } of still) {
    const box = new THREE.Box3().setFromObject(mesh);
    const small = box.getSize(new THREE.Vector3()).length() < 0.8 * size;
    if (isMarking(body) || (small && near.intersectsBox(box))) reach.union(box);
  }
}

function direction(centers) {
  const { x, y, z } = centers.isEmpty() ? new THREE.Vector3(1, 1, 1) : centers.getSize(new THREE.Vector3());
  if (z <= FLAT * Math.max(x, y)) return { azimuth: 0, elevation: 0.19 };
  if (x <= FLAT * Math.max(y, z)) return { azimuth: Math.PI / 2, elevation: 0.19 };
  if (x > LONG * z) return { azimuth: -1.2, elevation: 0.3 };
  if (z > LONG * x) return { azimuth: 0.35, elevation: 0.3 };
  return { azimuth: 0.5, elevation: 0.5 };
}

/** Unit vector from what is looked at towards the camera. @param {number} azimuth @param {number} elevation */
export function towardsCamera(azimuth, elevation) {
  const flat = Math.cos(elevation);
  return new THREE.Vector3(Math.sin(azimuth) * flat, Math.sin(elevation), Math.cos(azimuth) * flat);
}

/**
 * The point to look at and the distance from it that show the whole box.
 * @param {Framing} framing @param {number} aspect width over height
 */
export function fit({ box, azimuth, elevation }, aspect) {
  const back = towardsCamera(azimuth, elevation);
  const right = new THREE.Vector3(Math.cos(azimuth), 0, -Math.sin(azimuth));
  const up = new THREE.Vector3().crossVectors(back, right);
  const target = box.getCenter(new THREE.Vector3());
  const corners = [];
  for (const x of [box.min.x, box.max.x]) {
    for (const y of [box.min.y, box.max.y]) {
      for (const z of [box.min.z, box.max.z]) {
        const offset = new THREE.Vector3(x, y, z).sub(target);
        corners.push([offset.dot(right), offset.dot(up), offset.dot(back)]);
      }
    }
  }
  const tallness = Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2)) / MARGIN;
  const wideness = tallness * aspect;
  let [x0, y0] = [0, 0];
  let distance = 0;
  // What is near is seen larger, so the middle of the picture is not the middle of the box.
  for (let round = 0; round < 4; ++round) {
    distance = Math.max(...corners.map(([x, y, z]) => z + Math.max(Math.abs(x - x0) / wideness, Math.abs(y - y0) / tallness)));
    const seen = (axis, middle) => corners.map((corner) => (corner[axis] - middle) / (distance - corner[2]));
    const shift = (places) => ((Math.min(...places) + Math.max(...places)) / 2) * distance;
    x0 += shift(seen(0, x0));
    y0 += shift(seen(1, y0));
  }
  target.addScaledVector(right, x0).addScaledVector(up, y0);
  return { target, distance };
}

/** What is looked at: all that is framed, or what a camera that was moved has before it.
 * @param {Framing} framing @param {{distance: number, target: THREE.Vector3}|null} [pose] */
export function lookedAt(framing, pose) {
  const sphere = framing.box.getBoundingSphere(new THREE.Sphere());
  if (pose) sphere.set(pose.target, Math.max(0.5 * sphere.radius, 1.5 * pose.distance * Math.tan(THREE.MathUtils.degToRad(FIELD_OF_VIEW / 2))));
  return sphere;
}

/** How many times as wide as high a framing is seen, from far away. @param {Framing} framing */
export function aspectOf({ box, azimuth, elevation }) {
  const { x, y, z } = box.getSize(new THREE.Vector3());
  const across = (one, other) => Math.abs(one * Math.cos(azimuth)) + Math.abs(other * Math.sin(azimuth));
  return across(x, z) / (y * Math.cos(elevation) + across(z, x) * Math.abs(Math.sin(elevation)));
}

export function newCamera() {
  return new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 1000);
}

/** Sets the camera. @param {{azimuth: number, elevation: number, distance: number, target: THREE.Vector3}} pose */
export function aimCamera(camera, pose, aspect) {
  camera.position.copy(pose.target).addScaledVector(towardsCamera(pose.azimuth, pose.elevation), pose.distance);
  camera.lookAt(pose.target);
  camera.aspect = aspect;
  camera.near = pose.distance / 100;
  camera.far = pose.distance * 20;
  camera.updateProjectionMatrix();
}

/**
 * One framing for all takes of a scenario, so that the same place is at the same place in every tile. It grows with
 * the takes; a take that would make all others too small keeps its own.
 */
export class SharedFraming {
  /** @param {number} aspect of the tiles */
  constructor(aspect) {
    this.aspect = aspect;
    this.framing = null;
    this.nearest = Infinity;
  }

  /** @param {Framing} framing @returns {boolean} whether the shared framing changed */
  admit(framing) {
    this.nearest = Math.min(this.nearest, fit(framing, this.aspect).distance);
    if (!this.framing) {
      this.framing = { ...framing, box: framing.box.clone() };
      return true;
    }
    const grown = this.framing.box.clone().union(framing.box);
    if (grown.equals(this.framing.box)) return false;
    if (fit({ ...this.framing, box: grown }, this.aspect).distance > FARTHEST * this.nearest) return false;
    this.framing.box = grown;
    return true;
  }

  /** The framing that a take is shown with. @param {Framing} framing */
  of(framing) {
    const slack = this.framing.box.clone().expandByScalar(1e-6);
    return slack.containsBox(framing.box) ? this.framing : framing;
  }
}
