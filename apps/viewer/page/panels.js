// State of the robots: cards, matrix of links, and charts over time.
import {barChart, duration, kindColor, lineChart, quantity, robotColor} from './charts.js';

const SILENT_S = [3, 10];  // late, lost

const state = (silent) => (silent < SILENT_S[0] ? 'good' : silent < SILENT_S[1] ? 'warn' : 'bad');

function make(tag, parent, className = '', text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

// A list of terms and values; only the values change.
class Facts {
  constructor(list, terms) {
    this.values = new Map(terms.map((term) => {
      const fact = make('div', list);
      make('dt', fact, '', term);
      return [term, make('dd', fact, '', '–')];
    }));
  }

  set(term, text) {
    const value = this.values.get(term);
    if (value.textContent !== text) value.textContent = text;
  }
}

// Increase of a sum per second, between consecutive states.
function rates(states, valueOf) {
  const points = [];
  for (let i = 1; i < states.length; ++i) {
    const seconds = states[i].t - states[i - 1].t;
    const step = valueOf(states[i]) - valueOf(states[i - 1]);
    if (seconds > 0.05 && step >= 0) points.push([states[i].t, step / seconds]);
  }
  return points;
}

// Loads of the robot's modules: the present ones, or the means of a run that has ended.
function loads(robot) {
  if (!robot.state || robot.state.phase === 'running') return Object.entries(robot.state?.loads ?? {});
  const running = robot.states.slice(0, robot.statesShown).filter((s) => s.phase === 'running');
  const sums = new Map();
  for (const state of running)
    for (const [name, load] of Object.entries(state.loads))
      sums.set(name, (sums.get(name) ?? 0) + load / running.length);
  return [...sums];
}

export class Panels {
  /** `actions`: follow(robot), camera(robot). */
  constructor(elements, actions) {
    this.elements = elements;
    this.actions = actions;
    this.cards = new Map();
    this.totals =
        new Facts(elements.totals, ['Robots', 'Keyframes', 'Faces', 'Candidates', 'Kept', 'Sent']);
    this.totals.values.get('Candidates').parentNode.title =
        'Pairs of keyframes; one that two robots have found counts once';
    const chart = (kind, options) => kind(make('div', elements.charts), options);
    const overTime = {x: duration, height: 116};
    this.charts = {
      cost: chart(lineChart, {title: 'Cost of the pose graph', logY: true, ...overTime}),
      bytes: chart(lineChart, {title: 'Sent by kind, all robots', unit: 'B', ...overTime}),
      keyframes: chart(lineChart, {title: 'Keyframes', ...overTime}),
      cpu: chart(lineChart, {title: 'Processor', unit: '%', ...overTime}),
      memory: chart(lineChart, {title: 'Memory', unit: 'MB', ...overTime}),
      skipped: chart(lineChart, {title: 'Frames skipped', ...overTime}),
      loads: chart(barChart, {title: 'Load of modules (of an ended run: means)', unit: '%'}),
    };
  }

  // ---- left

  card(robot) {
    if (this.cards.has(robot.id)) return this.cards.get(robot.id);
    const root = document.createElement('div');
    root.className = 'robot';
    root.style.setProperty('--robot', robotColor(robot.id));
    const top = make('div', root, 'top');
    const card = {root, name: make('span', top, 'name'), phase: make('span', top, 'badge')};
    const buttons = make('span', top, 'buttons');
    card.follow = make('button', buttons, '', 'Follow');
    card.camera = make('button', buttons, '', 'Camera');
    card.follow.onclick = () => this.actions.follow(robot.id);
    card.camera.onclick = () => this.actions.camera(robot.id);
    card.facts = new Facts(
        make('dl', root),
        ['Frame', 'Last update', 'Keyframes', 'Recording', 'Skipped', 'Processor', 'Memory']);
    this.cards.set(robot.id, card);
    const ids = [...this.cards.keys()].sort((a, b) => a - b);
    const next = ids[ids.indexOf(robot.id) + 1];
    this.elements.robots.insertBefore(root, next === undefined ? null : this.cards.get(next).root);
    return card;
  }

  updateCard(robot, model) {
    const card = this.card(robot);
    const shown = robot.state;
    const silent = robot.lastReceived === null ? Infinity : model.time - robot.lastReceived;
    const over = shown && shown.phase !== 'running';
    card.name.textContent = model.name(robot.id);
    card.root.classList.toggle('gone', robot.lastReceived === null);
    const lost = silent > SILENT_S[1] && !over;
    card.phase.textContent = robot.lastReceived === null ? 'not there yet' :
        lost                                      ? 'silent' :
        shown?.phase === 'leaving'                ? 'left' :
                                                    shown?.phase ?? 'starting';
    card.phase.className = `badge ${
        lost                              ? 'bad' :
            shown?.phase === 'settled'    ? 'good' :
            silent > SILENT_S[0] && !over ? 'warn' :
                                            ''}`;
    const lastUpdate = over ? `at ${duration(robot.lastReceived)}` : `${silent.toFixed(1)} s ago`;
    card.facts.set(
        'Frame',
        !shown || shown.anchor === robot.id ?
            'its own' :
            `of ${model.name(shown.anchor)}${shown.tentative ? ', tentatively' : ''}`);
    card.facts.set('Last update', Number.isFinite(silent) ? lastUpdate : '–');
    card.facts.set('Keyframes', String(shown?.keyframes ?? robot.odometry.length));
    card.facts.set('Recording', shown ? duration(shown.dataset_time_s) : '–');
    card.facts.set('Skipped', String(shown?.skipped_frames ?? '–'));
    const cpu = robot.statesShown > 1 ?
        rates(
            robot.states.slice(Math.max(0, robot.statesShown - 3), robot.statesShown),
            (s) => s.cpu_s) :
        [];
    card.facts.set('Processor', cpu.length ? quantity(100 * cpu[cpu.length - 1][1], '%') : '–');
    card.facts.set('Memory', shown ? quantity(shown.resident_MB, 'MB') : '–');
  }

  updateCards(model) {
    for (const [id, card] of this.cards)
      if (!model.robots.has(id)) {
        card.root.remove();
        this.cards.delete(id);
      }
    for (const robot of model.robots.values()) this.updateCard(robot, model);
  }

  /** Marks the followed robot, and the one whose images are shown. */
  mark(followed, camera) {
    for (const [id, card] of this.cards) {
      card.follow.classList.toggle('on', id === followed);
      card.camera.classList.toggle('on', id === camera);
    }
  }

  updateMatrix(model) {
    const robots = [...model.robots.values()];
    const head = robots.map((r) => `<th>${r.id}</th>`).join('');
    const rows =
        robots
            .map((robot) => {
              const silent = new Map(robot.state?.links ?? []);
              const cells =
                  robots
                      .map((other) => {
                        if (other === robot) return '<td class="self"></td>';
                        if (!silent.has(other.id)) return '<td title="never received">–</td>';
                        const s = silent.get(other.id);
                        return `<td class="${state(s)}" title="${robot.id} received ${other.id} ${
                            s.toFixed(1)} s ago">${s < 100 ? s.toFixed(1) : s.toFixed(0)}</td>`;
                      })
                      .join('');
              return `<tr><th><span style="color:${robotColor(robot.id)}">●</span> ${
                  robot.id}</th>${cells}</tr>`;
            })
            .join('');
    const html = `<table><thead><tr><th></th>${head}</tr></thead><tbody>${rows}</tbody>
      <caption>Seconds since the robot of the row received the robot of the column</caption></table>`;
    if (html !== this.matrix) this.elements.matrix.innerHTML = this.matrix = html;
  }

  updateTotals(model, counts) {
    const robots = [...model.robots.values()];
    const sum = (valueOf) => robots.reduce((all, robot) => all + valueOf(robot), 0);
    this.totals.set('Robots', String(robots.filter((r) => r.lastReceived !== null).length));
    this.totals.set(
        'Keyframes', quantity(sum((r) => Math.max(r.odometry.length, r.optimized.length))));
    this.totals.set('Faces', quantity(model.faces()));
    this.totals.set('Kept', quantity(counts.kept));
    this.totals.set(
        'Candidates', quantity(counts.kept + counts.verified + counts.candidate + counts.rejected));
    this.totals.set(
        'Sent',
        quantity(
            sum((r) => Object.values(r.state?.sent_bytes ?? {}).reduce((a, b) => a + b, 0)), 'B'));
  }

  // ---- right

  updateCharts(model) {
    const robots = [...model.robots.values()].filter((r) => r.statesShown > 0);
    const perRobot = (pointsOf) =>
        robots.map((robot) => ({
                     name: model.name(robot.id),
                     color: robotColor(robot.id),
                     points: pointsOf(robot.states.slice(0, robot.statesShown))
                   }));
    const value = (valueOf) => (states) => states.map((s) => [s.t, valueOf(s)]);
    const set = (name, series, range = [0, Math.max(model.end, 1)]) => {
      this.charts[name].options.range = range;
      this.charts[name].options.cursor = model.time < model.end ? model.time : undefined;
      this.charts[name].set(series);
    };
    set('cost', perRobot(value((s) => s.cost)));
    set('keyframes', perRobot(value((s) => s.keyframes)));
    set('cpu', perRobot((states) => rates(states, (s) => 100 * s.cpu_s)));
    set('memory', perRobot(value((s) => s.resident_MB)));
    set('skipped', perRobot(value((s) => s.skipped_frames)));
    set('bytes', this.bytesByKind(robots));
    this.charts.loads.set(robots.map(
        (robot) => ({
          name: model.name(robot.id),
          color: robotColor(robot.id),
          values: Object.fromEntries(loads(robot).map(([name, load]) => [name, 100 * load]))
        })));
  }

  // Sums over robots at each time of a state, from the newest state of every robot.
  bytesByKind(robots) {
    const events = robots.flatMap(
        (robot) => robot.states.slice(0, robot.statesShown).map((s) => [s, robot.id]));
    events.sort((a, b) => a[0].t - b[0].t);
    const now = new Map(), series = new Map();
    for (const [s, id] of events) {
      now.set(id, s.sent_bytes);
      for (const kind of Object.keys(s.sent_bytes)) {
        if (!series.has(kind)) series.set(kind, []);
        let sum = 0;
        for (const bytes of now.values()) sum += bytes[kind] ?? 0;
        series.get(kind).push([s.t, sum]);
      }
    }
    return [...series.keys()].sort().map(
        (kind, i) =>
            ({name: kind.replaceAll('_', ' '), color: kindColor(i), points: series.get(kind)}));
  }
}
