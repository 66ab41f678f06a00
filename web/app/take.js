// A Take: one animation ready to be drawn. Geometry is built once; motion is keyframe tracks that are interpolated.
import * as THREE from "../vendor/three.module.js";
import { geometryOf, isKnown, placeholder } from "./shapes.js";
import { lengthOf, trailOf } from "./trail.js";
import { framingOf } from "./framing.js";
import { Ground, isGround } from "./ground.js";
import { Reflection } from "./reflection.js";
import { storyOf } from "./story.js";
import { cageSurface, isLamp, isMarking, isShade, surfaceOf, trailSurface } from "./surfaces.js";

const FORMAT = "retake.keyframes/1";
const CROWD = 4; // with more movers than these, only the one that goes farthest leaves a trail
const MANY = 12; // with more movers than these, each is small and its roundness plainer
const MOST_CONTACTS = 240;
const FEW_CONTACTS = 24; // with more contacts than these, an arrow is only shown for a while
const ARROW_STAYS = 0.4; // [s]
const STIRRED = 0.01; // [m] from where it stood
const ROUNDING = 1e-6; // [s] to which keyframes tell times
const LEAD = 1; // [s] before a second body begins to move
const CONTACT_COLOR = "#cf3f2e";

export class Take {
  /** @param {import("./types.js").Keyframes} keyframes @param {{trailWidth?: number}} [look] relative to the usual */
  constructor(keyframes, { trailWidth = 1 } = {}) {
    this.duration = keyframes.duration;
    this.rate = keyframes.rate;
    this.events = [...(keyframes.events ?? [])].sort((a, b) => a.time - b.time);
    /** What happens in it, in words. */
    this.story = storyOf(keyframes);
    /** What the reader should know about what is shown. @type {string[]} */
    this.notes = keyframes.format === FORMAT ? [] : [`This page reads ${FORMAT}, not ${keyframes.format}.`];
    this.group = new THREE.Group();
    this.paths = new THREE.Group();
    this.ahead = new THREE.Group();
    this.group.add(this.paths, this.ahead);
    this.owned = [];
    this.movers = [];
    /** What stands still. @type {{mesh: THREE.Mesh, body: import("./types.js").Body}[]} */
    this.still = [];
    this.trails = [];
    const times = Float32Array.from({ length: keyframes.frames }, (_, frame) => frame / keyframes.rate);
    const unknown = new Set();
    for (const body of keyframes.bodies) this.#addBody(body, keyframes.tracks, times, unknown);
    if (unknown.size) {
      this.notes.push(`A cage stands in for what this page cannot draw: ${[...unknown].join(", ")}.`);
    }
    /** What a camera should show. @type {import("./framing.js").Framing} */
    this.framing = framingOf(this, keyframes.view);
    this.size = this.framing.box.getSize(new THREE.Vector3()).length();
    /** Where a reader who is short of time begins [s]. */
    this.opening = Math.max(0, this.#turningPoint() - LEAD);
    this.#addReflections();
    this.#addTrails(trailWidth);
    this.#addContacts();
  }

  /** The first mover on each track; others are parts of them. */
  get #leaders() {
    return this.movers.filter(({ body }, at) => this.movers.findIndex((other) => other.body.track === body.track) === at);
  }

