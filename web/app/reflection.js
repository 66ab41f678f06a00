// What a varnished floor shows of the bodies above it: their mirror images, drawn before the floor and through it.
import * as THREE from "../vendor/three.module.js";
import { MIRROR, imageSurface, windowSurface } from "./look.js";

/** Drawn first: the window into the mirror, then the images in it, then the floor over them, then all else. */
const ORDER = { window: -3, images: -2, floor: -1 };

export class Reflection extends THREE.Group {
  /** @param {THREE.Mesh} floor a level box @param {{mesh: THREE.Mesh, body: import("./types.js").Body}[]} movers */
  constructor(floor, movers) {
    super();
    const { min, max } = new THREE.Box3().setFromObject(floor);
    this.window = new THREE.PlaneGeometry(max.x - min.x, max.z - min.z).rotateX(-Math.PI / 2);
    const window = new THREE.Mesh(this.window, windowSurface);
    window.position.set((min.x + max.x) / 2, max.y, (min.z + max.z) / 2);
    window.renderOrder = ORDER.window;
    floor.renderOrder = ORDER.floor;
    this.images = movers.map(({ mesh, body }) => {
      const image = new THREE.Mesh(mesh.geometry, imageSurface(body));
      image.renderOrder = ORDER.images;
      return { image, mesh };
    });
    const mirrored = new THREE.Group();
    mirrored.scale.y = -1;
    mirrored.position.y = 2 * max.y;
    mirrored.add(...this.images.map(({ image }) => image));
    this.add(window, mirrored);
  }

  /** Whether a body is a floor that mirrors. @param {import("./types.js").Body} body */
  static isFloor(body) {
    const [x = 0, y = 0, z = 0] = body.rotation ?? [];
    return MIRROR.has(body.name) && body.shape?.type === "box" && body.track === undefined && !x && !y && !z;
  }

  /** Follows the bodies to where they are now. */
  follow() {
    for (const { image, mesh } of this.images) {
      image.visible = mesh.visible;
      image.position.copy(mesh.position);
      image.quaternion.copy(mesh.quaternion);
    }
  }
}
