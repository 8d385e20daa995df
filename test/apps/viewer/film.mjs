// Films a finished run: the page at evenly spaced moments, as one animated picture.
//   node film.mjs VIEWER RESULTS FILM.webp [PICTURES]      default 24 pictures; needs img2webp
import {execFileSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import {Browser} from './browser.mjs';
import {Viewer} from './viewer.mjs';

const [program, results, film, pictures = '24'] = process.argv.slice(2);
const kWidth = 1200, kHeight = 720, kPictureMs = 250, kLastPictureMs = 3000, kQuality = 60;
const kWait_s = 600;  // pages draw by software here

const folder = mkdtempSync(join(tmpdir(), 'km_film_'));
const viewer = await Viewer.start(program, [results]);
const browser = new Browser();
try {
  const page = await browser.open(viewer.url, kWidth, kHeight);
  await page.until('kimera.ready', kWait_s);
  const end = await page.evaluate('kimera.end');
  const frames = [];
  for (let i = 1; i <= Number(pictures); ++i) {
    await page.evaluate(`kimera.seek(${i * end / Number(pictures)})`);
    await page.until('kimera.ready', kWait_s);
    await page.evaluate('new Promise((drawn) => requestAnimationFrame(drawn))');
    const file = join(folder, `${i}.png`);
    await page.screenshot(file);
    frames.push('-d', i < Number(pictures) ? kPictureMs : kLastPictureMs, file);
    process.stderr.write(`\r${i} of ${pictures} pictures`);
  }
  process.stderr.write('\n');
  execFileSync('img2webp', ['-loop', '0', '-lossy', '-q', kQuality, '-m', '6', ...frames, '-o', film]);
} finally {
  await viewer.stop();
  await browser.close();
  rmSync(folder, {recursive: true, force: true});
}
