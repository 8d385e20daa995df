// The viewer as a process of a test.
import {spawn} from 'node:child_process';
import {createInterface} from 'node:readline';

export class Viewer {
  /** Started with these arguments, on a port that is free; its address is `url`. */
  static async start(program, args) {
    const viewer = new Viewer();
    viewer.process =
        spawn(program, [...args, '--port', '0'], {stdio: ['ignore', 'pipe', 'inherit']});
    viewer.ended = new Promise((done) => viewer.process.on('exit', (code) => done(code)));
    for await (const line of createInterface({input: viewer.process.stdout})) {
      viewer.url = /http:\S+/.exec(line)?.[0];
      if (viewer.url) return viewer;
    }
    throw new Error(`${program} ended with ${await viewer.ended}`);
  }

  /** Ends it as Ctrl-C does; its exit code. */
  stop() {
    this.process.kill('SIGINT');
    return this.ended;
  }
}
