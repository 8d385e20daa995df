// Charts as SVG in a page: lines over time, bars, trajectories from above. Self-contained: needs no
// other file. A chart fills the width of its element. set() draws it again. It can be saved as a
// picture.
//
//   const chart = lineChart(element, {title: 'Memory', unit: 'MB', x: duration});
//   chart.set([{name: 'robot0', color: robotColor(0), points: [[0, 80], [1, 82]]}]);
//
// Colours of text and grid are those of the page: --chart-ink, --chart-muted, --chart-grid,
// --chart-paper.

const ROBOT_COLORS =
    ['#1f77b4', '#ff7f0e', '#d62728', '#2ca02c', '#9467bd', '#17becf', '#8c564b', '#e377c2'];

/** The colour of a robot in all charts. */
export const robotColor = (id) => ROBOT_COLORS[id % ROBOT_COLORS.length];

const KIND_COLORS =
    ['#4c9be8', '#e8a34c', '#b07cd8', '#5fb77c', '#d8746c', '#8b93a1', '#d6c25a', '#56b6c2'];
/** The colour of the n-th series that is not a robot. */
export const kindColor = (n) => KIND_COLORS[n % KIND_COLORS.length];

/** Colour of a series for comparison, such as the truth. */
export const GREY = '#98a1ae';

// ---- texts of numbers

const trimmed = (value, digits) => String(Number(value.toPrecision(digits)));

/** "0.012", "1.2 k", "3.4 M", followed by the unit. */
export function quantity(value, unit = '') {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (unit === '%') return `${trimmed(value, size < 10 ? 2 : 3)} %`;
  const steps = [[1e9, 'G'], [1e6, 'M'], [1e3, 'k']];
  for (const [step, prefix] of steps)
    if (size >= step) return `${trimmed(value / step, 3)} ${prefix}${unit}`;
  if (size > 0 && size < 1e-3)
    return `${value.toExponential(2).replace(/\.?0*e/, 'e')}${unit && ` ${unit}`}`;
  return `${trimmed(value, 3)}${unit && ` ${unit}`}`;
}

