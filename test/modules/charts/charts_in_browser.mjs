// Opens the page of test_chart_page.cpp, adds charts, and checks the content of all.
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
  // After the map of the page: lines, decades, bars, nothing twice, one point.
  const module = readFileSync('modules/charts/page/charts.js').toString('base64');
  await page.evaluate(`(async () => {
      window.charts = await import('data:text/javascript;base64,${module}');
      window.host = () => document.querySelector('main').appendChild(document.createElement('div'));
      const line = (options, series) => charts.lineChart(host(), {height: 260, ...options})
          .set(series.map((s, i) => ({color: charts.robotColor(i), ...s})));
      line({title: 'a < b & <i>', unit: 'm'}, [
        {name: '</svg>', points: [[0, 0], [4, 1], [5, NaN], [6, 3], [10, 4]]},
        {name: 'more', points: [[2, 1], [8, NaN]]}]);
      line({title: 'decades', logY: true}, [
        {name: 'a', points: [[1, 0.02], [2, 0], [3, -1], [4, 50], [5, 2e-3]]},
        {name: 'b', points: [[1, 10], [5, 10]]},
        {name: 'b', points: [[1, 5], [5, 20]]}]);
      charts.barChart(host(), {title: 'bars', unit: 'cm'}).set([
        {name: 'before', color: charts.robotColor(0), values: {two: 4}},
        {name: 'after', color: charts.GREY, values: {two: 2, one: 1}}]);
      line({title: 'nothing'}, [{name: 'none', points: []},
                                {name: '', points: [[NaN, 1], [1, Infinity]]}]);
      line({title: 'nothing, by decades', logY: true}, []);
      line({title: 'one point'}, [{name: '', points: [[0, -3]]}]); })()`);
  if (shot) await page.screenshot(shot);
  // Attributes of the elements of the n-th chart, and all its text.
  const all = (n, where, name) => page.evaluate(`[...document.querySelectorAll('.chart')[${
      n}].querySelectorAll('${where}')].map((e) => e.getAttribute('${name}'))`);
  const texts = (n, where) => page.evaluate(`[...document.querySelectorAll('.chart')[${
      n}].querySelectorAll('${where}')].map((e) => e.textContent)`);
  const points = (d) => d.split(/[MLh]/).filter((p) => p).map((p) => p.split(' ').map(Number));
  const LINES = 'svg path', LABELS = 'svg text', BARS = 'svg rect';

  // A map has one scale for both axes.
  const [from, to] = points((await all(0, LINES, 'd'))[0]);
  assert.ok(Math.abs((to[0] - from[0]) / (from[1] - to[1]) - 5) < 0.01);
  assert.deepEqual(await texts(0, '.chart-key:not(.chart-zoom, .chart-save)'), []);

  // Text is shown as text.
  assert.deepEqual(await texts(1, '.chart-title'), ['a < b & <i>m']);
  assert.deepEqual(await texts(1, '.chart-key:not(.chart-save)'), ['</svg>', 'more']);

  // A point that is not finite interrupts a line. The x axis is tight; y begins at 0 with a margin.
  const [line] = await all(1, LINES, 'd');
  assert.match(line, /^M[^ML]*L[^ML]*M[^ML]*L[^ML]*$/);
  const [a, b, , d] = points(line);
  assert.ok(Math.abs((d[0] - a[0]) - 2.5 * (b[0] - a[0])) < 0.3);
  assert.ok(Math.abs((a[1] - d[1]) - 4 * (a[1] - b[1])) < 0.5);
  assert.deepEqual(
      await texts(1, LABELS), ['0', '1', '2', '3', '4', '0', '2', '4', '6', '8', '10']);

  // A value without a logarithm interrupts a line too; all decades are there.
  const decades = await all(2, LINES, 'd');
  assert.match(decades[0], /^M[^ML]*M[^ML]*L[^ML]*$/);
  const labels = await texts(2, LABELS);
  assert.ok(labels.includes('0.001') && labels.includes('100'), labels.join());
  assert.equal(points(decades[1])[0][1], points(decades[1])[1][1]);

  // A name has one entry in the legend for its two lines.
  assert.deepEqual(await texts(2, '.chart-key:not(.chart-save)'), ['a', 'b']);
  const pressB = `[...document.querySelectorAll('.chart')[2].querySelectorAll('.chart-key')].find(
      (key) => key.textContent === 'b').click()`;
  await page.evaluate(pressB);
  assert.equal((await all(2, LINES, 'd')).length, 1);
  await page.evaluate(pressB);

  // The length of a bar is its value; a group has the largest value beside it.
  const lengths = (await all(3, BARS, 'width')).map(Number);
  assert.ok(Math.abs(lengths[1] / lengths[0] - 0.5) < 2e-3);
  assert.ok(Math.abs(lengths[3] / lengths[0] - 0.25) < 2e-3);
  assert.deepEqual(await texts(3, 'svg > text'), ['two', '4 cm', 'one', '1 cm']);

  // A chart without points, or with one point, is drawn.
  for (const n of [4, 5, 6]) {
    assert.ok((await texts(n, LABELS)).length >= 2);
    const drawn = await page.evaluate(
        `document.querySelectorAll('.chart')[${n}].querySelector('svg').outerHTML`);
    assert.doesNotMatch(drawn, /NaN|Infinity|null/);
  }

  // Values are shown at the pointer.
  const box = await page.evaluate(`(() => { const b = document.querySelectorAll('.chart')[1]
      .querySelector('svg').getBoundingClientRect(); return [b.x, b.y, b.width]; })()`);
  await page.hover(box[0] + box[2] - 15, box[1] + 60);
  assert.deepEqual(await texts(1, '.chart-tip'), ['10</svg>4 mmore–']);

  // A time axis has marks at any first time.
  const marks = await page.evaluate(`(() => {
      const host = window.host();
      host.style.width = '480px';
      charts.lineChart(host, {x: charts.duration}).set([{name: 'a', points: [[0.05, 1], [7.4, 1]]}]);
      return [...host.querySelectorAll('text')].map((e) => e.textContent).slice(-3); })()`);
  assert.deepEqual(marks, ['0:02', '0:04', '0:06']);

  // A saved picture is XML, with names, in colours that need no page.
  await page.evaluate(`URL.createObjectURL = (blob) => { window.saved = blob.text(); return 'x:'; };
      HTMLAnchorElement.prototype.click = function() { window.savedAs = this.download; };
      document.querySelectorAll('.chart-save')[1].click()`);
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
