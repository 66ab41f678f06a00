// What a varnished floor shows of the bodies above it: their mirror images, drawn before the floor and through it.
import * as THREE from "../vendor/three.module.js";
import { imageSurface, isMirror, windowSurface } from "./surfaces.js";

/** Drawn first: the window into the mirror, then the images in it, then the floor over them, then all else. */
const ORDER = { window: -3, images: -2, floor: -1 };

const CLEAR = 0.05; // [m] above the floor, to which what is mirrored must reach if it stands still

export class Reflection extends THREE.Group {
  /** @typedef {{mesh: THREE.Mesh, body: import("./types.js").Body}} Shown */
  /** @param {THREE.Mesh} floor a level box @param {Shown[]} movers @param {Shown[]} still what may stand or hang beside it */
  constructor(floor, movers, still) {
    super();
    const { min, max } = (this.floor = new THREE.Box3().setFromObject(floor));
    this.window = new THREE.PlaneGeometry(max.x - min.x, max.z - min.z).rotateX(-Math.PI / 2);
    const window = new THREE.Mesh(this.window, windowSurface);
    window.position.set((min.x + max.x) / 2, max.y, (min.z + max.z) / 2);
    window.renderOrder = ORDER.window;
    floor.renderOrder = ORDER.floor;
    const beside = still.filter(({ mesh }) => mesh !== floor && new THREE.Box3().setFromObject(mesh).max.y > max.y + CLEAR);
    const imageOf = ({ mesh, body }) => {
      const image = new THREE.Mesh(mesh.geometry, imageSurface(body));
      image.renderOrder = ORDER.images;
      put(image, mesh);
      return { image, mesh };
    };
    this.images = movers.map(imageOf);
    const mirrored = new THREE.Group();
    mirrored.scale.y = -1;
    mirrored.position.y = 2 * max.y;
    for (const { image } of [...this.images, ...beside.map(imageOf)]) mirrored.add(image);
    this.add(window, mirrored);
  }

  /** Whether a body is a floor that mirrors. @param {import("./types.js").Body} body */
  static isFloor(body) {
    const [x = 0, y = 0, z = 0] = body.rotation ?? [];
    return isMirror(body) && body.shape?.type === "box" && body.track === undefined && !x && !y && !z;
  }

  /** Follows the bodies to where they are now. What is not above the floor has no image: it may be out of sight. */
  follow() {
    const { min, max } = this.floor;
    for (const { image, mesh } of this.images) {
      const { x, z } = mesh.position;
      image.visible = mesh.visible && x >= min.x && x <= max.x && z >= min.z && z <= max.z;
      put(image, mesh);
    }
  }
}

function put(image, mesh) {
  image.position.copy(mesh.position);
  image.quaternion.copy(mesh.quaternion);
}
