// Messages of the robots, and the state that follows from them at any time.

// Key of a mesh chunk: the newest chunk with a key replaces the others.
const keyOf = ({of, cell, part}) => `${of} ${cell} ${part}`;

const GONE_S = 10;
const HOLE_S = 1, HOLE_INTERVALS = 5;  // as pose_holes()

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

/** Messages of one robot in order, and the state that follows from them at the requested time. */
export class Robot {
  constructor(id) {
    this.id = id;
    this.log = [];     // {n, t, ...}, t [s] since the start, ascending
    this.states = [];  // status messages of the log, for charts
    this.forget();
  }

  forget() {
    this.applied = 0;  // number of log entries applied to the members below
    this.renew(null);
    this.statesShown = 0;
  }

  // A process begins: the messages of the robot's earlier process are dropped.
  renew(boot) {
    this.boot = boot;
    this.state = null;
    this.pose = null;
    this.trail = [];        // poses in odom
    this.trailStamps = [];  // stamps of the images [s]
    this.intervals = [];    // intervals between the newest stamps [s]
    this.holes = [];        // middles of times without a pose, far longer than usual [s]
    this.odometry = [];     // T_odom_kf by keyframe
    this.keyframeStamps = [];
    this.optimized = [];    // T_world_kf by keyframe
    this.anchor = this.id;  // robot whose odometry frame T_world_kf refers to
    this.closures = new Map();
    this.meshes = new Map();
    this.teamMeshes = new Map();  // chunks of the fused mesh of the team
    this.objects = null;
    this.rasters = new Map();  // by layer
    this.image = null;
    this.lastReceived = null;  // time of its last message [s]
  }

  add(message) {
    const last = this.log[this.log.length - 1];
    if (last && message.t < last.t) message.t = last.t;  // the robot's clock was set back
    this.log.push(message);
    if (message.kind === 'state') this.states.push(message);
  }

  seek(time) {
    if (this.applied > 0 && this.log[this.applied - 1].t > time) this.forget();
    while (this.applied < this.log.length && this.log[this.applied].t <= time)
      this.apply(this.log[this.applied++]);
  }

  apply(message) {
    if (message.boot !== this.boot) this.renew(message.boot);
    if (message.kind === 'state') ++this.statesShown;
    if (message.gone) return;
    this.lastReceived = message.t;
    this[`apply_${message.kind}`]?.(message);
  }

  apply_state(message) { this.state = message; }

  apply_pose({stamp_s, T_odom_body}) {
    this.pose = T_odom_body;
    const last = this.trailStamps[this.trailStamps.length - 1];
    if (this.intervals.length >= 5 &&
        stamp_s - last > Math.max(HOLE_S, HOLE_INTERVALS * median(this.intervals)))
      this.holes.push((last + stamp_s) / 2);
    if (last !== undefined) this.intervals.push(stamp_s - last);
    if (this.intervals.length > 31) this.intervals.shift();
    this.trail.push(this.pose);
    this.trailStamps.push(stamp_s);
  }

  /** True if the robot's motion is unknown for a part of the time between two instants [s]. */
  hasHole(from, to) { return this.holes.some((middle) => from < middle && middle < to); }

  apply_keyframes({optimized, anchor, first, T_world_kf, stamps_s}) {
    stamps_s?.forEach((stamp, i) => {
      this.keyframeStamps[first + i] = stamp;
    });
    if (optimized && anchor !== this.anchor) {
      this.optimized = [];  // poses in another frame
      this.anchor = anchor;
    }
    const poses = optimized ? this.optimized : this.odometry;
    T_world_kf.forEach((T, i) => {
      poses[first + i] = T;
    });
  }

  apply_closures(message) {
    for (const [r0, k0, r1, k1, verdict, matches, inliers, reason] of message.closures)
      this.closures.set(`${r0}:${k0} ${r1}:${k1}`, {
        from: [r0, k0],
        to: [r1, k1],
        verdict,
        matches,
        inliers,
        reason,
        t: message.t,
        sent: message.sent
      });
  }

  apply_mesh(message) {
    const meshes = message.team ? this.teamMeshes : this.meshes;
    if (message.faces)
      meshes.set(keyOf(message), message);
    else
      meshes.delete(keyOf(message));
  }

  apply_objects(message) { this.objects = message; }

  apply_raster(message) { this.rasters.set(message.layer, message); }

  apply_image(message) { this.image = message; }

