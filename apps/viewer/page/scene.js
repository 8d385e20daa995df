// The 3D view: maps, trajectories, keyframes, closures and robots, in one or several frames.
import {robotColor} from './charts.js';
import {MeshLayer} from './mesh_layer.js';
import {ObjectLayer} from './object_layer.js';
import {RasterLayer} from './raster_layer.js';
import * as THREE from './three/build/three.module.js';
import {OrbitControls} from './three/examples/jsm/controls/OrbitControls.js';
import {WideLine} from './wide_line.js';

export const VERDICTS = {
  kept: {color: '#6fdc8c', text: 'Kept'},
  verified: {color: '#f2c94c', text: 'Verified'},
  candidate: {color: '#8d96a5', text: 'Open'},
  rejected: {color: '#ff6b6b', text: 'Rejected'},
};

const FRAME_GAP_M = 4;
const BUILDING_DRAW_MS = 400;
const EDGE_PX = 8;     // distance between a label and the edge
const LEGEND_PX = 80;  // height of the legend at the lower edge, with a label above it

function matrixOf([x, y, z, qx, qy, qz, qw], matrix = new THREE.Matrix4()) {
  return matrix.compose(
      new THREE.Vector3(x, y, z), new THREE.Quaternion(qx, qy, qz, qw), new THREE.Vector3(1, 1, 1));
}

// Lines from each pose to the next, except over holes. Poses may be missing.
function linesOf(robot, poses, stamps_s, matrix) {
  const points = [], a = new THREE.Vector3(), b = new THREE.Vector3();
  let last = -1;
  poses.forEach((pose, i) => {
    b.fromArray(pose);
    if (matrix) b.applyMatrix4(matrix);
    if (last >= 0 && !robot.hasHole(stamps_s[last], stamps_s[i]))
      points.push(a.x, a.y, a.z, b.x, b.y, b.z);
    a.copy(b);
    last = i;
  });
  return points;
}

// Objects that show one robot.
class RobotFigure {
  constructor(id, resolution) {
    const color = robotColor(id);
    this.group = new THREE.Group();
    this.optimized = new WideLine({color, linewidth: 3, resolution});
    this.odometry =
        new WideLine({color, linewidth: 1.4, resolution, transparent: true, opacity: 0.55});
    const points = new THREE.PointsMaterial({color, size: 6, sizeAttenuation: false});
    this.keyframes = new THREE.Points(new THREE.BufferGeometry(), points);
    this.keyframes.frustumCulled = false;
    this.body = new THREE.Group();
    const skin = new THREE.MeshLambertMaterial({color, emissive: color, emissiveIntensity: 0.45});
    this.body.add(
        new THREE.Mesh(new THREE.SphereBufferGeometry(0.12, 20, 14), skin),
        new THREE.AxesHelper(0.45));
    this.body.matrixAutoUpdate = false;
    this.group.add(this.optimized.object, this.odometry.object, this.keyframes, this.body);
  }
}

export class Scene {
  constructor(canvas, overlay) {
    this.canvas = canvas;
    this.overlay = overlay;
    this.renderer = new THREE.WebGLRenderer({canvas, antialias: true});
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setClearColor('#101216');
    this.resolution = new THREE.Vector2(1, 1);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(50, 1, 0.05, 5000);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(-8, -10, 9);
    const lamp = new THREE.DirectionalLight('#ffffff', 0.4);
    lamp.position.set(0.4, 0.6, 1);
    this.camera.add(lamp);
    this.scene.add(this.camera, new THREE.HemisphereLight('#ffffff', '#aab2c0', 0.72));
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.screenSpacePanning = true;
    this.controls.addEventListener('change', () => {
      this.dirty = true;
    });
    this.controls.addEventListener('start', () => {
      this.touched = true;
    });
    this.meshes = new MeshLayer();
    this.frames = new Map();  // anchor -> {group, grid, offset, label}
    this.figures = new Map();
    this.lines = {};  // lines of closures, by verdict
    for (const verdict of Object.keys(VERDICTS)) {
      const {color} = VERDICTS[verdict];
      this.lines[verdict] = new WideLine({
        color,
        linewidth: 1.2,
        resolution: this.resolution,
        transparent: true,
        opacity: {kept: 0.7, verified: 0.7}[verdict] ?? 0.3
      });
      this.scene.add(this.lines[verdict].object);
    }
    this.hovered = new WideLine({color: '#ffffff', linewidth: 3.5, resolution: this.resolution});
    this.ruler = new WideLine({color: '#ffffff', linewidth: 2, resolution: this.resolution});
    for (const line of [this.hovered, this.ruler]) {
      line.material.depthTest = false;
      line.material.transparent = true;  // transparent: drawn after all opaque objects
      line.object.renderOrder = 1;
    }
    this.objects = new ObjectLayer(overlay, this.resolution);
    this.rasters = new RasterLayer();
    this.scene.add(this.hovered.object, this.ruler.object, this.objects.lines.object);
    this.layers = {
      optimized: true,
      odometry: true,
      keyframes: true,
      kept: true,
      verified: true,
      candidate: false,
      rejected: false,
      objects: true,
      map_2d: false
    };
    this.measured = null;  // null: not measuring; else up to two points
    this.follows = null;
    this.drawn = [];  // drawn closures: {a, b, closure}
    this.frameTimes = [];
    this.drawnAt = 0;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    const loop = (now) => {
      requestAnimationFrame(loop);
      this.frame(now);
    };
    requestAnimationFrame(loop);
  }

  resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.resolution.set(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    for (const figure of this.figures.values()) this.sizeLines(figure.optimized, figure.odometry);
    this.sizeLines(...Object.values(this.lines), this.hovered, this.ruler, this.objects.lines);
    this.dirty = true;
  }

  // Materials copy the resolution that is assigned.
  sizeLines(...lines) {
    for (const line of lines) line.material.resolution.copy(this.resolution);
  }

  // ---- state of the model

  /** Shows the present state of the model. */
  update(model) {
    this.model = model;
    this.updateFrames(model);
    for (const [id, figure] of this.figures)
      if (!model.robots.has(id)) figure.here = figure.group.visible = false;
    for (const robot of model.robots.values()) this.updateRobot(robot);
    this.building = this.meshes.sync(model, (anchor, of) => this.place(anchor, of));
    this.updateClosures(model);
    this.updateLayers();
    this.scene.updateMatrixWorld();
    if (!this.touched && !this.follows) this.fit(false);
    this.dirty = true;
  }

  frameOf(robot) { return robot.optimized.length ? robot.anchor : robot.id; }

  // Transform from the robot's odometry frame to the frame in which it is shown, by its last
  // keyframe that has both poses.
  correction(robot) {
    for (let k = Math.min(robot.optimized.length, robot.odometry.length) - 1; k >= 0; --k)
      if (robot.optimized[k] && robot.odometry[k])
        return matrixOf(robot.optimized[k])
            .multiply(new THREE.Matrix4().getInverse(matrixOf(robot.odometry[k])));
    return new THREE.Matrix4();
  }

  // Group and transform for objects of robot `of` in the frame of `anchor`. The robot's own frame
  // moves with the robot once it has joined others.
  place(anchor, of) {
    const frame = this.frames.get(anchor);
    if (frame) return {group: frame.group, T: null};
    const robot = this.model.robots.get(of);
    const now = robot && this.frames.get(this.frameOf(robot));
    return now ? {group: now.group, T: this.correction(robot)} : {group: this.scene, T: null};
  }

  updateLayers() {
    const place = (anchor, of) => this.place(anchor, of);
    this.objects.sync(this.model, this.layers.objects, place, this.meshes);
    this.rasters.sync(this.model, this.layers, place);
  }

  updateFrames(model) {
    const frames = model.frames();
    for (const [anchor, frame] of this.frames)
      if (!frames.some((one) => one.anchor === anchor)) {
        // Each object in the frame gets its new place with its next update.
        for (const child of [...frame.group.children]) this.scene.add(child);
        this.scene.remove(frame.group, frame.grid);
        frame.label.remove();
        this.frames.delete(anchor);
      }
    let right = 0;
    frames.forEach(({anchor, robots}, i) => {
      if (!this.frames.has(anchor)) this.frames.set(anchor, this.makeFrame());
      const frame = this.frames.get(anchor);
      const box = this.boxOf(robots, anchor);
      const low = Math.floor(box.min.x), high = Math.ceil(box.max.x);
      frame.box = box;
      frame.group.position.x = i === 0 ? 0 : right + FRAME_GAP_M - low;
      frame.group.position.y = i === 0 ? 0 : -Math.round((box.min.y + box.max.y) / 2);
      right = frame.group.position.x + high;
      this.drawGrid(frame);
      const names = robots.map((robot) => model.name(robot.id)).join(', ');
      const alone = robots.length === 1 && model.robots.size > 1;
      frame.label.textContent = alone ?
          `${names}: not joined yet, in its own frame` :
          `${names}${robots.length > 1 ? ` in the frame of ${model.name(anchor)}` : ''}`;
      frame.label.classList.toggle('alone', alone);
    });
  }

