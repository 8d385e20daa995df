// Opens the page on a finished run and compares what it knows with what the robots left.
//   node page_of_run.mjs VIEWER RESULTS [FOLDER for screenshots]
import assert from 'node:assert/strict';
import {readdirSync, readFileSync, existsSync, mkdirSync} from 'node:fs';
import {join} from 'node:path';
import {Browser} from './browser.mjs';
import {Viewer} from './viewer.mjs';

const [program, results, shots] = process.argv.slice(2);
if (shots) mkdirSync(shots, {recursive: true});

// What the robots left: summaries, and each pair of keyframes in any loop_closures.csv.
function readRun(folder) {
  const folders = readdirSync(folder).map((name) => join(folder, name)).filter((one) => existsSync(join(one, 'summary.json')));
  const summaries = folders.map((one) => JSON.parse(readFileSync(join(one, 'summary.json'))));
  const pairs = new Map();
  for (const one of folders)
    for (const line of readFileSync(join(one, 'loop_closures.csv'), 'utf8').trim().split('\n').slice(1)) {
      const [r0, k0, r1, k1, , stage] = line.split(',');
      const id = [`${r0}:${k0}`, `${r1}:${k1}`].sort().join();
      pairs.set(id, pairs.get(id) === 'inlier' ? 'inlier' : stage);
    }
  return {summaries: summaries.sort((a, b) => a.robot - b.robot), pairs: [...pairs.values()]};
}

const sum = (numbers) => numbers.reduce((a, b) => a + b, 0);
const {summaries, pairs} = readRun(results);
const viewer = await Viewer.start(program, [results]);
const browser = new Browser();
try {
  const page = await browser.open(viewer.url);
  const shoot = (name) => shots && page.screenshot(join(shots, `${name}.png`));
  await page.until('kimera.ready');

  // The end: as the files say.
  const robots = await page.evaluate('kimera.robots');
  assert.deepEqual(robots.map((r) => [r.id, r.name, r.keyframes]), summaries.map((s) => [s.robot, s.name, s.keyframes]));
  const closures = await page.evaluate('kimera.closures');
  assert.equal(sum(Object.values(closures)), pairs.length);
  assert.equal(closures.kept, pairs.filter((stage) => stage === 'inlier').length);
  assert.equal(await page.evaluate('kimera.faces'), sum(summaries.map((s) => s.mapping?.faces ?? 0)));
  assert.equal(await page.evaluate('kimera.drawnFaces'), await page.evaluate('kimera.faces'));
  const anchors = new Set(summaries.map((s) => (s.pgo.members.length > 1 ? s.pgo.anchor : s.robot)));
  assert.equal(await page.evaluate('kimera.frames.length'), anchors.size);
  await shoot('finished');

  // The past: apart first, and nothing of the future; then the end again.
  const end = await page.evaluate('kimera.end');
  const joined = await page.evaluate(`Math.min(...[...kimera.model.robots.values()].flatMap((r) =>
    r.log.filter((m) => m.optimized && m.anchor !== r.id).map((m) => m.t)), Infinity)`);
  if (joined < end) {
    await page.evaluate(`kimera.seek(${joined - 0.1})`);
    await page.until('kimera.ready');
    assert.equal(await page.evaluate('kimera.frames.length'), summaries.length);
    assert.ok(await page.evaluate('kimera.faces') <= sum(summaries.map((s) => s.mapping?.faces ?? 0)));
    await shoot('apart');
    await page.evaluate(`kimera.seek(${joined + 0.1})`);
    await page.until('kimera.ready');
    assert.ok(await page.evaluate('kimera.frames.length') < summaries.length);
    await shoot('joined');
  }
  await page.evaluate('kimera.goLive()');
  await page.until(`kimera.ready && kimera.time === ${end}`);
  assert.deepEqual(await page.evaluate('kimera.robots'), robots);

  // Closed and opened again: the same.
  await page.close();
  const again = await browser.open(viewer.url);
  await again.until('kimera.ready');
  assert.deepEqual(await again.evaluate('kimera.robots'), robots);
  assert.deepEqual(await again.evaluate('kimera.closures'), closures);
  assert.deepEqual([...page.errors, ...again.errors], []);
} finally {
  await browser.close();
  await viewer.stop();
}

// As if live: opened in the middle, closed, opened again, and in the end the same.
const replay = await Viewer.start(program, [results, '--rate', '10']);
const other = new Browser();
try {
  for (let visit = 0; visit < 2; ++visit) {
    const page = await other.open(replay.url);
    await page.until('kimera.ready');
    if (visit === 0) {
      await page.close();
      continue;
    }
    await page.until(`kimera.faces === ${sum(summaries.map((s) => s.mapping?.faces ?? 0))} && kimera.robots.every((r) => r.phase !== 'running')`);
    assert.equal(sum(Object.values(await page.evaluate('kimera.closures'))), pairs.length);
    assert.deepEqual(page.errors, []);
  }
} finally {
  await other.close();
  await replay.stop();
}
console.log('as the files say');
