// The report of a run: shows the JSON in #run, whose keys report_page.hpp documents. Follows
// charts.js in one module. Text of the data is inserted as text only, never as HTML.

const STAGES = ['candidate', 'requested', 'received', 'verified', 'kept'];  // ClosureStage
const KEPT = 4, VERIFIED = 3;
const STAGE_COLORS = ['#8b93a1', '#8b93a1', '#d8746c', '#e8a34c', '#6fdc8c'];
const SEVERITY_BADGES = {
  error: 'bad',
  warning: 'warn',
  note: ''
};

const run = JSON.parse(document.getElementById('run').textContent);
const nameOf = (id) => run.robots.find((robot) => robot.id === id)?.name ?? `robot ${id}`;
const total = (numbers) => numbers.reduce((sum, number) => sum + number, 0);
const decimals = (value, count) => (Number.isFinite(value) ? value.toFixed(count) : '–');

function addSection(title, id, remark) {
  const section = element('section', '', document.querySelector('main'));
  section.id = id;
  element('h2', '', section, title);
  if (remark) element('p', 'muted', section, remark);
  return section;
}

// Columns: {title, text: function of a row, long, left, color: function of a row}. `sums`: true if
// the last row has sums.
function addTable(host, columns, rows, sums = false) {
  const table = element('table', '', element('div', 'scroll', host));
  const head = element('tr', '', element('thead', '', table));
  const kind = (column) =>
      `${column.left || column.long ? 'text' : ''}${column.long ? ' long' : ''}`;
  for (const column of columns) element('th', kind(column), head, column.title);
  const body = element('tbody', '', table);
  rows.forEach((row, r) => {
    const line = element('tr', sums && r === rows.length - 1 ? 'sum' : '', body);
    for (const column of columns) {
      const cell = element('td', kind(column), line);
      const color = column.color?.(row);
      if (color) element('i', '', cell).style.background = color;
      cell.append(column.text(row) ?? '–');
    }
  });
  return table;
}

// ---- the whole team

function showHead() {
  const main = document.querySelector('main');
  const header = element('header', '', main);
  element('h1', '', header, 'Report of a run');
  element('span', '', header, run.folder);
  document.title = `Report of a run: ${run.folder}`;
  const facts = element('dl', '', main);
  facts.id = 'facts';
  const fact = (term, text) => {
    const pair = element('div', '', facts);
    element('dt', '', pair, term);
    element('dd', '', pair, text);
  };
  const robots = run.team.robots;
  fact('Robots', String(robots.length));
  fact('Keyframes', quantity(total(robots.map((r) => r.keyframes ?? 0))));
  fact('Closures kept', quantity(total(robots.map((r) => r.closures?.inliers ?? 0))));
  fact('Sent', quantity(total(robots.flatMap((r) => Object.values(r.traffic ?? {}))), 'B'));
  if (run.team.optimized)
    fact('Error of the team, rmse', quantity(run.team.optimized.joint.position_m.rmse, 'm'));
  fact('Wall time', duration(Math.max(0, ...robots.map((r) => r.seconds ?? 0))));
  if (run.map) element('img', 'map', main).src = run.map;
}

function showFindings() {
  const section = addSection('What stands out', 'findings');
  const add = (badge, label, who, finding) => {
    const root = element('div', 'finding', section);
    element('span', `badge ${badge}`, root, label);
    const words = element('div', '', root);
    // Findings of a robot begin with its name.
    const what = String(finding.what);
    element('b', '', words, what.startsWith(`${who}: `) ? what : `${who}: ${what}`);
    if (finding.id) element('span', 'muted', words, `  ${finding.id}`);
    if (finding.means) element('p', '', words, finding.means);
    if (finding.to_do) element('p', 'to-do', words, finding.to_do);
  };
  const grave = ['error', 'warning', 'note'];
  const all = run.team.robots.flatMap(
      (robot) => (robot.findings ?? []).map((finding) => [robot.name, finding]));
  all.sort((a, b) => grave.indexOf(a[1].severity) - grave.indexOf(b[1].severity));
  for (const robot of run.team.robots)
    if (robot.exit_code || robot.exit_signal)
      add('bad', 'failed', robot.name, {
        what: robot.exit_signal ? `ended by signal ${robot.exit_signal}` :
                                  `exit code ${robot.exit_code}`,
        to_do: 'see its robot.log'
      });
  for (const [name, finding] of all)
    add(SEVERITY_BADGES[finding.severity] ?? '', finding.severity, name, finding);
  for (const robot of run.team.robots)
    for (const what of robot.notes ?? []) add('', 'note', robot.name, {what});
  for (const what of [...(run.team.notes ?? []), ...run.notes]) add('', 'note', 'team', {what});
  if (!section.querySelector('.finding')) element('p', 'muted', section, 'Nothing.');
}

