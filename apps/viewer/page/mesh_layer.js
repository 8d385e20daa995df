// The meshes: neighbouring chunks of a robot are drawn as one object.
import {robotColor} from './charts.js';
import * as THREE from './three/build/three.module.js';

const BUILD_MS = 25;      // time per frame for building new objects
const BATCH_CELLS = 4;    // cells per object along an axis
const MAX_INDEX = 65535;  // largest index of a vertex, and largest position in steps

// Smooth normals, -127 to 127, in four bytes a vertex: WebGL is faster with aligned data.
function normalsOf(positions, triangles) {
  const sums = new Float32Array(positions.length);
  for (let i = 0; i < triangles.length; i += 3) {
    const a = 3 * triangles[i], b = 3 * triangles[i + 1], c = 3 * triangles[i + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1],
          uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1],
          vz = positions[c + 2] - positions[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const k of [a, b, c]) {
      sums[k] += nx;
      sums[k + 1] += ny;
      sums[k + 2] += nz;
    }
  }
  const normals = new Int8Array((positions.length / 3) * 4);
  for (let i = 0, k = 0; i < sums.length; i += 3, k += 4) {
    const scale = 127 / (Math.hypot(sums[i], sums[i + 1], sums[i + 2]) || 1);
    normals[k] = sums[i] * scale;
    normals[k + 1] = sums[i + 1] * scale;
    normals[k + 2] = sums[i + 2] * scale;
  }
  return normals;
}

// Colours of labels without a palette, with evenly spread hues.
function anyColor(label) {
  const color = new THREE.Color().setHSL((label * 0.618034) % 1, label ? 0.45 : 0, 0.58);
  return [color.r * 255, color.g * 255, color.b * 255];
}

// Largest coordinate along each axis, in steps.
function reachOf({positions, origin}) {
  const most = [0, 0, 0];
  for (let i = 0; i < positions.length; ++i)
    if (positions[i] > most[i % 3]) most[i % 3] = positions[i];
  return most.map((x, axis) => x + origin[axis]);
}

export class MeshLayer {
  constructor() {
    this.batches = new Map();  // by key: {messages, objects, faces, stale, anchor, of, team}
    this.shown = new Map();    // message -> its batch
    this.mode = 'labels';
    this.usesTeam = false;
    this.palette = new Map();  // label -> {name, color}
    this.labels = new Set();   // labels seen so far
    const lit = (settings) => new THREE.MeshLambertMaterial(settings);
    this.materials = {
      labels: lit({vertexColors: THREE.VertexColors}),
      normals: new THREE.MeshNormalMaterial(),
      robots: new Map(),
    };
    this.lit = lit;
  }

  setPalette(classes) {
    for (const {id, name, color} of classes) this.palette.set(id, {name, color});
    this.colors = Array.from({length: 256}, (_, id) => this.palette.get(id)?.color ?? anyColor(id));
  }

  colorOf(label) { return this.colors[label]; }

  nameOf(label) { return (this.palette.get(label)?.name ?? `label ${label}`).replaceAll('_', ' '); }

  /** Number of faces of the meshes of the robots, or of the fused mesh in mode 'team'. */
  get faces() {
    let faces = 0;
    for (const batch of this.batches.values())
      if (batch.team === (this.mode === 'team')) faces += batch.faces;
    return faces;
  }

  material(of, labelled) {
    if (this.mode === 'normals') return this.materials.normals;
    if (['labels', 'colors', 'team'].includes(this.mode) && labelled) return this.materials.labels;
    const {robots} = this.materials;
    if (!robots.has(of)) {
      const color = new THREE.Color(robotColor(of)).lerp(new THREE.Color('#c8ccd2'), 0.35);
      robots.set(of, this.lit({color}));
    }
    return robots.get(of);
  }

  objects() { return [...this.batches.values()].flatMap((batch) => batch.objects); }

  setMode(mode) {
    this.mode = mode;
    this.usesTeam ||= mode === 'team';  // The fused mesh is built when it is first shown.
    for (const batch of this.batches.values())
      for (const object of batch.objects) this.dress(object, batch);
  }

  dress(object, {of, team}) {
    object.visible = this.mode !== 'off' && team === (this.mode === 'team');
    if (!object.visible) return;
    const {geometry} = object, {tints, labels} = object.userData;
    const colors = (this.mode === 'colors' ? tints : labels) ?? tints ?? labels;
    if (colors) geometry.setAttribute('color', colors);
    object.material = this.material(of, !!colors);
  }

