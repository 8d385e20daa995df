// The 2D maps: horizontal images.
import * as THREE from './three/build/three.module.js';

const OCCUPIED = 0, FREE = 1;  // values, as in view_update.hpp
const CLEAR = [0, 0, 0, 0];
const LIFT_M = 0.05;  // height of the 2D map above the floor

// Colours of the images of a map, the lowest first: [red, green, blue, opacity] of a value.
// Obstacles have an image of their own, so that no free space of another robot covers them.
const IMAGES = [
  (value) => (value === FREE ? [232, 236, 242, 190] : CLEAR),
  (value) => (value === OCCUPIED ? [4, 6, 10, 255] : CLEAR),
];

function textureOf({width, height, runs}, colorOf) {
  const pixels = new Uint32Array(width * height);
  for (let i = 0, cell = 0; i < runs.length; cell += runs[i], i += 2)
    pixels.fill(
        new Uint32Array(new Uint8Array(colorOf(runs[i + 1])).buffer)[0], cell, cell + runs[i]);
  return new THREE.DataTexture(new Uint8Array(pixels.buffer), width, height, THREE.RGBAFormat);
}

function build(message) {
  const {width, height, resolution_m, origin: [x, y, z]} = message;
  const [dx, dy] = [width * resolution_m, height * resolution_m];
  const lift = z + LIFT_M;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute(
      'position',
      new THREE.Float32BufferAttribute(
          [x, y, lift, x + dx, y, lift, x, y + dy, lift, x + dx, y + dy, lift], 3));
  geometry.setAttribute('uv', new THREE.Float32BufferAttribute([0, 0, 1, 0, 0, 1, 1, 1], 2));
  geometry.setIndex([0, 1, 2, 2, 1, 3]);
  return IMAGES.map((colorOf, i) => {
    const object = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({
      map: textureOf(message, colorOf),
      transparent: true,
      depthWrite: false,
      side: THREE.DoubleSide
    }));
    object.matrixAutoUpdate = false;
    object.renderOrder = i - IMAGES.length;  // below all lines
    return object;
  });
}

export class RasterLayer {
  constructor() { this.shown = new Map(); }  // message -> its objects

  /** Shows the rasters of the layers that are on, in the places place(anchor, robot). */
  sync(model, layers, place) {
    const wanted = new Set();
    for (const robot of model.robots.values())
      for (const message of robot.rasters.values())
        if (layers[message.layer]) wanted.add(message);
    for (const [message, objects] of this.shown) {
      if (wanted.has(message)) continue;
      for (const object of objects) {
        object.parent?.remove(object);
        object.geometry.dispose();
        object.material.map.dispose();
        object.material.dispose();
      }
      this.shown.delete(message);
    }
    for (const message of wanted) {
      if (!this.shown.has(message)) this.shown.set(message, build(message));
      const {group, T} = place(message.anchor, message.robot);
      for (const object of this.shown.get(message)) {
        if (object.parent !== group) group.add(object);
        object.matrix.copy(T ?? new THREE.Matrix4());
        object.matrixWorldNeedsUpdate = true;
      }
    }
  }
}
