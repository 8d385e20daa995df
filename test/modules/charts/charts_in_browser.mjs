// Opens the page of test_chart_page.cpp and checks the content of its charts.
//   node charts_in_browser.mjs PAGE [SCREENSHOT]
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {pathToFileURL} from 'node:url';

import {Browser} from '../../apps/viewer/browser.mjs';

const [file, shot] = process.argv.slice(2);
const browser = new Browser();
try {
  const page = await browser.open(pathToFileURL(file).href, 800, 2600);
  await page.until('document.body.dataset.ready');
  if (shot) await page.screenshot(shot);
  // Attributes of the elements of the n-th chart, and all its text.
  const all = (n, where, name) => page.evaluate(`[...document.querySelectorAll('.chart')[${
      n}].querySelectorAll('${where}')].map((e) => e.getAttribute('${name}'))`);
  const texts = (n, where) => page.evaluate(`[...document.querySelectorAll('.chart')[${
      n}].querySelectorAll('${where}')].map((e) => e.textContent)`);
  const points = (d) => d.split(/[MLh]/).filter((p) => p).map((p) => p.split(' ').map(Number));
  const LINES = 'svg path', LABELS = 'svg text', BARS = 'svg rect', MARKS = 'svg circle';

  // Text of plots is shown as text.
  assert.deepEqual(await texts(0, '.chart-title'), ['a < b & <i>m']);
  assert.deepEqual(await texts(0, '.chart-key:not(.chart-save)'), ['</svg>', 'marks']);

  // A point that is not finite interrupts a line. The x axis is tight; y begins at 0 with a margin.
  const [line] = await all(0, LINES, 'd');
  assert.match(line, /^M[^ML]*L[^ML]*M[^ML]*L[^ML]*$/);
  const [a, b, , d] = points(line);
  assert.ok(Math.abs((d[0] - a[0]) - 2.5 * (b[0] - a[0])) < 0.3);
  assert.ok(Math.abs((a[1] - d[1]) - 4 * (a[1] - b[1])) < 0.5);
  assert.deepEqual(
      await texts(0, LABELS), ['0', '1', '2', '3', '4', '0', '2', '4', '6', '8', '10', 'rounds']);
  assert.equal((await all(0, MARKS, 'cx')).length, 1);

  // A value without a logarithm interrupts a line too; all decades are there.
  const decades = await all(1, LINES, 'd');
  assert.match(decades[0], /^M[^ML]*M[^ML]*L[^ML]*$/);
  const labels = await texts(1, LABELS);
  assert.ok(labels.includes('1e-8') && labels.includes('100'), labels.join());
  assert.equal(points(decades[1])[0][1], points(decades[1])[1][1]);
  assert.equal((decades[2].match(/h0/g)).length, 2);

  // A name has one entry in the legend for its line and its dots.
  assert.deepEqual(await texts(1, '.chart-key:not(.chart-save)'), ['a', 'b']);
  const pressB = `[...document.querySelectorAll('.chart')[1].querySelectorAll('.chart-key')].find(
      (key) => key.textContent === 'b').click()`;
  await page.evaluate(pressB);
  assert.equal((await all(1, LINES, 'd')).length, 1);
  await page.evaluate(pressB);

  // The length of a bar is its value, shown beside it; an unknown value has no bar.
  const lengths = (await all(2, BARS, 'width')).map(Number);
  assert.equal(lengths.length, 3);
  assert.ok(Math.abs(lengths[1] / lengths[0] - 0.5) < 2e-3);
  assert.ok(Math.abs(lengths[2] / lengths[0] - 0.25) < 2e-3);
  assert.deepEqual(await texts(2, LABELS), ['two', '4.0', '2.0', 'one', '1.0']);

  // A map has one scale for both axes.
  const [from, to] = points((await all(3, LINES, 'd'))[0]);
  assert.ok(Math.abs((to[0] - from[0]) / (from[1] - to[1]) - 5) < 0.01);
  assert.deepEqual(await texts(3, '.chart-key:not(.chart-zoom, .chart-save)'), []);

  // A chart without points, or with one point, is drawn.
  for (const n of [4, 5, 6]) {
    assert.ok((await texts(n, LABELS)).length >= 2);
    const drawn = await page.evaluate(
        `document.querySelectorAll('.chart')[${n}].querySelector('svg').outerHTML`);
    assert.doesNotMatch(drawn, /NaN|Infinity|null/);
  }
  assert.equal((await all(6, MARKS, 'cx')).length, 1);

  // Values are shown at the pointer.
  const box = await page.evaluate(`(() => { const b = document.querySelector('.chart svg')
      .getBoundingClientRect(); return [b.x, b.y, b.width]; })()`);
  await page.hover(box[0] + box[2] - 15, box[1] + 60);
  assert.deepEqual(await texts(0, '.chart-tip'), ['10</svg>4marks–']);

  // A time axis has marks at any first time.
  const module = readFileSync('modules/charts/page/charts.js').toString('base64');
  const marks = await page.evaluate(`(async () => {
      const charts = await import('data:text/javascript;base64,${module}');
      const host = document.createElement('div');
      host.style.width = '480px';
      document.querySelector('main').append(host);
      charts.lineChart(host, {x: charts.duration}).set([{name: 'a', points: [[0.05, 1], [7.4, 1]]}]);
      return [...host.querySelectorAll('text')].map((e) => e.textContent).slice(-3); })()`);
  assert.deepEqual(marks, ['0:02', '0:04', '0:06']);

  // A saved picture is XML, with names, in colours that need no page.
  await page.evaluate(`URL.createObjectURL = (blob) => { window.saved = blob.text(); return 'x:'; };
      HTMLAnchorElement.prototype.click = function() { window.savedAs = this.download; };
      document.querySelector('.chart-save').click()`);
  assert.equal(await page.evaluate('window.savedAs'), 'a_b_i_.svg');
  const saved = await page.evaluate('window.saved');
  assert.match(saved, /^<svg xmlns="http:\/\/www\.w3\.org\/2000\/svg"/);
  assert.match(saved, />a &lt; b &amp; &lt;i&gt;</);
  assert.match(saved, />&lt;\/svg&gt;</);
  assert.doesNotMatch(saved, /var\(|class="chart-hover"/);
  const size = await page.evaluate(`(async () => { const image = new Image();
      image.src = 'data:image/svg+xml,' + encodeURIComponent(await window.saved);
      await image.decode(); return [image.naturalWidth, image.naturalHeight]; })()`);
  assert.equal(size[0], Math.round(box[2]));
  assert.ok(size[1] > 260);

  assert.deepEqual(page.errors, []);
} finally {
  await browser.close();
}