  // One object for chunks with at most MAX_INDEX + 1 vertices together.
  build(messages, batch) {
    const sum = (valueOf) => messages.reduce((all, message) => all + valueOf(message), 0);
    const vertices = sum((m) => m.vertices), labelled = messages.some((m) => m.labels);
    const base = [0, 1, 2].map((axis) => Math.min(...messages.map((m) => m.origin[axis])));
    const fits = messages.every((m) => m.reach.every((x, axis) => x - base[axis] <= MAX_INDEX));
    const positions = new (fits ? Uint16Array : Float32Array)(3 * vertices);
    const normals = new Int8Array(4 * vertices);
    const colors = labelled ? new Uint8Array(4 * vertices) : null;
    const tints = messages.some((m) => m.tints) ? new Uint8Array(4 * vertices) : null;
    const triangles = new Uint16Array(3 * sum((m) => m.faces));
    let first = 0, at = 0;
    for (const message of messages) {
      const [x, y, z] = message.origin.map((o, axis) => o - base[axis]);
      const {positions: own} = message;
      for (let i = 0, k = 3 * first; i < own.length; i += 3, k += 3) {
        positions[k] = own[i] + x;
        positions[k + 1] = own[i + 1] + y;
        positions[k + 2] = own[i + 2] + z;
      }
      normals.set(normalsOf(own, message.triangles), 4 * first);
      message.labels?.forEach((label, i) => {
        colors.set(this.colors[label], 4 * (first + i));
        this.labels.add(label);
      });
      message.tints?.forEach((c, i) => {
        tints.set([(c >> 11) * 8.2, ((c >> 5) & 63) * 4.05, (c & 31) * 8.2], 4 * (first + i));
      });
      for (const index of message.triangles) triangles[at++] = first + index;
      first += message.vertices;
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(positions, 3));
    geometry.setAttribute('normal', new THREE.BufferAttribute(normals, 4, true));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    const object = new THREE.Mesh(geometry);
    object.matrixAutoUpdate = false;
    const attribute = (values) => values && new THREE.BufferAttribute(values, 4, true);
    object.userData = {labels: attribute(colors), tints: attribute(tints)};
    const s = messages[0].step_m;
    object.userData.own =
        new THREE.Matrix4().makeScale(s, s, s).setPosition(...base.map((x) => s * x));
    this.dress(object, batch);
    return object;
  }

  rebuild(batch) {
    for (const object of batch.objects) {
      object.parent?.remove(object);
      object.geometry.dispose();
    }
    batch.objects = [];
    batch.faces = 0;
    batch.stale = false;
    let part = [], vertices = 0;
    const finish = () => part.length && batch.objects.push(this.build(part, batch));
    for (const message of batch.messages) {
      if (vertices + message.vertices > MAX_INDEX + 1) {
        finish();
        part = [];
        vertices = 0;
      }
      part.push(message);
      vertices += message.vertices;
      batch.faces += message.faces;
    }
    finish();
  }

  batchOf({of, team = false, anchor, step_m, cell}) {
    const key = [of, team, anchor, step_m, ...cell.map((c) => Math.floor(c / BATCH_CELLS))].join();
    if (!this.batches.has(key))
      this.batches.set(
          key, {messages: new Set(), objects: [], faces: 0, stale: true, anchor, of, team});
    return this.batches.get(key);
  }

  // Adds new chunks to their batches, and removes old ones.
  sort(model) {
    const wanted = new Set();
    for (const robot of model.robots.values())
      for (const meshes of this.usesTeam ? [robot.meshes, robot.teamMeshes] : [robot.meshes])
        for (const message of meshes.values()) wanted.add(message);
    for (const [message, batch] of this.shown) {
      if (wanted.has(message)) continue;
      batch.messages.delete(message);
      batch.stale = true;
      this.shown.delete(message);
    }
    for (const message of wanted) {
      if (this.shown.has(message)) continue;
      message.reach ??= reachOf(message);
      const batch = this.batchOf(message);
      batch.messages.add(message);
      batch.stale = true;
      this.shown.set(message, batch);
    }
  }

  /** Shows the present meshes of the robots, in the groups groupOf(anchor, robot); true if more is
   * to be built. */
  sync(model, groupOf) {
    this.sort(model);
    const until = performance.now() + BUILD_MS;
    let more = false;
    for (const [key, batch] of this.batches) {
      if (batch.stale && performance.now() < until) this.rebuild(batch);
      more ||= batch.stale;
      if (!batch.stale && !batch.messages.size) this.batches.delete(key);
      const {group, T} = groupOf(batch.anchor, batch.of);
      for (const object of batch.objects) {
        if (object.parent !== group) group.add(object);
        object.matrix.copy(object.userData.own);
        if (T) object.matrix.premultiply(T);
      }
    }
    return more;
  }

  /** Nearest intersection of the ray with a mesh, or null. */
  pick(raycaster) {
    const hits = raycaster.intersectObjects(this.objects().filter((object) => object.visible));
    return hits.length ? hits[0].point : null;
  }
}
