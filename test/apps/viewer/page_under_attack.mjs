// Opens the page of a finished run and turns its view, at rest and while another host attacks the
// viewer. The attacks: requests of 20 MB, image requests without end, 70 open pages, 100 slow clients.
//   node page_under_attack.mjs VIEWER RESULTS
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {connect} from 'node:net';

import {Browser, pause} from './browser.mjs';
import {Viewer} from './viewer.mjs';

const [program, results] = process.argv.slice(2);
const viewer = await Viewer.start(program, [results]);
const browser = new Browser();
const sockets = [];

// A connection of the attacker, which sends `text` at once and may stop reading.
function attack(text, reads = true) {
  const {port} = new URL(viewer.url);
  const socket = connect({port, host: '127.0.0.1', localAddress: '127.0.0.2'});
  socket.write(text);
  socket.on('error', () => {});
  if (reads) socket.resume();
  sockets.push(socket);
  return socket;
}
const post = (path, length = 0) =>
    `POST /${path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: ${length}\r\n\r\n`;
const attacks = {
  '40 requests of 20 MB': () => {
    for (let k = 0; k < 40; ++k) attack(post('images?page=a', 20e6)).write('['.repeat(20e6));
  },
  'image requests without end': () => {
    attack(post('updates?page=a'));
    let robot = 0;
    const ask = () => {
      if (robot < 65536)
        attack(post(`images?page=a&on=true&robot=${robot++}`)).on('end', ask);
    };
    for (let k = 0; k < 8; ++k) ask();
  },
  '70 open pages, which do not read': () => {
    for (let k = 0; k < 70; ++k) attack(post(`updates?page=b${k}`), false);
  },
  '100 slow clients': () => {
    for (let k = 0; k < 100; ++k) {
      const socket = attack('GET / HTTP/1.1\r\n', false);
      const timer = setInterval(() => socket.write('x'), 500);
      socket.on('close', () => clearInterval(timer));
    }
  }
};

const status = (key) => Number(RegExp(`${key}:\\s+(\\d+)`).exec(
    readFileSync(`/proc/${viewer.process.pid}/status`, 'utf8'))[1]) / 1e3;

// Seconds until the page is complete, and until its view has turned.
async function use() {
  const start = Date.now();
  const page = await browser.open(viewer.url);
  await page.until('kimera.ready');
  const opened = Date.now();
  const before = await page.evaluate('kimera.scene.camera.position.toArray()');
  const drag = (type, x) => page.send(
      'Input.dispatchMouseEvent', {type, x, y: 450, button: 'left', buttons: 1, clickCount: 1});
  await drag('mousePressed', 700);
  for (let x = 720; x <= 800; x += 20) await drag('mouseMoved', x);
  await drag('mouseReleased', 800);
  await page.until(`${JSON.stringify(before)}.some(
      (x, k) => Math.abs(x - kimera.scene.camera.position.toArray()[k]) > 0.01)`);
  const times = [opened - start, Date.now() - opened].map((ms) => ms / 1000);
  assert.deepEqual(page.errors, []);
  await page.close();
  return times;
}

try {
  const print = (what, [open, turn]) =>
      console.log(`${what}: opens in ${open.toFixed(1)} s, turns in ${turn.toFixed(1)} s, viewer ${
          status('VmRSS').toFixed(0)} MB, at most ${status('VmHWM').toFixed(0)} MB, ${status('Threads') * 1e3} threads`);
  print('at rest', await use());
  const atRest_MB = status('VmRSS');
  for (const [name, begin] of [...Object.entries(attacks), ['all of them', () => Object.values(attacks).forEach((a) => a())]]) {
    begin();
    await pause(1);
    print(name, await use());
    for (const socket of sockets.splice(0)) socket.destroy();
  }
  await pause(12);  // the viewer closes idle connections after 10 s
  print('afterwards', await use());
  assert.ok(status('VmRSS') < atRest_MB + 50, 'the viewer keeps the memory of requests');
} finally {
  for (const socket of sockets) socket.destroy();
  await viewer.stop();
  await browser.close();
}