/** Seconds as "0:07" or "1:02:03". */
export function duration(seconds) {
  const whole = Math.max(0, Math.floor(seconds + 1e-6));
  const two = (n) => String(n).padStart(2, '0');
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

// ---- axes

// Round numbers that cover [low, high], about `count` of them.
function ticks(low, high, count, steps = [1, 2, 5, 10]) {
  const rough = (high - low) / Math.max(1, count);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * steps.find((s) => s * power >= rough * 0.999);
  const all = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
    all.push(k * step);
  return all;
}

// Ticks of a time axis: minutes are divided by 60, not by 10.
function timeTicks(low, high, count) {
  const rough = (high - low) / Math.max(1, count);
  const step =
      [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600, 7200].find((s) => s >= rough) ||
      14400;
  const all = [];
  for (let x = Math.ceil(low / step) * step; x <= high + 1e-9; x += step) all.push(x);
  return all.length ? all : [low];
}

// Powers of ten, every k-th one if there are many.
function powerTicks(low, high, count) {
  const from = Math.ceil(Math.log10(low) - 1e-9), to = Math.floor(Math.log10(high) + 1e-9);
  const every = Math.max(1, Math.ceil((to - from + 1) / count));
  const all = [];
  for (let k = from; k <= to; ++k)
    if ((k - from) % every === 0) all.push(10 ** k);
  return all;
}

// Text of a power of ten: "0.01", "1e5".
function powerText(value) {
  const plain = value > 0.999e-3 && value < 1.001e3;
  return plain ? trimmed(value, 1) : value.toExponential(0).replace('e+', 'e');
}

function extent(series, axis, accepts = Number.isFinite) {
  let low = Infinity, high = -Infinity;
  for (const one of series)
    for (const point of one.points)
      if (accepts(point[axis])) {
        low = Math.min(low, point[axis]);
        high = Math.max(high, point[axis]);
      }
  return low <= high ? [low, high] : null;
}

// ---- drawing

const escaped = (text) => String(text).replace(
    /[&<>"]/g, (c) => ({'&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;'})[c]);
const px = (x) => Math.round(x * 10) / 10;

function element(tag, className, parent, text) {
  const made = document.createElement(tag);
  made.className = className;
  if (text !== undefined) made.textContent = text;
  parent?.append(made);
  return made;
}

const STYLE = `
.chart { position: relative; color: var(--chart-ink, #222); font-size: 11px; font-variant-numeric: tabular-nums; }
.chart-head { display: flex; align-items: baseline; flex-wrap: wrap; gap: 2px 10px; margin-bottom: 3px; }
.chart-title { font-weight: 600; font-size: 12px; margin-right: auto; }
.chart-unit { font-weight: 400; color: var(--chart-muted, #666); margin-left: 6px; }
.chart-key { display: inline-flex; align-items: center; gap: 5px; color: var(--chart-muted, #666); cursor: pointer;
  background: none; border: 0; padding: 0; font: inherit; }
.chart-key i { width: 10px; height: 3px; border-radius: 2px; }
.chart-key.off { opacity: 0.35; }
.chart-zoom { min-width: 20px; justify-content: center; border: 1px solid var(--chart-grid, #e3e5e8); border-radius: 4px; }
.chart-body { position: relative; }
.chart-save { position: absolute; top: 8px; right: 14px; padding: 1px 6px; border: 1px solid var(--chart-grid, #e3e5e8);
  border-radius: 4px; background: var(--chart-paper, #fff); opacity: 0; }
.chart:hover .chart-save, .chart-save:focus-visible { opacity: 1; }
.chart div > svg { display: block; width: 100%; }
.chart svg text { fill: var(--chart-muted, #666); font-size: 10px; }
.chart-grid { stroke: var(--chart-grid, #e3e5e8); shape-rendering: crispEdges; }
.chart-cursor { stroke: var(--chart-muted, #666); shape-rendering: crispEdges; }
.chart-tip { position: absolute; pointer-events: none; z-index: 5; padding: 5px 8px; border-radius: 5px; white-space: nowrap;
  background: var(--chart-paper, #fff); border: 1px solid var(--chart-grid, #ccc); box-shadow: 0 2px 10px #0004; }
.chart-tip div { display: flex; align-items: center; gap: 6px; }
.chart-tip i { width: 7px; height: 7px; border-radius: 50%; }
.chart-tip b { margin-left: auto; padding-left: 10px; font-weight: 600; }
@media print {
  .chart { break-inside: avoid; }
  .chart-zoom, .chart-save { display: none; }
}`;

function ensureStyle() {
  if (document.getElementById('chart-style')) return;
  const style = element('style', '', document.head, STYLE);
  style.id = 'chart-style';
}

// Parts common to all charts: head with title and legend, a canvas that follows the width, hidden
// series.
function frame(host, options, draw) {
  ensureStyle();
  const root = element('div', 'chart', host);
  const head = element('div', 'chart-head', root);
  const title = element('span', 'chart-title', head, options.title);
  if (options.unit) element('span', 'chart-unit', title, options.unit);
  const keys = element('span', 'chart-head', head);
  keys.style.marginBottom = 0;
  const body = element('div', 'chart-body', root);
  const canvas = element('div', '', body);
  const save = element('button', 'chart-key chart-save', body, 'SVG');
  save.title = 'Save as SVG';
  save.onclick = () => saveChart(chart);
  const tip = element('div', 'chart-tip', root);
  tip.hidden = true;
  const chart = {
    title: options.title ?? '',
    root,
    head,
    canvas,
    tip,
    series: [],
    hidden: new Set(),
    width: 0
  };
  let legend = '';
  const drawLegend = () => {
    const now = chart.series.map((s) => `${s.name}${s.color}${chart.hidden.has(s.name)}`).join();
    if (now === legend) return;
    legend = now;
    keys.replaceChildren();
    const named = [...new Map(chart.series.map((s) => [s.name, s])).values()].filter((s) => s.name);
    if (named.length < 2) return;
    for (const one of named) {
      const key = element('button', `chart-key${chart.hidden.has(one.name) ? ' off' : ''}`, keys);
      element('i', '', key).style.background = one.color;
      key.append(one.name);
      key.title = 'Show or hide';
      key.onclick = () => {
        if (!chart.hidden.delete(one.name)) chart.hidden.add(one.name);
        redraw();
      };
    }
  };
  const redraw = () => {
    chart.width = canvas.clientWidth;
    drawLegend();
    if (chart.width > 60) draw(chart, chart.series.filter((s) => !chart.hidden.has(s.name)));
  };
  new ResizeObserver(() => canvas.clientWidth !== chart.width && redraw()).observe(canvas);
  chart.redraw = redraw;
  chart.set = (series) => {
    chart.series = series;
    redraw();
  };
  return chart;
}

// If there are more points than pixels: the lowest and the highest point in each column.
function thinned(points, toX) {
  if (points.length < 2000) return points;
  const kept = [];
  let column = NaN, low = null, high = null;
  const flush = () => low &&
      kept.push(
          ...(low === high         ? [low] :
                  low[0] < high[0] ? [low, high] :
                                     [high, low]));
  for (const point of points) {
    if (Math.floor(toX(point[0])) !== column) {
      flush();
      column = Math.floor(toX(point[0]));
      low = high = point;
    }
    if (point[1] < low[1]) low = point;
    if (point[1] > high[1]) high = point;
  }
  flush();
  return kept;
}

function path(points, toX, toY) {
  let d = '', pen = 'M';
  for (const [x, y] of points) {
    const at = [toX(x), toY(y)];
    if (!at.every(Number.isFinite)) {
      pen = 'M';
      continue;
    }
    d += pen + at.map(px).join(' ');
    pen = 'L';
  }
  return d;
}

function seriesSvg(one, points, toX, toY) {
  const dash = one.dashed ? ' stroke-dasharray="4 3"' : '';
  return `<path fill="none" stroke="${one.color}" opacity="${one.opacity ?? 1}" stroke-width="${
      one.width ?? 1.5}" stroke-linejoin="round"${dash} d="${path(points, toX, toY)}"/>`;
}

/**
 * Lines over a common x. set() takes {name, color, points, width, dashed}. Options:
 * - title; unit of y; height [px];
 * - logY;
 * - x: function for the text of an x (default: the number);
 * - from0: y begins at 0 (default: true without logY);
 * - cursor: x of a vertical line.
 */
export function lineChart(host, options = {}) {
  const {
    unit = '',
    height = 120,
    logY = false,
    from0 = !logY,
    x: textOfX = (x) => quantity(x)
  } = options;
  const time = textOfX === duration;
  let scale = null;
  const chart = frame(host, options, (self, series) => {
    const positive = (y) => Number.isFinite(y) && (!logY || y > 0);
    const [x0, x1] = options.range ?? extent(series, 0) ?? [0, 1];
    let [y0, y1] = extent(series, 1, positive) ?? [logY ? 1 : 0, logY ? 10 : 1];
    // Values six powers of ten below the largest are not shown.
    if (logY)
      [y0, y1] = [
        10 ** Math.floor(Math.log10(Math.max(y0, 1e-6 * y1)) + 1e-9),
        10 ** Math.ceil(Math.log10(y1) - 1e-9)
      ];
    else if (from0)
      [y0, y1] = [Math.min(0, y0), y1 > 0 ? y1 * 1.06 : y0 < 0 ? 0 : 1];
    if (!(y1 > y0)) [y0, y1] = logY ? [y0, 10 * y0] : [y0 - 0.5, y0 + 0.5];
    const marks = logY ? powerTicks(y0, y1, height / 30) : ticks(y0, y1, height / 36);
    const labels = marks.map((y) => (logY ? powerText(y) : quantity(y)));
    const left = 12 + 6 * Math.max(...labels.map((l) => l.length), 2), right = 12, top = 6,
          bottom = 18;
    const width = self.width, span = x1 > x0 ? x1 - x0 : 1;
    const toX = (x) => left + ((x - x0) / span) * (width - left - right);
    const f = logY ? (y) => (y > 0 ? Math.log10(Math.max(y, y0)) : NaN) : (y) => y;
    const toY = (y) =>
        height - bottom - ((f(y) - f(y0)) / (f(y1) - f(y0))) * (height - top - bottom);
    let svg = `<svg viewBox="0 0 ${width} ${height}" height="${height}" role="img" aria-label="${
        escaped(options.title ?? '')}">`;
    marks.forEach((y, i) => {
      svg += `<line class="chart-grid" x1="${left}" x2="${width - right}" y1="${px(toY(y))}" y2="${
          px(toY(y))}"/>`;
      svg += `<text x="${left - 6}" y="${px(toY(y)) + 3}" text-anchor="end">${labels[i]}</text>`;
    });
    for (const x of (time ? timeTicks : ticks)(x0, x0 + span, width / 90))
      svg += `<text x="${px(toX(x))}" y="${height - bottom + 14}" text-anchor="middle">${
          escaped(textOfX(x))}</text>`;
    for (const one of series) svg += seriesSvg(one, thinned(one.points, toX), toX, toY);
    if (Number.isFinite(options.cursor))
      svg += `<line class="chart-cursor" x1="${px(toX(options.cursor))}" x2="${
          px(toX(options.cursor))}" y1="${top}" y2="${height - bottom}"/>`;
    self.canvas.innerHTML = `${svg}<g class="chart-hover"></g></svg>`;
    scale = {toX, toY, series, left, right, top, bottom, height, x0, span, width};
  });
  hover(chart, () => scale, textOfX, unit, height);
  chart.options = options;
  return chart;
}

// The point of `points` (ascending in x) nearest to x.
function nearest(points, x) {
  let low = 0, high = points.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (points[middle][0] <= x)
      low = middle;
    else
      high = middle;
  }
  if (high < 0) return null;
  return Math.abs(points[low][0] - x) <= Math.abs(points[high][0] - x) ? points[low] : points[high];
}

// At the pointer: a line, a dot on each series, and their values.
function hover(chart, scaleOf, textOfX, unit, height) {
  chart.canvas.onpointerleave = () => {
    chart.tip.hidden = true;
    const group = chart.canvas.querySelector('.chart-hover');
    if (group) group.innerHTML = '';
  };
  chart.canvas.onpointermove = (event) => {
    const s = scaleOf();
    const group = chart.canvas.querySelector('.chart-hover');
    if (!s || !group) return;
    const at = event.clientX - chart.canvas.getBoundingClientRect().left;
    const x = s.x0 + ((at - s.left) / (s.width - s.left - s.right)) * s.span;
    const found =
        s.series.map((one) => [one, nearest(one.points, x)]).filter(([, p]) => p);
    if (!found.length) return;
    const shown =
        found.reduce((a, b) => (Math.abs(a[1][0] - x) <= Math.abs(b[1][0] - x) ? a : b))[1][0];
    const line = px(s.toX(shown));
    group.innerHTML = `<line class="chart-cursor" x1="${line}" x2="${line}" y1="${s.top}" y2="${
                          height - s.bottom}"/>` +
        found.filter(([, p]) => Number.isFinite(s.toY(p[1])))
            .map(
                ([one, p]) => `<circle r="3" fill="${one.color}" cx="${px(s.toX(p[0]))}" cy="${
                    px(s.toY(p[1]))}"/>`)
            .join('');
    showTip(
        chart, at, escaped(textOfX(shown)), found.map(([one, p]) => [one, quantity(p[1], unit)]));
  };
}

function showTip(chart, at, head, rows) {
  chart.tip.innerHTML = `<div>${head}</div>` +
      rows.map(
              ([one, text]) => `<div><i style="background:${one.color}"></i>${
                  escaped(one.name ?? '')}<b>${escaped(text)}</b></div>`)
          .join('');
  chart.tip.hidden = false;
  const width = chart.tip.offsetWidth;
  chart.tip.style.left = `${Math.max(0, Math.min(at + 12, chart.width - width))}px`;
  if (at + 12 + width > chart.width) chart.tip.style.left = `${Math.max(0, at - width - 12)}px`;
  chart.tip.style.top = '24px';
}

/**
 * Groups of horizontal bars, a bar per series in each. set() takes {name, color, values: {group:
 * value}}. Options:
 * - title; unit;
 * - most: number of groups shown, the largest first;
 * - full: value of a bar over the whole width.
 */
export function barChart(host, options = {}) {
  const {unit = '', most = 8} = options;
  return frame(host, options, (self, series) => {
    const groups = [...new Set(series.flatMap((s) => Object.keys(s.values)))];
    const largest = (g) => Math.max(...series.map((s) => s.values[g] ?? 0));
    groups.sort((a, b) => largest(b) - largest(a) || (a < b ? -1 : 1)).splice(most);
    const bar = 5, gap = 2, row = Math.max(18, series.length * (bar + gap) + 8);
    const left = 10 + 6.3 * Math.max(...groups.map((g) => g.length), 4), right = 44;
    const full = options.full ?? Math.max(1e-12, ...groups.map(largest));
    const height = Math.max(20, row * groups.length + 2);
    let svg = `<svg viewBox="0 0 ${self.width} ${height}" height="${
        height}" role="img" aria-label="${escaped(options.title ?? '')}">`;
    groups.forEach((group, g) => {
      const middle = g * row + row / 2;
      svg += `<text x="${px(left - 8)}" y="${middle + 3}" text-anchor="end">${
          escaped(group.replaceAll('_', ' '))}</text>`;
      series.forEach((one, i) => {
        const value = one.values[group] ?? 0;
        const y = middle + (i - series.length / 2) * (bar + gap) + gap / 2;
        const length = Math.max(1, Math.min(1, value / full) * (self.width - left - right));
        svg += `<rect x="${px(left)}" y="${px(y)}" width="${px(length)}" height="${
                   bar}" rx="1.5" fill="${one.color}">` +
            `<title>${escaped(`${one.name}: ${quantity(value, unit)}`)}</title></rect>`;
      });
      svg += `<text x="${self.width}" y="${middle + 3}" text-anchor="end">${
          escaped(quantity(largest(group), unit))}</text>`;
    });
    self.canvas.innerHTML = `${svg}</svg>`;
  });
}

// Visible part of a map: the middle [m] and pixels per metre. Dragging moves it, Ctrl and the wheel
// zoom at the pointer, a double click shows everything again. `view` is null until then.
function navigate(chart, scaleOf) {
  chart.view = null;
  const place = (event) => {
    const box = chart.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const show = (view) => {
    chart.view = view;
    chart.tip.hidden = true;
    chart.redraw();
  };
  const zoom = (factor, [at, down]) => {
    const s = scaleOf();
    if (!s) return;
    const scale = s.scale * factor;
    show({
      x: s.atX(at) - (at - s.toX(s.middle[0])) / scale,
      y: s.atY(down) + (down - s.toY(s.middle[1])) / scale,
      scale
    });
  };
  const middle = () => {
    const s = scaleOf();
    return s ? [s.toX(s.middle[0]), s.toY(s.middle[1])] : [0, 0];
  };
  for (const [text, title, act] of [
           ['+', 'Zoom in', () => zoom(1.5, middle())],
           ['−', 'Zoom out', () => zoom(1 / 1.5, middle())],
           ['All', 'Show all', () => show(null)]]) {
    const key = element('button', 'chart-key chart-zoom', chart.head, text);
    key.title = title;
    key.onclick = act;
  }
  chart.canvas.style.cursor = 'grab';
  chart.canvas.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && !event.metaKey) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 300), place(event));
  }, {passive: false});
  chart.canvas.ondblclick = () => show(null);
  let from = null;
  chart.canvas.onpointerdown = (event) => {
    const s = scaleOf();
    if (event.button !== 0 || !s) return;
    chart.canvas.setPointerCapture(event.pointerId);
    from = {at: place(event), view: {x: s.middle[0], y: s.middle[1], scale: s.scale}};
  };
  chart.canvas.onpointerup = chart.canvas.onpointercancel = () => from = null;
  chart.canvas.onpointerleave = () => chart.tip.hidden = true;
  chart.canvas.onpointermove = (event) => {
    const [x, y] = place(event);
    if (!from) return point(chart, scaleOf(), x, y);
    const {view, at} = from;
    show({...view, x: view.x - (x - at[0]) / view.scale, y: view.y + (y - at[1]) / view.scale});
  };
}

