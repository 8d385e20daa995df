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

function writeRun(folder, faces) {
  for (let robot = 0; robot < 3; ++robot) {
    const own = join(folder, `robot${robot}`);
    mkdirSync(own, {recursive: true});
    const summary =
        {robot, name: `robot${robot}`, seconds: 600, pgo: {anchor: robot, members: [robot]}};
    writeFileSync(join(own, 'summary.json'), JSON.stringify(summary));
    let odometry = '';
    for (let i = 0; i < 12000; ++i)
      odometry += `${(1000 + 0.05 * i).toFixed(2)} ${(30 + 25 * Math.sin(0.001 * i)).toFixed(3)} ${
          (0.005 * i).toFixed(3)} 2 0 0 0 1\n`;
    writeFileSync(join(own, 'odometry.tum'), odometry);
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
