// Opens the report of the run in test_report_page.cpp and examines the page.
//   node report_in_browser.mjs REPORT [SCREENSHOT]
import assert from 'node:assert/strict';
import {pathToFileURL} from 'node:url';

import {Browser} from '../viewer/browser.mjs';

const [report, shot] = process.argv.slice(2);
const browser = new Browser();
try {
  const page = await browser.open(pathToFileURL(report).href);
  await page.until('document.body.dataset.ready');
  if (shot) await page.screenshot(shot);
  const textOf = (where) => page.evaluate(`document.querySelector('${where}').textContent`);
  const count = (where) => page.evaluate(`document.querySelectorAll('${where}').length`);

  // Text of the run is text.
  assert.match(await textOf('#findings'), /r0: <\/script><script>alert\(1\)<\/script><!--/);
  assert.equal(await count('script'), 2);

  // Truth, closures kept and two robots; their odometry is there to be shown.
  assert.equal(await count('#trajectories svg svg path'), 4);
  await page.evaluate(`[...document.querySelectorAll('#trajectories .chart-key')].find(
      (key) => key.textContent === 'r1, odometry').click()`);
  assert.equal(await count('#trajectories svg svg path'), 5);
  assert.equal(await count('#errors svg path'), 4);
  assert.ok(await count('#work svg') >= 4);
  assert.ok(await count('#modules rect') >= 4);

  // Images of the closure that was kept; not of one that was not verified.
  assert.equal(await count('#images img'), 2);
  assert.equal(await textOf('#images figcaption'), 'kept r0 0 – r1 1 80 matches of descriptors; 60 points agree with the pose');
  await page.until(
      `[...document.querySelectorAll('#images img')].every((e) => e.naturalWidth === 1)`);

  // The list of closures, of one stage alone.
  const rows = '#closures > div:not(.scroll, #images) tbody tr';
  assert.equal(await count(rows), 2);
  await page.evaluate(`[...document.querySelectorAll('#closures .pick button')].find(
      (button) => button.textContent === 'received 1').click()`);
  assert.equal(await count(rows), 1);
  assert.match(await textOf(rows), /r0 1.*r1 2.*no pose/);

  // Zoomed in, the first robot's line is longer.
  const length = `Number(document.querySelector('#trajectories svg svg path').getTotalLength())`;
  const before = await page.evaluate(length);
  await page.evaluate(`document.querySelector('#trajectories .chart-zoom').click()`);
  assert.ok(Math.abs(await page.evaluate(length) / before - 1.5) < 0.05);

  assert.deepEqual(page.errors, []);
} finally {
  await browser.close();
}
