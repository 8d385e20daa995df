// The page's model of received messages, without a browser.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';

const text = readFileSync('apps/viewer/page/model.js', 'utf8');
const {Model} = await import(`data:text/javascript,${encodeURIComponent(text)}`);

const at = (x) => [x, 0, 0, 0, 0, 0, 1];
let number = 0;
const add = (model, robot, t, content, boot = 'a') =>
    model.add({n: number++, t: 1000 * (100 + t), robot, boot, ...content});
const keyframes = (first, xs, anchor = null) => ({
  kind: 'keyframes',
  optimized: anchor !== null,
  anchor,
  first,
  T_world_kf: xs.map(at),
});
const mesh = (cell, faces) =>
    ({kind: 'mesh', of: 0, cell, part: 0, anchor: 0, faces, bytes: 6 * faces});
const closures = (...list) => ({kind: 'closures', closures: list});

function test(name, body) {
  try {
    body(new Model());
  } catch (error) {
    error.message = `${name}: ${error.message}`;
    throw error;
  }
}

test('any time can be gone to, forth and back', (model) => {
  add(model, 0, 0, keyframes(0, [0]));
  add(model, 0, 1, mesh([0, 0, 0], 10));
  add(model, 0, 2, keyframes(1, [1]));
  add(model, 0, 3, mesh([0, 0, 0], 20));
  add(model, 0, 4, mesh([0, 0, 0], 0));
  const facesAt = (t) => (model.seek(t), model.faces());
  assert.deepEqual([0.5, 1, 3.5, 4, 2.9, 0].map(facesAt), [0, 10, 20, 0, 10, 0]);
  model.seek(1.9);
  assert.equal(model.robots.get(0).odometry.length, 1);
  model.seek(2);
  assert.equal(model.robots.get(0).odometry.length, 2);
});

test('a closure has the matches of the robot that verified it, and the newest verdict', (model) => {
  add(model, 0, 0, closures([0, 1, 1, 2, 'verified', 150, 118, '']));
  add(model, 1, 1, closures([0, 1, 1, 2, 'kept', 0, 118, '']));
  model.seek(1);
  const [closure] = model.closures().values();
  assert.deepEqual([closure.verdict, closure.matches, closure.inliers], ['kept', 150, 118]);
});

test('robots are in the frame of their optimised keyframes, else in their own', (model) => {
  add(model, 1, 0, keyframes(0, [0]));
  add(model, 0, 0, keyframes(0, [0]));
  add(model, 1, 1, keyframes(0, [5], 0));
  const frames = (t) =>
      (model.seek(t), model.frames().map((f) => [f.anchor, f.robots.map((r) => r.id)]));
  assert.deepEqual(frames(0.5), [[0, [0]], [1, [1]]]);
  assert.deepEqual(frames(1), [[0, [0, 1]]]);
});

test('keyframes of a former frame go with it', (model) => {
  add(model, 1, 0, keyframes(0, [0, 1, 2], 1));
  add(model, 1, 1, keyframes(0, [7], 0));
  model.seek(1);
  assert.deepEqual(model.robots.get(1).optimized, [at(7)]);
});

test('a time without a pose, far longer than usual, is a hole', (model) => {
  const pose = (stamp_s) => ({kind: 'pose', stamp_s, T_odom_body: at(stamp_s)});
  for (let i = 0; i <= 20; ++i) add(model, 0, 0.1 * i, pose(500 + 0.1 * i));
  add(model, 0, 2.1, {...keyframes(0, [0, 1]), stamps_s: [500, 501.9]});
  add(model, 0, 8.3, pose(508.3));
  add(model, 0, 8.4, pose(508.4));
  add(model, 0, 8.5, {...keyframes(2, [3]), stamps_s: [508.4]});
  model.seek(9);
  const robot = model.robots.get(0);
  assert.equal(robot.holes.length, 1);
  assert.equal(robot.hasHole(robot.trailStamps[20], robot.trailStamps[21]), true);
  assert.equal(robot.hasHole(robot.trailStamps[19], robot.trailStamps[20]), false);
  assert.deepEqual(robot.keyframeStamps, [500, 501.9, 508.4]);
  assert.equal(robot.hasHole(501.9, 508.4), true);
  model.seek(3);
  assert.equal(robot.hasHole(500, 600), false);
});

