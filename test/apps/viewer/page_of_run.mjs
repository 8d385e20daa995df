// Opens the page on a finished run and compares its state with the results of the robots.
//   node page_of_run.mjs VIEWER RESULTS [FOLDER for screenshots]
import assert from 'node:assert/strict';
import {mkdirSync} from 'node:fs';
import {join} from 'node:path';

import {Browser} from './browser.mjs';
import {facesOf, objectCounts, readStages, readSummaries, sum} from './run_files.mjs';
import {Viewer} from './viewer.mjs';

const [program, results, shots] = process.argv.slice(2);
if (shots) mkdirSync(shots, {recursive: true});

const summaries = readSummaries(results);
const pairs = [...readStages(results, summaries).values()];
const faces = facesOf(summaries);
const viewer = await Viewer.start(program, [results]);
const browser = new Browser();
try {
  const page = await browser.open(viewer.url);
  const shoot = (name) => shots && page.screenshot(join(shots, `${name}.png`));
  await page.until('kimera.ready');

  // The end: as in the files.
  const robots = await page.evaluate('kimera.robots');
  assert.deepEqual(
      robots.map((r) => [r.id, r.name, r.keyframes]),
      summaries.map((s) => [s.robot, s.name, s.keyframes]));
  const closures = await page.evaluate('kimera.closures');
  assert.equal(sum(Object.values(closures)), pairs.length);
  assert.equal(closures.kept, pairs.filter((stage) => stage === 'inlier').length);
  assert.equal(await page.evaluate('kimera.faces'), faces);
  assert.equal(await page.evaluate('kimera.drawnFaces'), await page.evaluate('kimera.faces'));
  const badge = (page) => page.evaluate(`document.getElementById('link').textContent`);
  assert.equal(await badge(page), 'finished run');
  const lastUpdates = await page.evaluate(
      `[...document.querySelectorAll('#robots dt')].filter((term) =>
        term.textContent === 'Last update').map((term) => term.nextSibling.textContent)`);
  assert.ok(lastUpdates[0].startsWith('at '), lastUpdates[0]);
  await page.until(  // charts come a little later
      `/sensors|odometry|vio/.test([...document.querySelectorAll('#right > div')].at(-1).textContent)`);
  const anchors =
      new Set(summaries.map((s) => (s.pgo.members.length > 1 ? s.pgo.anchor : s.robot)));
  assert.equal(await page.evaluate('kimera.frames.length'), anchors.size);
  await shoot('finished');

  // Layers: objects as in the files; each layer that is switched on draws something.
  const counts = objectCounts(results, summaries);
  const objects = await page.evaluate('kimera.objects');
  assert.ok(counts.length ? counts.includes(objects) : objects === 0, `${objects} of ${counts}`);
  const shown = await page.evaluate(
      `[...document.querySelectorAll('[data-layer]')].filter((b) => !b.hidden).map((b) => b.dataset.layer)`);
  const calls = () => page.evaluate('kimera.scene.renderer.info.render.calls');
  if (shown.includes('map_2d')) {
    const before = {calls: await calls(), rasters: await page.evaluate('kimera.rasters')};
    await page.clickAt('[data-layer=map_2d]');
    await page.until(`kimera.rasters > ${before.rasters} && !kimera.scene.dirty`);
    assert.ok(await calls() > before.calls);
    await shoot('map_2d');
  }
  if (shown.includes('team')) {
    await page.clickAt('[data-layer=team]');
    await page.until('kimera.ready && kimera.drawnFaces > 0 && !kimera.scene.dirty');
    await shoot('team');
    await page.clickAt('#mesh-modes button');
    await page.until(`kimera.ready && kimera.drawnFaces === ${faces}`);
  }

  // The past: separate frames first, and no later messages; then the end again.
  const end = await page.evaluate('kimera.end');
  const joined = await page.evaluate(`Math.min(...[...kimera.model.robots.values()].flatMap((r) =>
    r.log.filter((m) => m.optimized && m.anchor !== r.id).map((m) => m.t)), Infinity)`);
  if (joined < end) {
    await page.evaluate(`kimera.seek(${joined - 0.1})`);
    await page.until('kimera.ready');
    assert.equal(await page.evaluate('kimera.frames.length'), summaries.length);
    assert.ok(await page.evaluate('kimera.faces') <= faces);
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
  await viewer.stop();
  await browser.close();
}

console.log('as in the files');