  makeFrame() {
    const label = document.createElement('div');
    label.className = 'frame-label';
    this.overlay.append(label);
    const frame = {group: new THREE.Group(), grid: new THREE.Group(), label, box: null, drawn: ''};
    this.scene.add(frame.group, frame.grid);
    return frame;
  }

  boxOf(robots, anchor) {
    const box = new THREE.Box3();
    const point = new THREE.Vector3();
    for (const robot of robots) {
      const T = this.correction(robot);
      for (const p of robot.optimized)
        if (p) box.expandByPoint(point.set(p[0], p[1], p[2]));
      for (const p of robot.trail) box.expandByPoint(point.set(p[0], p[1], p[2]).applyMatrix4(T));
      for (const m of robot.meshes.values())
        if (m.anchor === anchor)
          for (const corner of [m.origin, m.reach ?? m.origin])
            box.expandByPoint(point.fromArray(corner).multiplyScalar(m.step_m));
    }
    if (box.isEmpty()) box.set(new THREE.Vector3(-1, -1, 0), new THREE.Vector3(1, 1, 1));
    return box;
  }

  // A floor below all objects of the frame. Its squares have 1 m; they are larger for a large map,
  // and smaller on a desk.
  drawGrid(frame) {
    const {min, max} = frame.box;
    const size = Math.max(max.x - min.x, max.y - min.y);
    const step = size > 200 ? 10 : size > 60 ? 5 : size > 2 ? 1 : size > 0.5 ? 0.2 : 0.05;
    const snap = (x, f) => f(x / step) * step;
    const [x0, x1, y0, y1] = [
      snap(min.x - step, Math.floor), snap(max.x + step, Math.ceil), snap(min.y - step, Math.floor),
      snap(max.y + step, Math.ceil)
    ];
    const rise = Math.min(step, 1) / 2;
    const z = Math.round((min.z - 0.2 * rise) / rise) * rise;
    frame.figureSize = Math.min(1, step);
    frame.floor = new THREE.Box3(new THREE.Vector3(x0, y0, z), new THREE.Vector3(x1, y1, max.z));
    const drawn = [x0, x1, y0, y1, z, step].join();
    frame.grid.position.copy(frame.group.position);
    if (drawn === frame.drawn) return;
    frame.drawn = drawn;
    const points = [];
    for (let x = x0; x <= x1 + 1e-6; x += step) points.push(x, y0, z, x, y1, z);
    for (let y = y0; y <= y1 + 1e-6; y += step) points.push(x0, y, z, x1, y, z);
    for (const old of [...frame.grid.children]) {
      old.geometry.dispose();
      frame.grid.remove(old);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
    frame.grid.add(
        new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: '#272b33'})));
    frame.corner = new THREE.Vector3((x0 + x1) / 2, y0, z);
  }

  updateRobot(robot) {
    if (!this.figures.has(robot.id)) {
      const figure = new RobotFigure(robot.id, this.resolution);
      figure.label = document.createElement('div');
      figure.label.className = 'robot-label';
      figure.label.style.setProperty('--robot', robotColor(robot.id));
      figure.label.ondblclick = () => this.onFollow?.(robot.id);
      this.overlay.append(figure.label);
      this.figures.set(robot.id, figure);
      this.sizeLines(figure.optimized, figure.odometry);
    }
    const figure = this.figures.get(robot.id);
    const frame = this.frames.get(this.frameOf(robot));
    figure.here = !!frame && robot.lastReceived !== null;
    figure.group.visible = figure.here;
    if (!figure.here) return;
    if (figure.group.parent !== frame.group) frame.group.add(figure.group);
    const T = this.correction(robot);
    figure.odometry.set(linesOf(robot, robot.trail, robot.trailStamps, T));
    const optimized = linesOf(robot, robot.optimized, robot.keyframeStamps);
    const newest = robot.optimized.length - 1;  // from there to the present pose of the robot
    if (newest >= 0 && robot.pose &&
        !robot.hasHole(robot.keyframeStamps[newest], robot.trailStamps[robot.trail.length - 1]))
      optimized.push(
          ...robot.optimized[newest].slice(0, 3),
          ...new THREE.Vector3().fromArray(robot.pose).applyMatrix4(T).toArray());
    figure.optimized.set(optimized);
    const keyframes =
        (robot.optimized.length ? robot.optimized : robot.odometry).flatMap((p) => p.slice(0, 3));
    figure.keyframes.geometry.dispose();
    figure.keyframes.geometry = new THREE.BufferGeometry();
    figure.keyframes.geometry.setAttribute(
        'position', new THREE.Float32BufferAttribute(keyframes, 3));
    if (robot.pose) figure.body.matrix.copy(T).multiply(matrixOf(robot.pose));
    for (const part of figure.body.children) part.scale.setScalar(frame.figureSize);
    figure.body.visible = !!robot.pose;
    figure.label.textContent = this.model.name(robot.id);
    this.showLayers(figure);
  }

  showLayers(figure) {
    figure.optimized.show(this.layers.optimized);
    figure.odometry.show(this.layers.odometry);
    figure.keyframes.visible = this.layers.keyframes;
  }

  setLayer(name, on) {
    this.layers[name] = on;
    for (const figure of this.figures.values()) this.showLayers(figure);
    if (name in this.lines) this.lines[name].show(on);
    if (this.model) this.updateLayers();
    this.setHovered(null);
    this.dirty = true;
  }

  // Position of a keyframe in the scene, or null.
  keyframeAt([id, index]) {
    const robot = this.model.robots.get(id);
    const frame = robot && this.frames.get(this.frameOf(robot));
    const pose = robot && (robot.optimized.length ? robot.optimized[index] : robot.odometry[index]);
    return frame && pose ? new THREE.Vector3(pose[0], pose[1], pose[2]).add(frame.group.position) :
                           null;
  }

  updateClosures(model) {
    const points = {kept: [], verified: [], candidate: [], rejected: []};
    this.drawn = [];
    for (const closure of model.closures().values()) {
      const a = this.keyframeAt(closure.from), b = this.keyframeAt(closure.to);
      if (!a || !b) continue;
      points[closure.verdict].push(a.x, a.y, a.z, b.x, b.y, b.z);
      this.drawn.push({a, b, closure});
    }
    for (const verdict of Object.keys(this.lines)) {
      this.lines[verdict].shown = this.layers[verdict];
      this.lines[verdict].set(points[verdict]);
    }
  }

  // ---- camera of the view

  bounds() {
    const all = new THREE.Box3();
    for (const frame of this.frames.values())
      if (frame.floor) all.union(frame.floor.clone().translate(frame.group.position));
    return all.isEmpty() ?
        new THREE.Box3(new THREE.Vector3(-3, -3, 0), new THREE.Vector3(3, 3, 2)) :
        all;
  }

  /** Moves the camera so that everything is in view, from its present direction or from above. */
  fit(above) {
    const box = this.bounds(), centre = box.getCenter(new THREE.Vector3());
    const away = (above ? new THREE.Vector3(0, -0.001, 1) : new THREE.Vector3(-0.3, -0.75, 0.75))
                     .normalize();
    const right = new THREE.Vector3().crossVectors(this.camera.up, away).normalize();
    const up = new THREE.Vector3().crossVectors(away, right);
    const high = Math.tan((this.camera.fov / 2) * (Math.PI / 180)) * 0.9;  // leaves room for the tools
    const wide = high * this.camera.aspect;
    let distance = 0.2;
    for (let i = 0; i < 8; ++i) {
      const corner = new THREE
                         .Vector3(
                             i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y,
                             i & 4 ? box.max.z : box.min.z)
                         .sub(centre);
      const reach = Math.max(Math.abs(corner.dot(right)) / wide, Math.abs(corner.dot(up)) / high);
      distance = Math.max(distance, corner.dot(away) + reach);
    }
    this.controls.target.copy(centre);
    this.camera.position.copy(centre).addScaledVector(away, distance);
    this.controls.update();
    this.dirty = true;
  }

  follow(id) {
    this.follows = id;
    this.followed = null;
    this.dirty = true;
  }

  stepWithRobot() {
    const figure = this.follows !== null && this.figures.get(this.follows);
    if (!figure || !figure.here || !figure.body.visible) return;
    const at = new THREE.Vector3().setFromMatrixPosition(figure.body.matrixWorld);
    const by = at.clone().sub(this.followed ?? this.controls.target);
    if (!this.followed) {
      const away = this.camera.position.clone().sub(this.controls.target);
      away.setLength(Math.min(away.length(), 7));
      this.camera.position.copy(this.controls.target).add(away);
    }
    this.camera.position.add(by);
    this.controls.target.add(by);
    this.followed = at;
    this.controls.update();
  }

  frame(now) {
    if (this.building) {
      this.building = this.meshes.sync(this.model, (anchor, of) => this.place(anchor, of));
      this.dirty = true;
    }
    // During long builds the finished parts are drawn now and then.
    if (!this.dirty || (this.building && now - this.drawnAt < BUILDING_DRAW_MS)) return;
    this.dirty = false;
    this.drawnAt = now;
    this.scene.updateMatrixWorld();
    this.stepWithRobot();
    const begin = performance.now();
    this.renderer.render(this.scene, this.camera);
    this.placeLabels();
    this.frameTimes.push([begin, performance.now() - begin]);
    if (this.frameTimes.length > 600) this.frameTimes.splice(0, 300);
    this.onDrawn?.(now);
  }

  // [x, y] in the overlay, or null behind the camera.
  onScreen(point) {
    const p = point.clone().project(this.camera);
    if (p.z > 1) return null;
    return [(p.x * 0.5 + 0.5) * this.resolution.x, (0.5 - p.y * 0.5) * this.resolution.y];
  }

  // Moves a label into view if it is just beyond the edge or behind the legend.
  keepInView(at, label) {
    const half = label.offsetWidth / 2 + EDGE_PX, lowest = this.resolution.y - LEGEND_PX;
    const isNear = at[0] > -half && at[0] < this.resolution.x + half && at[1] > 0 &&
        at[1] < this.resolution.y + LEGEND_PX;
    if (!isNear) return;
    at[0] = Math.max(half, Math.min(this.resolution.x - half, at[0]));
    at[1] = Math.min(lowest, at[1]);
  }

  placeLabels() {
    const put = (label, point, inView = false) => {
      const at = point && this.onScreen(point);
      label.hidden = !at;
      if (at && inView) this.keepInView(at, label);
      if (at)
        label.style.transform =
            `translate(${at[0].toFixed(1)}px, ${at[1].toFixed(1)}px) translate(-50%, 0)`;
    };
    for (const figure of this.figures.values())
      put(figure.label,
          figure.here && figure.body.visible ?
              new THREE.Vector3().setFromMatrixPosition(figure.body.matrixWorld) :
              null);
    for (const frame of this.frames.values())
      put(frame.label, frame.corner ? frame.corner.clone().add(frame.group.position) : null, true);
    if (this.ruler.label)
      put(this.ruler.label,
          this.measured?.length === 2 ? this.measured[0].clone().lerp(this.measured[1], 0.5) :
                                        null);
    this.objects.placeLabels((point) => this.onScreen(point));
  }

  // ---- pointer

  rayAt(x, y) {
    const caster = new THREE.Raycaster();
    caster.setFromCamera(
        new THREE.Vector2((x / this.resolution.x) * 2 - 1, 1 - (y / this.resolution.y) * 2),
        this.camera);
    return caster;
  }

  /** The nearest object under a point of the screen, or null. */
  objectAt(x, y) { return this.objects.at(this.rayAt(x, y).ray); }

  /** The closure within a few pixels of a point of the screen, or null. */
  closureAt(x, y) {
    let best = null, nearest = 7;
    for (const one of this.drawn) {
      if (!this.layers[one.closure.verdict]) continue;
      const a = this.onScreen(one.a), b = this.onScreen(one.b);
      if (!a || !b) continue;
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
      const along =
          Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1)));
      const distance = Math.hypot(x - a[0] - along * dx, y - a[1] - along * dy);
      if (distance < nearest) [best, nearest] = [one, distance];
    }
    return best;
  }

  setHovered(one) {
    if (one === this.over) return;
    this.over = one;
    this.hovered.set(one ? [...one.a.toArray(), ...one.b.toArray()] : []);
    this.dirty = true;
  }

  /** The point of the map under a point of the screen. Outside the map, the point on the floor of
   * the first frame. */
  pick(x, y) {
    const caster = this.rayAt(x, y);
    const hit = this.meshes.pick(caster);
    if (hit) return hit;
    const z = [...this.frames.values()][0]?.corner?.z ?? 0;
    return caster.ray.intersectPlane(
        new THREE.Plane(new THREE.Vector3(0, 0, 1), -z), new THREE.Vector3());
  }

  /** Begins or ends a measurement. */
  measure(on) {
    this.measured = on ? [] : null;
    this.ruler.set([]);
    if (this.ruler.label) this.ruler.label.hidden = true;
    this.dirty = true;
  }

  addMeasured(point) {
    if (!point) return null;
    if (this.measured.length === 2) this.measured = [];
    this.measured.push(point);
    const [a, b = a] = this.measured;
    this.ruler.set([...a.toArray(), ...b.toArray()]);
    if (!this.ruler.label) {
      this.ruler.label = document.createElement('div');
      this.ruler.label.className = 'ruler-label';
      this.overlay.append(this.ruler.label);
    }
    const distance = a.distanceTo(b);
    this.ruler.label.textContent = `${distance.toFixed(2)} m`;
    this.dirty = true;
    return this.measured.length === 2 ? distance : null;
  }
}