  /** Removes a message from the present state. */
  drop(message) {
    const remove = (from, key) => from.get(key) === message && from.delete(key);
    if (message.kind === 'mesh')
      remove(message.team ? this.teamMeshes : this.meshes, keyOf(message));
    if (message.kind === 'raster') remove(this.rasters, message.layer);
    if (this.objects === message) this.objects = null;
  }
}

/** All robots, at all times. */
export class Model {
  constructor() { this.clear(); }

  clear() {
    this.robots = new Map();  // by id, ascending
    this.byNumber = new Map();
    this.layers = new Set();  // layers with content at any time: objects, team, map_2d
    this.start_ms = null;
    this.end = 0;  // [s] since the start
    this.time = 0;
    this.bytes = 0;
  }

  robot(id) {
    if (!this.robots.has(id)) {
      this.robots.set(id, new Robot(id));
      this.robots = new Map([...this.robots].sort((a, b) => a[0] - b[0]));
    }
    return this.robots.get(id);
  }

  add(message) {
    this.start_ms ??= message.t;
    message.sent = message.t;  // [ms since 1970]
    message.t = (message.t - this.start_ms) / 1000;
    this.robot(message.robot).add(message);
    if (message.objects?.length) this.layers.add('objects');
    if (message.team) this.layers.add('team');
    if (message.kind === 'raster') this.layers.add(message.layer);
    this.end = Math.max(this.end, message.t);
    this.bytes += message.bytes ?? 0;
    if (message.bytes || message.kind !== 'closures') this.byNumber.set(message.n, message);
  }

  /** Drops messages that the viewer has dropped. */
  forgetNumbers(numbers) {
    for (const n of numbers) {
      const message = this.byNumber.get(n);
      if (!message) continue;
      this.byNumber.delete(n);
      this.bytes -= message.bytes ?? 0;
      for (const bulk
               of ['positions', 'triangles', 'labels', 'tints', 'jpeg', 'pixels', 'T_world_kf',
                   'T_odom_body', 'runs'])
        delete message[bulk];
      message.gone = true;
      this.robots.get(message.robot).drop(message);
    }
  }

  /** Sets the state to that at `time` [s since the start]. */
  seek(time) {
    this.time = time;
    for (const robot of this.robots.values()) robot.seek(time);
  }

  /** Every pair of keyframes once, with its newest verdict. Only the robot that has verified a
   * closure knows its number of matches. */
  closures() {
    const all = new Map();
    for (const robot of this.robots.values())
      for (const [id, closure] of robot.closures) {
        const known = all.get(id);
        const newest = !known || known.t <= closure.t ? closure : known;
        const matches = Math.max(closure.matches, known?.matches ?? 0);
        all.set(id, matches === newest.matches ? newest : {...newest, matches});
      }
    return all;
  }

  /** All frames, with the anchor and its robots; the largest come first. */
  frames() {
    const frames = new Map();
    for (const robot of this.robots.values()) {
      if (robot.lastReceived === null) continue;
      const anchor = robot.optimized.length ? robot.anchor : robot.id;
      if (!frames.has(anchor)) frames.set(anchor, []);
      frames.get(anchor).push(robot);
    }
    return [...frames]
        .map(([anchor, robots]) => ({anchor, robots}))
        .sort((a, b) => b.robots.length - a.robots.length || a.anchor - b.anchor);
  }

  /** End of a live team: {ended, at_ms} once all robots have sent that they leave, or no message
   * has arrived for GONE_S. `ended`: none was still running. Null before. `silent_s`: time since
   * the last message. */
  over(silent_s) {
    const phases = [...this.robots.values()].map(({states}) => states[states.length - 1]?.phase);
    const left = phases.every((phase) => phase === 'leaving');
    if (!phases.length || (!left && silent_s < GONE_S)) return null;
    const ended = phases.every((phase) => phase && phase !== 'running');
    return {ended, at_ms: this.start_ms + 1000 * this.end};
  }

  faces() {
    let faces = 0;
    for (const robot of this.robots.values())
      for (const chunk of robot.meshes.values()) faces += chunk.faces;
    return faces;
  }

  /** Number of objects for which a robot had no room in its message. */
  objectsLeftOut() {
    return Math.max(0, ...[...this.robots.values()].map(({objects}) => objects?.left_out ?? 0));
  }

  name(id) { return this.robots.get(id)?.state?.name ?? `robot${id}`; }
}
