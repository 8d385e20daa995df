// The objects: boxes of lines in the colours of their classes, with names.
import * as THREE from './three/build/three.module.js';
import {WideLine} from './wide_line.js';

const MAX_LABELS = 40;
const LEAST_PX = 14;  // height of a box on the screen below which it has no label
const LABEL_PX = {
  height: 17,
  character: 6.6,
  edge: 12
};

const UP = new THREE.Vector3(0, 0, 1);
const CORNERS = [0, 1, 2, 3, 4, 5, 6, 7].map(
    (i) => new THREE.Vector3((i & 1) - 0.5, ((i >> 1) & 1) - 0.5, (i >> 2) - 0.5));
// Pairs of corners that differ along one axis.
const EDGES =
    CORNERS.flatMap((_, i) => [1, 2, 4].filter((bit) => !(i & bit)).map((bit) => [i, i | bit]));

export class ObjectLayer {
  constructor(overlay, resolution) {
    this.lines = new WideLine(
        {color: '#ffffff', vertexColors: THREE.VertexColors, linewidth: 1.8, resolution});
    this.boxes = [];  // drawn boxes: {name, size, robots, corners, top, T}
    this.drawn = '';  // state that is drawn
    this.labels = Array.from({length: MAX_LABELS}, () => {
      const label = document.createElement('div');
      label.className = 'object-label';
      label.hidden = true;
      return label;
    });
    overlay.append(...this.labels);
  }

  // The newest list in each place: {message, group, T}.
  static newest(model, place) {
    const lists = new Map();
    for (const robot of model.robots.values()) {
      if (!robot.objects || robot.lastReceived === null) continue;
      const at = place(robot.objects.anchor, robot.id), known = lists.get(at.group);
      if (!known || known.message.t <= robot.objects.t)
        lists.set(at.group, {...at, message: robot.objects});
    }
    return [...lists.values()];
  }

  /** Shows the objects in the places place(anchor, robot); `meshes` has the palette. */
  sync(model, on, place, meshes) {
    const lists = on ? ObjectLayer.newest(model, place) : [];
    const state = JSON.stringify(
        lists.map(({message, group, T}) => [message.n, group.position, T?.elements]));
    if (state === this.drawn) return;
    this.drawn = state;
    this.boxes = lists.flatMap(({message, group, T}) => {
      const frame = new THREE.Matrix4().makeTranslation(...group.position.toArray());
      if (T) frame.multiply(T);
      return message.objects.map((object) => this.boxOf(object, frame, meshes));
    });
    this.boxes.sort((a, b) => b.volume - a.volume);
    const colors = this.boxes.flatMap(({color}) => EDGES.flatMap(() => [...color, ...color]));
    this.lines.set(
        this.boxes.flatMap(
            ({corners}) =>
                EDGES.flatMap(([a, b]) => [...corners[a].toArray(), ...corners[b].toArray()])),
        colors.map((c) => c / 255));
  }

  boxOf([label, centre, yaw, size, robots], frame, meshes) {
    const own = new THREE.Matrix4().compose(
        new THREE.Vector3(...centre), new THREE.Quaternion().setFromAxisAngle(UP, yaw),
        new THREE.Vector3(...size.map((s) => Math.max(s, 1e-3))));
    const T = frame.clone().multiply(own);  // from the unit cube
    return {
      name: meshes.nameOf(label),
      color: meshes.colorOf(label),
      size,
      robots,
      volume: size[0] * size[1] * size[2],
      T,
      corners: CORNERS.map((corner) => corner.clone().applyMatrix4(T)),
      top: new THREE.Vector3(0, 0, 0.5).applyMatrix4(T),
    };
  }

  /** Places the names of the largest boxes without overlap; onScreen(point): [x, y] or null. */
  placeLabels(onScreen) {
    const taken = [];
    for (const box of this.boxes) {
      const at = onScreen(box.top);
      if (!at || taken.length === this.labels.length) continue;
      const ys = box.corners.map((corner) => onScreen(corner)?.[1] ?? at[1]);
      if (Math.max(...ys) - Math.min(...ys) < LEAST_PX) continue;
      const half = (LABEL_PX.character * box.name.length + LABEL_PX.edge) / 2;
      const overlaps = (other) => Math.abs(other.at[0] - at[0]) < other.half + half &&
          Math.abs(other.at[1] - at[1]) < LABEL_PX.height;
      if (!taken.some(overlaps)) taken.push({box, at, half});
    }
    this.labels.forEach((label, i) => {
      label.hidden = i >= taken.length;
      if (label.hidden) return;
      const {box: {name, color}, at: [x, y]} = taken[i];
      label.textContent = name;
      label.style.setProperty('--object', `rgb(${color.map(Math.round)})`);
      label.style.transform =
          `translate(${x.toFixed(1)}px, ${(y - LABEL_PX.height).toFixed(1)}px) translate(-50%, 0)`;
    });
  }

  /** The nearest box on a ray that begins outside it, or null. */
  at(ray) {
    const cube =
        new THREE.Box3(new THREE.Vector3(-0.5, -0.5, -0.5), new THREE.Vector3(0.5, 0.5, 0.5));
    let nearest = null, least = Infinity;
    for (const box of this.boxes) {
      const local = ray.clone().applyMatrix4(new THREE.Matrix4().getInverse(box.T));
      if (cube.containsPoint(local.origin)) continue;
      const point = local.intersectBox(cube, new THREE.Vector3());
      const distance = point?.applyMatrix4(box.T).distanceTo(ray.origin) ?? Infinity;
      if (distance < least) [nearest, least] = [box, distance];
    }
    return nearest;
  }
}