  /** When a second body begins to move [s]; 0 if there is no such moment. */
  #turningPoint() {
    const stirs = this.#leaders.map(({ positions }) => {
      for (let at = 3; at < positions.length; at += 3) {
        const moved = Math.hypot(positions[at] - positions[0], positions[at + 1] - positions[1], positions[at + 2] - positions[2]);
        if (moved > STIRRED) return at / 3 / this.rate;
      }
      return Infinity;
    });
    const second = stirs.sort((a, b) => a - b)[1];
    return Number.isFinite(second) ? second : 0;
  }

  #addReflections() {
    const floors = this.still.filter(({ body }) => Reflection.isFloor(body));
    this.reflections = floors.map(({ mesh }) => new Reflection(mesh, this.movers, this.still));
    for (const reflection of this.reflections) {
      this.group.add(reflection);
      this.owned.push(reflection.window);
    }
  }

  #addBody(body, tracks, times, unknown) {
    const known = isKnown(body.shape);
    if (!known) unknown.add(`“${body.shape?.type}” (${body.name})`);
    const detail = tracks.length > MANY ? 0.5 : 1;
    const { geometry, owned } = known ? geometryOf(body, detail) : { geometry: placeholder(), owned: true };
    if (owned) this.owned.push(geometry);
    if (isGround(body)) return this.#addGround(body, geometry);
    const mesh = new THREE.Mesh(geometry, known ? surfaceOf(body) : cageSurface);
    mesh.name = body.name;
    const solid = known && !isLamp(body) && !isShade(body);
    mesh.castShadow = solid && !isMarking(body);
    mesh.receiveShadow = solid;
    this.group.add(mesh);
    if (body.track === undefined) {
      this.still.push({ mesh, body });
      return stand(mesh, body);
    }
    const { position, rotation, from = 0 } = tracks[body.track];
    const moves = new THREE.VectorKeyframeTrack(".position", times, position);
    const turns = new THREE.QuaternionKeyframeTrack(".quaternion", times, rotation);
    this.movers.push({
      body,
      mesh,
      from,
      positions: moves.values,
      position: moves.createInterpolant(new Float32Array(3)),
      rotation: turns.createInterpolant(new Float32Array(4)),
    });
  }

  #addGround(body, geometry) {
    const ground = new Ground(body, geometry);
    ground.mesh.name = body.name;
    stand(ground.mesh, body);
    this.group.add(ground.mesh);
    this.still.push({ mesh: ground.mesh, body });
    /** The ground whose bumps are lit, if there is one. @type {Ground|undefined} */
    this.ground = ground;
  }

  #addTrails(width) {
    const leaders = this.#leaders;
    const most = leaders.length > CROWD ? 1 : leaders.length;
    const radius = (leaders.length > 1 ? 0.0016 : 0.0032) * this.size * width;
    const trails = leaders.map(({ body, positions }) => ({ body, positions, length: lengthOf(positions) }));
    trails.sort((a, b) => b.length - a.length);
    for (const { body, positions, length } of trails.slice(0, most)) {
      if (length < 0.02 * this.size) continue;
      const { geometry, indexCountAt } = trailOf(positions, radius);
      this.owned.push(geometry);
      const mesh = new THREE.Mesh(geometry, trailSurface(body.color));
      // The same tube once more in full: where the body is going to be.
      const whole = new THREE.BufferGeometry().setAttribute("position", geometry.getAttribute("position")).setIndex(geometry.index);
      this.owned.push(whole);
      const faint = new THREE.Mesh(whole, trailSurface(body.color, true));
      mesh.userData.color = faint.userData.color = body.color;
      faint.userData.faint = true;
      this.paths.add(mesh);
      this.ahead.add(faint);
      this.trails.push({ mesh, indexCountAt });
    }
  }

  /** An arrow for each contact, along its normal: the harder, the longer. A contact without a place has none. */
  #addContacts() {
    const placed = this.events.filter((event) => event.position && event.normal).slice(0, MOST_CONTACTS);
    if (!placed.length) return;
    const hardest = Math.max(...placed.map((event) => event.impulse ?? 0), 1e-9);
    const hardness = (event) => Math.sqrt((event.impulse ?? 0) / hardest);
    const geometry = arrow();
    this.owned.push(geometry);
    this.contacts = new THREE.InstancedMesh(geometry, trailSurface(CONTACT_COLOR), placed.length);
    this.contacts.userData.color = CONTACT_COLOR;
    this.contacts.frustumCulled = false;
    this.contactTimes = placed.map((event) => event.time);
    const upright = new THREE.Vector3(0, 1, 0);
    const few = placed.length <= FEW_CONTACTS;
    this.arrowStays = few ? Infinity : ARROW_STAYS;
    this.arrows = placed.map((event) => {
      const length = this.size * (few ? 0.02 + 0.14 * hardness(event) : 0.01 + 0.1 * hardness(event));
      const turn = new THREE.Quaternion().setFromUnitVectors(upright, new THREE.Vector3().fromArray(event.normal).normalize());
      const place = new THREE.Vector3().fromArray(event.position);
      return new THREE.Matrix4().compose(place, turn, new THREE.Vector3(length, length, length));
    });
    this.group.add(this.contacts);
  }

  /**
   * Puts every body where it is at `time` [s].
   * @param {number} time @param {{path?: boolean, contacts?: boolean, color?: string}} [shown] `contacts` adds arrows and
   *   what is ahead; `color` names what the ground is coloured by
   */
  pose(time, { path = true, contacts = false, color = "" } = {}) {
    const t = Math.min(Math.max(time, 0), this.duration);
    for (const { mesh, from, position, rotation } of this.movers) {
      mesh.visible = t >= from - ROUNDING;
      mesh.position.fromArray(position.evaluate(t));
      mesh.quaternion.fromArray(rotation.evaluate(t)).normalize();
    }
    this.ground?.colorBy(color);
    this.paths.visible = path;
    this.ahead.visible = path && contacts;
    for (const reflection of this.reflections) reflection.follow();
    if (this.contacts) {
      this.contacts.visible = path && contacts;
      const shown = this.arrows.filter((_, at) => this.contactTimes[at] <= t + 1e-6 && this.contactTimes[at] >= t - this.arrowStays);
      shown.forEach((arrow, at) => this.contacts.setMatrixAt(at, arrow));
      this.contacts.count = shown.length;
      this.contacts.instanceMatrix.needsUpdate = true;
    }
    const frame = Math.round(t * this.rate);
    for (const { mesh, indexCountAt } of this.trails) {
      mesh.geometry.setDrawRange(0, indexCountAt[Math.min(frame, indexCountAt.length - 1)]);
    }
  }

  /** Takes the colours of the present theme. */
  wearTheme() {
    const lines = [...this.paths.children, ...this.ahead.children, ...(this.contacts ? [this.contacts] : [])];
    for (const mesh of lines) mesh.material = trailSurface(mesh.userData.color, mesh.userData.faint);
  }

  /** Frees what the graphics card holds for this take alone. */
  dispose() {
    for (const geometry of this.owned) geometry.dispose();
    this.contacts?.dispose();
  }
}

/** Puts a body without a track where it stands. @param {THREE.Mesh} mesh @param {import("./types.js").Body} body */
function stand(mesh, body) {
  mesh.position.fromArray(body.position ?? [0, 0, 0]);
  mesh.quaternion.fromArray(body.rotation ?? [0, 0, 0, 1]);
  mesh.updateMatrixWorld();
}

/** An arrow of length 1 along +y. */
function arrow() {
  const outline = [[0, 0], [0.018, 0], [0.018, 0.72], [0.065, 0.72], [0, 1]];
  return new THREE.LatheGeometry(outline.map(([radius, y]) => new THREE.Vector2(radius, y)), 12);
}
