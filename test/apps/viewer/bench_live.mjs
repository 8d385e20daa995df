// How long it takes from a robot's verifying a closure, by its log, to the page's drawing it.
//   node bench_live.mjs PROGRAMS TEAM.yaml [labels|off [option of kimera_multi_team]...]
import {spawn} from 'node:child_process';
import {existsSync, mkdtempSync, readdirSync, readFileSync, rmSync} from 'node:fs';
import {loadavg, tmpdir} from 'node:os';
import {join} from 'node:path';

import {Browser, pause} from './browser.mjs';
import {pairOf, percentile} from './run_files.mjs';
import {Viewer} from './viewer.mjs';

const [programs, team, map = 'labels', ...rest] = process.argv.slice(2);
const domain = String(150 + Math.floor(50 * Math.random()));
const folder = mkdtempSync(join(tmpdir(), 'km_bench_'));

// When each pair of keyframes was verified first [ms since 1970], by the logs of today.
function verified() {
  const times = new Map();
  for (const name of readdirSync(folder)) {
    const pattern = /^(\d+):(\d+):(\d+)\.(\d+) debug loop_closure: verified (\d+:\d+) (\d+:\d+)$/gm;
    const file = join(folder, name, 'robot.log');
    const log = existsSync(file) ? readFileSync(file, 'latin1') : '';
    for (const [, h, m, s, ms, from, to] of log.matchAll(pattern)) {
      const at = new Date().setHours(h, m, s, ms);
      const id = pairOf(from, to);
      times.set(id, Math.min(at, times.get(id) ?? Infinity));
    }
  }
  return times;
}

const viewer = await Viewer.start(join(programs, 'kimera_multi_viewer'), ['--domain', domain]);
const browser = new Browser();
try {
  const page = await browser.open(viewer.url);
  await page.evaluate(`(() => {
    const first = window.firstDrawn = {}, drawn = kimera.scene.onDrawn;
    kimera.scene.meshes.setMode('${map}');
    kimera.scene.onDrawn = (now) => {
      drawn(now);
      for (const [id, {verdict}] of kimera.model.closures())
        if (verdict === 'verified' || verdict === 'kept') first[id] ??= Date.now();
    };
  })()`);
  const run = spawn(
      join(programs, 'kimera_multi_team'),
      [
        '--config', team, '--domain', domain, '--view', '--output', folder, ...rest, '--', '--log', 'debug'
      ],
      {stdio: ['ignore', 'ignore', 'inherit']});
  const code = await new Promise((done) => run.on('exit', done));
  await pause(3);
  const drawn = await page.evaluate('firstDrawn');
  const times = verified();
  const late = [...times].filter(([id]) => id in drawn).map(([id, at]) => drawn[id] - at);
  console.log(`the team ended with ${code}; ${times.size} closures verified, ${late.length} drawn: ` +
              `median ${percentile(late, 0.5)} ms, p95 ${percentile(late, 0.95)} ms, most ${
                  Math.max(...late)} ms; ${await page.evaluate('kimera.drawnFaces')} faces, load ${
                  loadavg()[0].toFixed(1)}`);
} finally {
  await viewer.stop();
  await browser.close();
  rmSync(folder, {recursive: true});
}