function showRobots() {
  const section = addSection('Robots', 'robots');
  const optimized = (row) => run.team.optimized?.robots.find((r) => r.name === row.name);
  const closures = (key) => (row) => String(row.closures?.[key] ?? '–');
  const columns = [
    {title: 'robot', left: true, text: (r) => r.name, color: (r) => r.color},
    {title: 'frames', text: (r) => String(r.frames ?? '–')},
    {title: 'skipped', text: (r) => String(r.frames_skipped ?? '–')},
    {title: 'keyframes', text: (r) => String(r.keyframes ?? '–')},
    {title: 'candidates', text: closures('candidates')},
    {title: 'verified', text: closures('verified')},
    {title: 'kept', text: closures('inliers')},
    {title: 'sent', text: (r) => quantity(total(Object.values(r.traffic ?? {})), 'B')},
    {title: 'peak memory', text: (r) => quantity(r.process?.peak_memory_bytes, 'B')},
    {title: 'processor', text: (r) => quantity(r.process?.cpu_s, 's')},
    {title: 'end', long: true, text: (r) => r.exit_reason || '–'},
  ];
  if (run.team.optimized)
    columns.splice(
        4, 0,
        {title: 'odometry, rmse [m]', text: (r) => decimals(r.odometry_error?.position_m.rmse, 3)},
        {title: 'optimised, rmse [m]', text: (r) => decimals(optimized(r)?.position_m.rmse, 3)});
  // For a robot without a truth, "odometry" has only the statistics of its cameras.
  const rows = run.team.robots.map((robot) => ({
                                     ...robot,
                                     color: robotColor(robot.robot),
                                     odometry_error: robot.odometry?.position_m && robot.odometry
                                   }));
  addTable(section, columns, rows);
  if (run.team.optimized)
    element(
        'p', 'muted', section,
        'Odometry is aligned with the truth robot by robot, the optimised trajectories all by one transform.');
}

// ---- trajectories

// Kept closures as [robot that found it, row]; closures between two robots come first.
const closuresOf = (stage) => run.robots.flatMap(
    (robot) => robot.closures.filter((c) => c[4] === stage).map((c) => [robot, c]));

function closureLines() {
  const places = new Map(run.robots.map(
      (robot) => [robot.id, new Map(robot.keyframes.map(([i, x, y]) => [i, [x, y]]))]));
  const lines = [];
  for (const [, [fromRobot, from, toRobot, to]] of closuresOf(KEPT)) {
    const a = places.get(fromRobot)?.get(from), b = places.get(toRobot)?.get(to);
    const ends = `${nameOf(fromRobot)} ${from} – ${nameOf(toRobot)} ${to}`;
    if (a && b) lines.push([...a, ends], [...b, ends], [NaN, NaN]);
  }
  return lines;
}

// The line is interrupted at a hole, which is null in JSON.
const lineOf = (points) => points.map((point) => point.map((n) => n ?? NaN));