// Shows the text of the point of a map nearest to the pointer.
function point(chart, s, x, y) {
  const reach_px = 14;
  let found = null, least = reach_px * reach_px;
  for (const one of s?.series ?? [])
    for (const place of one.points) {
      const distance = (s.toX(place[0]) - x) ** 2 + (s.toY(place[1]) - y) ** 2;
      if (distance < least) [found, least] = [[one, place], distance];
    }
  chart.tip.hidden = !found;
  if (!found) return;
  const [one, place] = found;
  const head = `${place[0].toFixed(2)}, ${place[1].toFixed(2)} m`;
  showTip(chart, x, head, [[one, one.describe?.(place) ?? '']]);
  chart.tip.style.top = `${y + 12}px`;
}

/**
 * Trajectories seen from above [m], both axes with one scale. set() takes series of lineChart()
 * with a function `describe`, which returns the text for the point at the pointer. A point that is not a
 * number interrupts a line. Options: title, height [px].
 */
export function mapChart(host, options = {}) {
  const {height = 360} = options;
  const left = 54, right = 10, top = 8, bottom = 36;
  let shown = null;
  const chart = frame(host, options, (self, series) => {
    const [x0, x1] = extent(series, 0) ?? [0, 1], [y0, y1] = extent(series, 1) ?? [0, 1];
    const wide = self.width - left - right, high = height - top - bottom;
    const all = Math.min(wide / Math.max(x1 - x0, 1e-3), high / Math.max(y1 - y0, 1e-3)) * 0.94;
    const {scale, x: middleX, y: middleY} =
        self.view ?? {scale: all, x: (x0 + x1) / 2, y: (y0 + y1) / 2};
    const toX = (x) => left + wide / 2 + (x - middleX) * scale;
    const toY = (y) => top + high / 2 - (y - middleY) * scale;
    const atX = (p) => middleX + (p - left - wide / 2) / scale;
    const atY = (p) => middleY - (p - top - high / 2) / scale;
    let svg = `<svg viewBox="0 0 ${self.width} ${height}" height="${
        height}" role="img" aria-label="${escaped(options.title ?? '')}">`;
    for (const x of ticks(atX(left), atX(self.width - right), wide / 80))
      svg += `<line class="chart-grid" x1="${px(toX(x))}" x2="${px(toX(x))}" y1="${top}" y2="${
                 top + high}"/>` +
          `<text x="${px(toX(x))}" y="${height - 21}" text-anchor="middle">${quantity(x)}</text>`;
    for (const y of ticks(atY(top + high), atY(top), high / 60))
      svg += `<line class="chart-grid" x1="${left}" x2="${self.width - right}" y1="${
                 px(toY(y))}" y2="${px(toY(y))}"/>` +
          `<text x="${left - 6}" y="${px(toY(y)) + 3}" text-anchor="end">${quantity(y)}</text>`;
    svg += `<text x="${left + wide / 2}" y="${height - 5}" text-anchor="middle">x [m]</text>` +
        `<text transform="translate(12 ${
               top + high / 2}) rotate(-90)" text-anchor="middle">y [m]</text>`;
    // Clips at the axes.
    svg += `<svg x="${left}" y="${top}" width="${wide}" height="${high}" viewBox="${left} ${top} ${
        wide} ${high}">`;
    for (const one of series) svg += seriesSvg(one, one.points, toX, toY);
    self.canvas.innerHTML = `${svg}</svg></svg>`;
    shown = {toX, toY, atX, atY, scale, middle: [middleX, middleY], series};
  });
  navigate(chart, () => shown);
  return chart;
}

