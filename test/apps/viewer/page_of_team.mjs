// Opens the page on a running team, which apps/demo --view starts. Checks the page before and after
// robots join, and in the past while the run continues. Then closes and opens it again, and
// requests a camera image. The end is compared with the results of the robots.
//   node page_of_team.mjs PROGRAMS RESULTS [FOLDER for screenshots [argument of the demo]...]
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {mkdirSync, readFileSync} from 'node:fs';
import {join} from 'node:path';
import {createInterface} from 'node:readline';

import {Browser} from './browser.mjs';
import {facesOfMeshes, readStages} from './run_files.mjs';

const [programs, results, shots, ...rest] = process.argv.slice(2);
if (shots) mkdirSync(shots, {recursive: true});

// Passes the output of the demo to the output of this program.
class Demo {
  constructor() {
    const args = [...rest, '--view', '--programs', programs, '--output', results];
    this.process = spawn('apps/demo', args, {stdio: ['ignore', 'pipe', 'inherit'], detached: true});
    this.ended = new Promise((done) => this.process.on('exit', done));
    this.lines = createInterface({input: this.process.stdout});
    this.lines.on('line', (line) => console.log(line));
    this.url = this.output_line(/http:\S+/);
    this.finished = this.output_line(/The viewer continues to show it/);
  }

  output_line(pattern) {
    const found = new Promise((done) => this.lines.on('line', (line) => {
      const match = pattern.exec(line);
      if (match) done(match[0]);
    }));
    const ended = this.ended.then((code) => {
      throw new Error(`the demo ended with ${code}, and had not printed ${pattern}`);
    });
    const first = Promise.race([found, ended]);
    first.catch(() => {});  // every caller that waits for it still gets the error
    return first;
  }

  /** Ends the demo and its processes, as Ctrl-C does. */
  stop() {
    process.kill(-this.process.pid, 'SIGINT');
    return this.ended;
  }
}

const demo = new Demo();
const browser = new Browser();
const errors = [];
async function open() {
  const page = await browser.open(await demo.url);
  errors.push(page.errors);
  return page;
}
const all = (what) => `kimera.robots.length > 1 && kimera.robots.every((r) => ${what})`;

try {
  let page = await open();
  // On a busy machine the run may finish while the page shows its past.
  const untilOrFinished = (condition) => Promise.race([page.until(condition), demo.finished]);
  const shoot = (name) => shots && page.screenshot(join(shots, `${name}.png`));

  // Each robot has a frame of its own; the camera image of one of them.
  await page.until(`${all('r.keyframes > 1')} && kimera.frames.every((f) => f.length === 1)`, 120);
  const apart = await page.evaluate(
      '({time: kimera.time, frames: kimera.frames, start: kimera.model.start_ms})');
  await page.clickAt('.robot .buttons button:last-child');
  await page.until(`kimera.model.robots.get(${apart.frames[0][0]}).image?.features > 0`);
  await page.until('kimera.ready');
  await shoot('apart');
  await page.clickAt('#camera button');

  // Goes back while the run continues, and to the present again.
  await page.until(`kimera.end > ${apart.time + 2}`);
  await page.clickAt('#slider', apart.time / (await page.evaluate('kimera.end')));
  const shown = async () => {
    await page.until('kimera.ready');
    return page.evaluate('({time: kimera.time, frames: kimera.frames, faces: kimera.drawnFaces})');
  };
  const past = await shown();
  assert.deepEqual(past.frames, apart.frames);
  const end = await page.evaluate('kimera.end');
  assert.ok(past.time < end - 1);
  await untilOrFinished(`kimera.end > ${end + 1}`);
  assert.deepEqual(await shown(), past);
  await shoot('past');
  await page.clickAt('#live');
  await untilOrFinished(`kimera.time > ${end + 1}`);
  await page.until('kimera.time === kimera.end');

  // Closed and opened again: the page has the past.
  await page.close();
  page = await open();
  await page.until('kimera.ready');
  assert.equal(await page.evaluate('kimera.model.start_ms'), apart.start);
  await page.evaluate(`kimera.seek(${past.time})`);
  assert.deepEqual(await shown(), past);
  await page.clickAt('#live');
  await page.until(`${all('r.keyframes > 1')} && kimera.frames.length === 1 && kimera.ready`, 120);
  await shoot('joined');

  // The final state is that of the robots' results.
  await demo.finished;
  await page.until(all(`r.phase === 'leaving'`));
  const team = JSON.parse(readFileSync(join(results, 'team.json')));
  await page.until('kimera.ready');
  await shoot('finished');
  assert.deepEqual(
      await page.evaluate('kimera.robots.map((r) => [r.id, r.name, r.keyframes])'),
      team.robots.map((r) => [r.robot, r.name, r.keyframes]));
  // Both robots judge a closure: the page has the newest verdict, the files that of the robot that
  // found it.
  const kept = new Set(
      [...readStages(results, team.robots)].filter(([, stage]) => stage === 'inlier').map(([pair]) => pair));
  const known = await page.evaluate(`[...kimera.model.closures()].filter(
      ([, closure]) => closure.verdict === 'kept').map(([pair]) => pair)`);
  const agreed = known.filter((pair) => kept.has(pair)).length;
  console.log(`kept: ${known.length} in the page, ${kept.size} in the files, ${agreed} in both`);
  assert.ok(agreed > 0 && agreed >= 0.9 * Math.max(known.length, kept.size));
  // The last correction of a large mesh is not sent completely.
  const faces = facesOfMeshes(results, team.robots), pageFaces = await page.evaluate('kimera.faces');
  console.log(`faces: ${pageFaces} in the page, ${faces} in the files`);
  assert.ok(Math.abs(pageFaces - faces) <= 0.01 * faces);
  assert.deepEqual(errors.flat(), []);
} finally {
  await demo.stop();
  await browser.close();
}