function showTrajectories() {
  if (!run.robots.some((robot) => robot.optimized.length)) return;
  const known = run.robots.some((robot) => robot.truth.length);
  const section = addSection(
      'Trajectories', 'trajectories',
      `From above, in the frame of the ${known ? 'truth' : 'team'}. A line ends where no ` +
          'pose is known. Drag to move, Ctrl and the wheel or the buttons to zoom, double click to see all; a name hides its line.');
  const chart =
      mapChart(element('div', '', section), {title: 'From above', unit: 'm', height: 520});
  const at = (what) => (p) => `${what}, ${duration(p[2])}`;
  const series = [];
  const truths = run.robots.flatMap((robot) => [...lineOf(robot.truth), [NaN, NaN]]);
  if (known) series.push({name: 'truth', color: GREY, points: truths, width: 3, describe: () => ''});
  const links = closureLines();
  if (links.length)
    series.push({
      name: 'closures kept',
      color: '#6fdc8c',
      opacity: 0.4,
      points: links,
      width: 0.8,
      describe: (p) => p[2] ?? ''
    });
  for (const robot of run.robots)
    series.push({
      name: robot.name,
      color: robotColor(robot.id),
      points: lineOf(robot.optimized),
      describe: at('optimised')
    });
  if (known)
    for (const robot of run.robots)
      series.push({
        name: `${robot.name}, odometry`,
        color: robotColor(robot.id),
        points: lineOf(robot.odometry),
        dashed: true,
        width: 1,
        describe: at('aligned alone')
      });
  for (const one of series)
    if (one.dashed) chart.hidden.add(one.name);
  chart.set(series);
}

const perRobot = (pointsOf) =>
    run.robots
        .map((robot) => ({name: robot.name, color: robotColor(robot.id), points: pointsOf(robot)}))
        .filter((series) => series.points.length);

// A chart in a cell of its own, or nothing without points.
function addLines(host, options, series) {
  if (!series.some((one) => one.points.length)) return;
  lineChart(element('div', '', host), {height: 190, x: duration, ...options}).set(series);
}

function showErrors() {
  if (!run.robots.some((robot) => robot.optimized_error.length || robot.odometry_error.length))
    return;
  const section = addSection(
      'Error over time', 'errors',
      'Distance from the truth; time since each robot\'s first pose. A line ends where no pose is known.');
  const grid = element('div', 'grid', section);
  addLines(
      grid, {title: 'Optimised', unit: 'm'}, perRobot((robot) => lineOf(robot.optimized_error)));
  addLines(
      grid, {title: 'Odometry, aligned robot by robot', unit: 'm'},
      perRobot((robot) => lineOf(robot.odometry_error)));
}

// ---- closures

function showStages(section, all) {
  const counts = new Map();
  for (const [, row] of all) {
    const key = `${row[4]} ${row[7]}`;
    const entry = counts.get(key) ?? {stage: row[4], reason: run.reasons[row[7]], count: 0};
    ++entry.count;
    counts.set(key, entry);
  }
  const rows = [...counts.values()].sort((a, b) => b.stage - a.stage || b.count - a.count);
  addTable(
      section,
      [
        {
          title: 'got as far as',
          left: true,
          text: (r) => STAGES[r.stage],
          color: (r) => STAGE_COLORS[r.stage]
        },
        {title: 'closures', text: (r) => String(r.count)}, {
          title: 'why no further',
          long: true,
          text: (r) => r.reason || (r.stage === KEPT ? '' : 'the run ended')
        }
      ],
      rows);
}

function showJudged(section) {
  const judged = run.team.closures;
  if (!judged) return;
  element('h3', '', section, 'Against the truth');
  const share = (value) => (Number.isFinite(value) ? quantity(100 * value, '%') : '–');
  addTable(
      section,
      [
        {title: 'stage', left: true, text: ([name]) => name},
        {title: 'judged', text: ([, s]) => String(s.judged)},
        {title: 'true', text: ([, s]) => String(s.correct)},
        {title: 'precision', text: ([, s]) => share(s.precision)},
        {title: 'of true pairs', text: ([, s]) => share(s.pair_recall)},
        {title: 'median error [m]', text: ([, s]) => decimals(s.translation_error_m?.median, 3)},
        {title: '[deg]', text: ([, s]) => decimals(s.rotation_error_deg?.median, 2)}
      ],
      [['candidates', judged.candidates], ['verified', judged.verified], ['kept', judged.inliers]]);
}

