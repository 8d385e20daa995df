// The meshes: one object per chunk, whose arrays are those that came over the network.
import {robotColor} from './charts.js';
import * as THREE from './three/build/three.module.js';

const BUILD_MS = 25;  // of a frame, for chunks that are new

// Smooth normals, -127 to 127, four bytes a vertex: WebGL likes them aligned.
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

// Colours of labels without a palette: as far apart as hues get.
function anyColor(label) {
  const color = new THREE.Color().setHSL((label * 0.618034) % 1, label ? 0.45 : 0, 0.58);
  return [color.r * 255, color.g * 255, color.b * 255];
}

export class MeshLayer {
  constructor() {
    this.shown = new Map();  // message -> THREE.Mesh
    this.mode = 'labels';
    this.palette = new Map();  // label -> {name, color}
    this.labels = new Set();   // that have been seen
    const lit = (settings) => new THREE.MeshLambertMaterial(settings);
    this.materials = {
      labels: lit({vertexColors: THREE.VertexColors}),
      normals: new THREE.MeshNormalMaterial(),
      robots: new Map()
    };
    this.lit = lit;
  }

  setPalette(classes) {
    for (const {id, name, color} of classes) this.palette.set(id, {name, color});
    this.colors = Array.from({length: 256}, (_, id) => this.palette.get(id)?.color ?? anyColor(id));
  }

  colorOf(label) { return this.colors[label]; }

  material(message) {
    if (this.mode === 'normals') return this.materials.normals;
    if (this.mode === 'labels' && message.labels) return this.materials.labels;
    const {robots} = this.materials;
    if (!robots.has(message.of)) {
      const color = new THREE.Color(robotColor(message.of)).lerp(new THREE.Color('#c8ccd2'), 0.35);
      robots.set(message.of, this.lit({color}));
    }
    return robots.get(message.of);
  }

  setMode(mode) {
    this.mode = mode;
    for (const [message, mesh] of this.shown) {
      mesh.visible = mode !== 'off';
      if (mesh.visible) mesh.material = this.material(message);
    }
  }

  build(message) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(message.positions, 3));
    geometry.setAttribute(
        'normal',
        new THREE.BufferAttribute(normalsOf(message.positions, message.triangles), 4, true));
    if (message.labels) {
      const colors = new Uint8Array(4 * message.labels.length);
      message.labels.forEach((label, i) => {
        colors.set(this.colors[label], 4 * i);
        this.labels.add(label);
      });
      geometry.setAttribute('color', new THREE.BufferAttribute(colors, 4, true));
    }
    geometry.setIndex(new THREE.BufferAttribute(message.triangles, 1));
    const mesh = new THREE.Mesh(geometry, this.material(message));
    mesh.visible = this.mode !== 'off';
    mesh.matrixAutoUpdate = false;
    return mesh;
  }

  /**
   * Shows what robots know now; groupOf(message) says where. True if there is more to build in a
   * next call.
   */
  sync(model, groupOf) {
    const wanted = new Set();
    for (const robot of model.robots.values())
      for (const message of robot.meshes.values()) wanted.add(message);
    for (const [message, mesh] of this.shown)
      if (!wanted.has(message)) {
        mesh.parent?.remove(mesh);
        mesh.geometry.dispose();
        this.shown.delete(message);
      }
    const until = performance.now() + BUILD_MS;
    let more = false;
    for (const message of wanted) {
      let mesh = this.shown.get(message);
      if (!mesh) {
        if (performance.now() > until) {
          more = true;
          continue;
        }
        mesh = this.build(message);
        this.shown.set(message, mesh);
      }
      const {group, T} = groupOf(message.anchor, message.of);
      if (mesh.parent !== group) group.add(mesh);
      const s = message.step_m, [x, y, z] = message.origin;
      mesh.matrix.makeScale(s, s, s).setPosition(s * x, s * y, s * z);
      if (T) mesh.matrix.premultiply(T);
    }
    return more;
  }

  /** Where the ray first meets a mesh, or null. */
  pick(raycaster) {
    const hits = this.mode === 'off' ? [] : raycaster.intersectObjects([...this.shown.values()]);
    return hits.length ? hits[0].point : null;
  }
}