// ---- pictures

// Colours of a saved picture, which has no page to take them from.
const PICTURE_COLORS = {
  ink: '#15181d',
  muted: '#555d69',
  grid: '#e1e4e8',
  paper: '#ffffff'
};

/** The visible part of the chart as the text of an SVG file, on white. */
export function chartSvg(chart) {
  const drawn = chart.canvas.firstElementChild.cloneNode(true);
  const make = (parent, tag, attributes, text) => {
    const made = document.createElementNS(drawn.namespaceURI, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text;
    parent?.append(made);
    return made;
  };
  const origin = chart.root.getBoundingClientRect();
  const boxOf = (of) => {
    const box = of.getBoundingClientRect();
    return {x: box.left - origin.left, y: box.top - origin.top, height: box.height};
  };
  const {muted, ink, grid, paper} = PICTURE_COLORS;
  const top = boxOf(chart.canvas).y, height = top + Number(drawn.getAttribute('height'));
  const svg = make(null, 'svg', {
    viewBox: `0 0 ${chart.width} ${height}`,
    width: chart.width,
    height,
    'font-family': 'sans-serif',
    'font-size': 11
  });
  make(svg, 'rect', {width: chart.width, height, fill: paper});
  // The head has its position in the page.
  const label = (of, text, x, attributes) => {
    const box = boxOf(of);
    make(
        svg, 'text', {x: box.x + x, y: box.y + 0.78 * box.height, fill: muted, ...attributes},
        text);
  };
  const title = chart.head.querySelector('.chart-title');
  label(title, chart.title, 0, {fill: ink, 'font-size': 12, 'font-weight': 600});
  for (const unit of title.querySelectorAll('.chart-unit')) label(unit, unit.textContent, 0);
  for (const key of chart.head.querySelectorAll('.chart-key:not(.off, .chart-zoom)')) {
    const {x, y, height: high} = boxOf(key);
    const mark = {x, y: y + high / 2 - 1.5, width: 10, height: 3};
    make(svg, 'rect', {...mark, fill: key.firstElementChild.style.background});
    label(key, key.textContent, 15);
  }
  drawn.querySelector('.chart-hover')?.remove();
  for (const text of drawn.querySelectorAll('text')) {
    text.setAttribute('fill', muted);
    text.setAttribute('font-size', 10);
  }
  for (const line of drawn.querySelectorAll('.chart-grid')) line.setAttribute('stroke', grid);
  for (const line of drawn.querySelectorAll('.chart-cursor')) line.setAttribute('stroke', muted);
  drawn.setAttribute('y', top);
  drawn.setAttribute('width', chart.width);
  svg.append(drawn);
  return `${new XMLSerializer().serializeToString(svg)}\n`;
}

function saveChart(chart) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([chartSvg(chart)], {type: 'image/svg+xml'}));
  link.download = `${(chart.title || 'chart').replace(/[^\w.-]+/g, '_')}.svg`;
  link.click();
  URL.revokeObjectURL(link.href);
}