// Both images of each closure that has them; rejected closures come first.
function showImages(section, all) {
  const imageOf = (robot, keyframe) => run.images[`${robot}:${keyframe}`];
  const closures = new Map();  // if two robots have the same candidate, the one that came further
  for (const [, c] of all) {
    const key = c.slice(0, 4).join();
    if (c[4] >= VERIFIED && imageOf(c[0], c[1]) && imageOf(c[2], c[3]) && !closures.has(key))
      closures.set(key, c);
  }
  if (!closures.size) return;
  element('h3', '', section, 'What they saw');
  const host = element('div', '', section);
  host.id = 'images';
  const waiting = [...closures.values()].sort((a, b) => a[4] - b[4]);
  const more = element('button', 'pick', section);
  more.onclick = () => {
    for (const c of waiting.splice(0, 24)) {
      const figure = element('figure', '', host), sides = [[c[0], c[1]], [c[2], c[3]]];
      for (const side of sides) {
        const image = element('img', '', figure);
        image.src = imageOf(...side);
        image.alt = `${nameOf(side[0])} ${side[1]}`;
      }
      const caption = element('figcaption', '', figure);
      element('span', `badge ${c[4] === KEPT ? 'good' : 'warn'}`, caption, STAGES[c[4]]);
      element('b', '', caption, ` ${sides.map(([id, k]) => `${nameOf(id)} ${k}`).join(' – ')} `);
      caption.append(
          `${c[5]} matches of descriptors; ${c[6]} points agree with the pose`,
          run.reasons[c[7]] && `; ${run.reasons[c[7]]}`);
    }
    more.textContent = `${waiting.length} more`;
    more.hidden = !waiting.length;
  };
  more.onclick();
}

// List of closures, filtered by stage and pair of robots or complete.
function showList(section, all) {
  element('h3', '', section, 'One by one');
  const step = 50;
  const pick = element('div', 'pick', section), list = element('div', '', section);
  const more = element('button', 'pick', section);
  const pairOf = ([, [a, , b]]) => `${nameOf(Math.min(a, b))} – ${nameOf(Math.max(a, b))}`;
  let stage = null, pair = '', shown = step;
  const draw = () => {
    const found = all.filter(
        (one) => (stage === null || one[1][4] === stage) && (!pair || pairOf(one) === pair));
    list.replaceChildren();
    addTable(
        list,
        [
          {
            title: 'stage',
            left: true,
            text: ([, c]) => STAGES[c[4]],
            color: ([, c]) => STAGE_COLORS[c[4]]
          },
          {
            title: 'from',
            left: true,
            text: ([, c]) => `${nameOf(c[0])} ${c[1]}`,
            color: ([, c]) => robotColor(c[0])
          },
          {
            title: 'to',
            left: true,
            text: ([, c]) => `${nameOf(c[2])} ${c[3]}`,
            color: ([, c]) => robotColor(c[2])
          },
          {title: 'found by', left: true, text: ([robot]) => robot.name},
          {title: 'matches', text: ([, c]) => (c[5] ? String(c[5]) : '–')},
          {title: 'inliers', text: ([, c]) => (c[6] ? String(c[6]) : '–')},
          {title: 'why no further', long: true, text: ([, c]) => run.reasons[c[7]]}
        ],
        found.slice(0, shown));
    more.textContent = `${found.length - shown} more`;
    more.hidden = found.length <= shown;
    for (const button of pick.querySelectorAll('button'))
      button.classList.toggle('on', button.value === String(stage));
  };
  const choose = (change) => {
    change();
    shown = step;
    draw();
  };
  const count = (n) => all.filter(([, c]) => c[4] === n).length;
  for (const n of [null, 4, 3, 2, 1, 0]) {
    if (n !== null && !count(n)) continue;
    const button =
        element('button', '', pick, n === null ? `all ${all.length}` : `${STAGES[n]} ${count(n)}`);
    button.value = String(n);
    button.onclick = () => choose(() => stage = n);
  }
  const pairs = element('select', '', pick);
  pairs.append(new Option('all robots', ''));
  for (const name of [...new Set(all.map(pairOf))].sort()) pairs.append(new Option(name, name));
  pairs.onchange = () => choose(() => pair = pairs.value);
  more.onclick = () => {
    shown += 20 * step;
    draw();
  };
  draw();
}