test('a live run is over when all robots have left, or none sends any more', (model) => {
  const state = (phase) => ({kind: 'state', phase});
  assert.equal(model.over(99), null);
  add(model, 0, 0, state('running'));
  add(model, 1, 1, state('leaving'));
  assert.equal(model.over(3), null);
  assert.deepEqual(model.over(11), {ended: false, at_ms: 101000});
  add(model, 0, 4, state('settled'));
  assert.equal(model.over(3), null);
  assert.deepEqual(model.over(11), {ended: true, at_ms: 104000});
  add(model, 0, 5, state('leaving'));
  assert.deepEqual(model.over(0), {ended: true, at_ms: 105000});
  add(model, 0, 9, state('running'), 'b');  // started again
  assert.equal(model.over(0), null);
});

test('a new process of a robot replaces the updates of the former one', (model) => {
  add(model, 0, 0, keyframes(0, [0, 1]));
  add(model, 0, 0, mesh([0, 0, 0], 10));
  add(model, 0, 0, closures([0, 0, 1, 0, 'kept', 9, 9, '']));
  add(model, 0, 2, keyframes(0, [3]), 'b');
  model.seek(2);
  assert.equal(model.faces(), 0);
  assert.equal(model.closures().size, 0);
  assert.deepEqual(model.robots.get(0).odometry, [at(3)]);
  model.seek(1);
  assert.equal(model.faces(), 10);
});

test('the newest verdict on a closure counts, of whichever robot', (model) => {
  add(model, 0, 0, closures([0, 0, 1, 0, 'candidate', 0, 0, '']));
  add(model, 1, 1, closures([0, 0, 1, 0, 'verified', 30, 20, '']));
  add(model, 0, 2, closures([0, 0, 1, 0, 'rejected', 30, 20, 'too far']));
  const verdicts =
      [0, 1, 2].map((t) => (model.seek(t), [...model.closures().values()].map((c) => c.verdict)));
  assert.deepEqual(verdicts, [['candidate'], ['verified'], ['rejected']]);
});

test('layers have a time, the newest counts, and the fused mesh is apart', (model) => {
  const raster = (layer) => ({kind: 'raster', layer, bytes: 9, runs: [1, 0]});
  add(model, 0, 0, {kind: 'objects', anchor: 0, left_out: 0, objects: [[1], [2]]});
  add(model, 0, 1, raster('map_2d'));
  add(model, 0, 2, {kind: 'objects', anchor: 0, left_out: 5, objects: [[1]]});
  add(model, 0, 2, {...mesh([0, 0, 0], 10), of: 1, team: true});
  const first = number;
  add(model, 0, 3, raster('map_2d'));
  const at = (t) => {
    model.seek(t);
    const {objects, rasters} = model.robots.get(0);
    return [objects.objects.length, model.objectsLeftOut(), rasters.size];
  };
  assert.deepEqual(at(0.5), [2, 0, 0]);
  assert.deepEqual(at(2), [1, 5, 1]);
  assert.deepEqual([...model.layers], ['objects', 'map_2d', 'team']);
  assert.equal(model.faces(), 0);
  at(3);
  model.forgetNumbers([first]);
  assert.equal(model.robots.get(0).rasters.size, 0);
});

test('what the viewer let go of is let go of', (model) => {
  const first = number;
  add(model, 0, 0, mesh([0, 0, 0], 10));
  add(model, 0, 1, mesh([0, 0, 0], 20));
  model.seek(0);
  assert.equal(model.faces(), 10);
  assert.equal(model.bytes, 180);
  model.forgetNumbers([first, 12345]);
  assert.equal(model.bytes, 120);
  assert.equal(model.faces(), 0);
  model.seek(1);
  assert.equal(model.faces(), 20);
});

test('a clock that was set back does not turn the order', (model) => {
  add(model, 0, 5, mesh([0, 0, 0], 10));
  add(model, 0, 3, mesh([0, 0, 0], 20));
  model.seek(model.end);
  assert.equal(model.faces(), 20);
});
