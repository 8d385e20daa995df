// Resource use of the page: opens it on a synthetic run of three robots with the given number of
// faces.
//   node bench_page.mjs VIEWER [FACES [OPTION of the viewer]...]      default 2000000
import {mkdirSync, mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import {Browser} from './browser.mjs';
import {percentile} from './run_files.mjs';
import {Viewer} from './viewer.mjs';

const [program, faces = '2000000', ...rest] = process.argv.slice(2);

// Hills of squares of 0.1 m, two faces each, as mesh_optimized.ply.
function writeHills(file, faces) {
  const n = Math.ceil(Math.sqrt(faces / 2)) + 1;
  const head = Buffer.from(
      `ply\nformat binary_little_endian 1.0\nelement vertex ${
          n * n}\nproperty float x\nproperty float y\n` +
      `property float z\nproperty uchar label\nelement face ${
          2 * (n - 1) ** 2}\nproperty list uchar uint vertex_indices\nend_header\n`);
  const body = Buffer.alloc(13 * n * n + 26 * (n - 1) ** 2);
  let at = 0;
  for (let i = 0; i < n; ++i)
    for (let k = 0; k < n; ++k) {
      body.writeFloatLE(0.1 * i, at);
      body.writeFloatLE(0.1 * k, at + 4);
      body.writeFloatLE(Math.sin(0.05 * i) * Math.cos(0.04 * k), at + 8);
      body[at + 12] = 1 + (Math.floor(i / 40) + Math.floor(k / 40)) % 12;
      at += 13;
    }
  for (let i = 0; i + 1 < n; ++i)
    for (let k = 0; k + 1 < n; ++k) {
      const a = i * n + k;
      for (const face of [[a, a + n, a + 1], [a + 1, a + n, a + n + 1]]) {
        body[at] = 3;
        face.forEach((v, j) => body.writeUInt32LE(v, at + 1 + 4 * j));
        at += 13;
      }
    }
  writeFileSync(file, Buffer.concat([head, body]));
}

// An entry of run.journal, see modules/journal.
function journalEntry(time_ns, bytes) {
  const mask = (1n << 64n) - 1n;
  let sum = 0xcbf29ce484222325n;
  const mix = (value) => {
    for (let byte = 0n; byte < 64n; byte += 8n)
      sum = ((sum ^ ((value >> byte) & 0xffn)) * 0x100000001b3n) & mask;
  };
  mix(BigInt(bytes.length));
  mix(time_ns);
  const words = Buffer.concat([bytes, Buffer.alloc(7)]);
  for (let at = 0; at < bytes.length; at += 8) mix(words.readBigUInt64LE(at));
  const head = Buffer.alloc(12), tail = Buffer.alloc(8);
  head.writeUInt32LE(bytes.length);
  head.writeBigUInt64LE(time_ns, 4);
  tail.writeBigUInt64LE(sum);
  return Buffer.concat([Buffer.from('\x7fKMJRNL5', 'latin1'), head, bytes, tail]);
}

function doubles(values) {
  const bytes = Buffer.alloc(8 * values.length);
  values.forEach((value, i) => bytes.writeDoubleLE(value, 8 * i));
  return bytes;
}

function stateAt(time_s) {
  const stamp = Buffer.alloc(8);
  stamp.writeBigUInt64LE(BigInt(Math.round(1e9 * (1000 + time_s))));
  const position = [30 + 25 * Math.sin(0.02 * time_s), 0.1 * time_s, 2];
  const pose = [1, 0, 0, 0, 1, 0, 0, 0, 1, ...position];
  return Buffer.concat([Buffer.from([1]), stamp, doubles([...pose, ...Array(9).fill(0)])]);
}

function sampleOf(name) {
  return Buffer.concat([
    Buffer.from([9, name.length]), Buffer.from(name), Buffer.from([0]), doubles([600]),
    Buffer.from([0, 0, 0, 0, 0]), doubles([0, 0, 0, 0]), Buffer.from([0, 0, 0])
  ]);
}

function writeRun(folder, faces) {
  const start_ns = 1_700_000_000_000_000_000n;
  for (let robot = 0; robot < 3; ++robot) {
    const own = join(folder, `robot${robot}`);
    mkdirSync(own, {recursive: true});
    const summary =
        {robot, name: `robot${robot}`, seconds: 600, pgo: {anchor: robot, members: [robot]}};
    writeFileSync(join(own, 'summary.json'), JSON.stringify(summary));
    const journal = [
      journalEntry(start_ns, Buffer.from([0, robot, 1, 0])),
      journalEntry(start_ns, sampleOf(`robot${robot}`))
    ];
    for (let i = 0; i < 1200; ++i)
      journal.push(journalEntry(start_ns + 500_000_000n * BigInt(i), stateAt(0.5 * i)));
    writeFileSync(join(own, 'run.journal'), Buffer.concat(journal));
    writeHills(join(own, 'mesh_optimized.ply'), faces / 3);
  }
}

const folder = mkdtempSync(join(tmpdir(), 'km_bench_'));
writeRun(folder, Number(faces));
const viewer = await Viewer.start(program, [folder, ...rest]);
const browser = new Browser();
try {
  const begin = Date.now();
  const page = await browser.open(viewer.url);
  await page.until('kimera.ready', 300);
  console.log(`faces ${await page.evaluate('kimera.drawnFaces')}, all shown after ${
      ((Date.now() - begin) / 1000).toFixed(1)} s`);
  const heap = await page.send('Runtime.getHeapUsage');
  console.log(`memory: heap ${(heap.usedSize / 1e6).toFixed(0)} MB, arrays ${
      ((heap.backingStorageSize ?? 0) / 1e6).toFixed(0)} MB`);
  // Time from one frame to the next while the camera turns; reading a pixel waits for the drawing.
  const times = await page.evaluate(`new Promise((done) => {
    const times = [], pixel = new Uint8Array(4), {scene} = kimera, gl = scene.renderer.getContext();
    let last = 0;
    scene.onDrawn = () => {
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      if (last) times.push(performance.now() - last);
      last = performance.now();
      scene.camera.position.applyAxisAngle(scene.camera.up, 0.01);
      scene.camera.lookAt(scene.controls.target);
      scene.dirty = true;
      if (times.length === 40) done(times);
    };
    scene.dirty = true;
  })`);
  console.log(`frame: median ${percentile(times, 0.5).toFixed(0)} ms, p95 ${
      percentile(times, 0.95).toFixed(0)} ms (no graphics processor)`);
  // Time of the page itself in a frame: the calls without the drawing.
  const own = await page.evaluate(`(() => {
    const times = [], {scene} = kimera, {renderer} = scene, gl = renderer.getContext();
    scene.onDrawn = undefined;
    gl.drawElements = gl.drawArrays = () => {};
    for (let i = 0; i < 60; ++i) {
      const begin = performance.now();
      renderer.render(scene.scene, scene.camera);
      times.push(performance.now() - begin);
    }
    return times.slice(20);
  })()`);
  console.log(
      `of it, without the drawing: median ${percentile(own, 0.5).toFixed(1)} ms, p95 ${
          percentile(own, 0.95).toFixed(1)} ms, ` +
      `${await page.evaluate('kimera.scene.renderer.info.render.calls')} draw calls`);
} finally {
  await viewer.stop();
  await browser.close();
  rmSync(folder, {recursive: true});
}
