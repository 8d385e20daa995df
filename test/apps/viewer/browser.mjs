// A headless Chromium, driven by its DevTools protocol over a pipe: no package is needed.
import {spawn} from 'node:child_process';
import {existsSync, mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

/** The program, or null. */
export function findChromium() {
  const places = [
    process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'
  ];
  return places.find((file) => file && existsSync(file)) ?? null;
}

export const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));

export class Browser {
  constructor() {
    this.folder = mkdtempSync(join(tmpdir(), 'km_browser_'));
    this.process = spawn(
        findChromium(),
        [
          '--headless=new', '--no-sandbox', '--disable-quic', '--no-first-run',
          '--disable-background-networking', '--disable-component-update', '--disable-sync',
          '--hide-scrollbars', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
          '--ignore-gpu-blocklist', '--enable-precise-memory-info', '--remote-debugging-pipe',
          `--user-data-dir=${this.folder}`, 'about:blank'
        ],
        {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'], detached: true});
    this.waiting = new Map();
    this.listeners = [];
    this.next = 0;
    let rest = Buffer.alloc(0);
    this.process.stdio[4].on('data', (data) => {
      rest = Buffer.concat([rest, data]);
      for (let end; (end = rest.indexOf(0)) >= 0; rest = rest.subarray(end + 1))
        this.receive(JSON.parse(rest.subarray(0, end)));
    });
  }

  receive({id, result, error, method, params, sessionId}) {
    if (id === undefined)
      return this.listeners.forEach((listener) => listener(method, params, sessionId));
    const [done, failed, asked] = this.waiting.get(id);
    this.waiting.delete(id);
    if (error)
      failed(new Error(`${asked}: ${error.message}`));
    else
      done(result);
  }

  send(method, params = {}, sessionId = undefined) {
    const id = ++this.next;
    this.process.stdio[3].write(`${JSON.stringify({id, method, params, sessionId})}\0`);
    return new Promise((done, failed) => this.waiting.set(id, [done, failed, method]));
  }

  /** A new page of that size; `errors` has its error messages. */
  async open(url, width = 1440, height = 900) {
    const {targetId} = await this.send('Target.createTarget', {url: 'about:blank'});
    const {sessionId} = await this.send('Target.attachToTarget', {targetId, flatten: true});
    const page = new Page(this, targetId, sessionId);
    await page.send('Runtime.enable');
    await page.send('Log.enable');
    await page.send('Page.enable');
    await page.send(
        'Emulation.setDeviceMetricsOverride', {width, height, deviceScaleFactor: 1, mobile: false});
    await page.send('Page.navigate', {url});
    await page.until(`document.readyState === 'complete' && location.href !== 'about:blank'`);
    return page;
  }

  /** Ends it and all its processes. */
  async close() {
    const ended = new Promise((done) => this.process.on('exit', done));
    this.send('Browser.close').catch(() => {});
    await Promise.race([ended, pause(5)]);
    try {
      process.kill(-this.process.pid, 'SIGKILL');
    } catch {
      // they have ended
    }
    rmSync(this.folder, {recursive: true, force: true, maxRetries: 20});
  }
}

class Page {
  constructor(browser, targetId, sessionId) {
    Object.assign(this, {browser, targetId, sessionId, errors: []});
    browser.listeners.push((method, params, session) => {
      if (session !== sessionId) return;
      if (method === 'Runtime.exceptionThrown')
        this.errors.push(
            params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === 'Runtime.consoleAPICalled' && params.type === 'error')
        this.errors.push(params.args.map((a) => a.value ?? a.description).join(' '));
      if (method === 'Log.entryAdded' && params.entry.level === 'error')
        this.errors.push(`${params.entry.text} ${params.entry.url ?? ''}`);
    });
  }

  send(method, params) { return this.browser.send(method, params, this.sessionId); }

  /** The value of an expression in the page. */
  async evaluate(expression) {
    const {result, exceptionDetails} =
        await this.send('Runtime.evaluate', {expression, returnByValue: true, awaitPromise: true});
    if (exceptionDetails)
      throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  /** Waits until an expression is true. On a busy machine a page is drawn late. */
  async until(expression, seconds = 180) {
    const end = Date.now() + 1000 * seconds;
    while (Date.now() < end) {
      const value =
          this.evaluate(`(() => { try { return !!(${expression}); } catch { return false; } })()`);
      if (await value.catch(() => false)) return;  // between two pages there is no page to query
      // Chromium aborts requests when another test makes a network interface.
      if (this.errors.some((error) => error.includes('ERR_NETWORK_CHANGED'))) {
        this.errors = [];
        await this.send('Page.reload');
      }
      await pause(0.1);
    }
    throw new Error(`after ${seconds} s it is not so: ${expression}; the page says: ${
        this.errors.join('; ') || 'nothing'}`);
  }

  async click(x, y) {
    for (const type of ['mousePressed', 'mouseReleased'])
      await this.send(
          'Input.dispatchMouseEvent', {type, x, y, button: 'left', buttons: 1, clickCount: 1});
  }

  /** Into the middle of an element, or so far along its width. */
  async clickAt(selector, share = 0.5) {
    const {x, y, width, height} = await this.evaluate(
        `document.querySelector('${selector}').getBoundingClientRect().toJSON()`);
    await this.click(x + share * width, y + height / 2);
  }

  async hover(x, y) { await this.send('Input.dispatchMouseEvent', {type: 'mouseMoved', x, y}); }

  async screenshot(file, format = 'png', quality = undefined) {
    const {data} = await this.send('Page.captureScreenshot', {format, quality});
    writeFileSync(file, Buffer.from(data, 'base64'));
  }

  async close() { await this.browser.send('Target.closeTarget', {targetId: this.targetId}); }
}