function showClosures() {
  const all = [KEPT, VERIFIED, 2, 1, 0].flatMap(closuresOf);
  if (!all.length) return;
  const section = addSection(
      'Loop closures', 'closures',
      'What place recognition proposed, by how far it came. Each robot\'s own list: a pair that ' +
          'two robots looked at is there twice.');
  showStages(section, all);
  showJudged(section);
  showImages(section, all);
  showList(section, all);
}

// ---- bytes, cost, work

// Sum of the bytes sent by all robots, at every time for which some robot has a row.
function sentByKind() {
  const kinds = [...new Set(run.robots.flatMap((robot) => Object.keys(robot.sent)))].sort();
  return kinds.map((kind, k) => {
    const events = run.robots.flatMap(
        (robot) => (robot.sent[kind] ?? []).map(([t, bytes]) => [t, bytes, robot.id]));
    events.sort((a, b) => a[0] - b[0]);
    const newest = new Map(), points = [];
    for (const [t, bytes, id] of events) {
      newest.set(id, bytes);
      points.push([t, total([...newest.values()])]);
    }
    return {name: kind.replaceAll('_', ' '), color: kindColor(k), points};
  });
}

// Total of all kinds for one robot.
function sentInAll(robot) {
  const at = new Map();
  for (const points of Object.values(robot.sent))
    for (const [t, bytes] of points) at.set(t, (at.get(t) ?? 0) + bytes);
  return [...at].sort((a, b) => a[0] - b[0]);
}

// Share of a core between consecutive rows [%].
const busy = (rows) => rows.slice(1).map(
    (row, i) => [row[0], (100 * (row[1] - rows[i][1])) / Math.max(row[0] - rows[i][0], 1e-3)]);

function showWork() {
  const section =
      addSection('Bytes, cost, work', 'work', 'Times are since the robots were started.');
  const grid = element('div', 'grid', section);
  addLines(grid, {title: 'Sent by kind, all robots', unit: 'B'}, sentByKind());
  addLines(grid, {title: 'Sent by robot', unit: 'B'}, perRobot(sentInAll));
  addLines(
      grid,
      {title: 'Cost of the pose graph', unit: 'over rounds', logY: true, x: (n) => quantity(n)},
      perRobot((robot) => robot.rounds));
  addLines(grid, {title: 'Processor', unit: '%'}, perRobot((robot) => busy(robot.process)));
  addLines(
      grid, {title: 'Memory', unit: 'B'},
      perRobot((robot) => robot.process.map(([t, , bytes]) => [t, bytes])));
}

function showModules() {
  const robots = run.robots.filter((robot) => robot.timing.length);
  if (!robots.length) return;
  const section = addSection('Modules', 'modules');
  const grid = element('div', 'grid', section);
  const bars = (title, unit, column) =>
      barChart(element('div', '', grid), {title, unit, most: 14})
          .set(robots.map(
              (robot) => ({
                name: robot.name,
                color: robotColor(robot.id),
                values: Object.fromEntries(robot.timing.map((row) => [row[0], row[column]]))
              })));
  bars('Time in all', 's', 5);
  bars('A step, 95 of 100 below', 'ms', 3);
  const rows = robots.flatMap((robot) => robot.timing.map((row) => [robot, row]));
  const number = (column) => ([, row]) => quantity(row[column]);
  const details = element('details', '', section);
  element('summary', '', details, 'All numbers');
  addTable(
      details,
      [
        {
          title: 'robot',
          left: true,
          text: ([robot]) => robot.name,
          color: ([robot]) => robotColor(robot.id)
        },
        {title: 'module', left: true, text: ([, row]) => row[0].replaceAll('_', ' ')},
        {title: 'steps', text: ([, row]) => String(row[1])},
        {title: 'median [ms]', text: number(2)}, {title: '95 % [ms]', text: number(3)},
        {title: 'longest [ms]', text: number(4)}, {title: 'in all [s]', text: number(5)}
      ],
      rows);
}

showHead();
showFindings();
showRobots();
showTrajectories();
showErrors();
showClosures();
showWork();
showModules();
document.body.dataset.ready = 'true';
