// The time slider: present time, range of times, and times at which closures and joins occurred.
import {duration, robotColor} from './charts.js';
import {VERDICTS} from './scene.js';

export class Timeline {
  /** Calls `onSeek(time)` when the user moves the slider. */
  constructor({slider, play, live, clock, speed}, onSeek) {
    Object.assign(this, {slider, play, live, clock, speed, onSeek});
    this.canvas = document.createElement('canvas');
    slider.append(this.canvas);
    slider.tabIndex = 0;
    slider.setAttribute('role', 'slider');
    slider.setAttribute('aria-label', 'Time');
    this.follows = true;  // true: the slider follows new messages
    this.playing = false;
    this.time = this.end = 0;
    play.onclick = () => this.togglePlay();
    live.onclick = () => this.goLive();
    slider.onpointerdown = (event) => {
      slider.setPointerCapture(event.pointerId);
      this.seekTo(event);
      slider.onpointermove = (move) => this.seekTo(move);
    };
    slider.onpointerup = slider.onpointercancel = () => {
      slider.onpointermove = null;
    };
    slider.onkeydown = (event) => {
      const step = {ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10}[event.key];
      if (step) this.go(this.time + step);
    };
    new ResizeObserver(() => this.draw()).observe(slider);
  }

  seekTo(event) {
    const box = this.slider.getBoundingClientRect();
    this.go(((event.clientX - box.left) / box.width) * this.end);
  }

  go(time) {
    this.time = Math.max(0, Math.min(this.end, time));
    this.follows = false;
    this.onSeek(this.time);
  }

  goLive() {
    this.follows = true;
    this.playing = false;
    this.time = this.end;
    this.onSeek(this.time);
  }

  togglePlay() {
    this.playing = !this.playing;
    if (this.playing && (this.follows || this.time >= this.end)) this.time = 0;
    if (this.playing) this.follows = false;
    this.onSeek(this.time);
  }

  /** Advances by `seconds` of the clock; true if the time has changed. */
  step(seconds) {
    if (this.follows) {
      const moved = this.time !== this.end;
      this.time = this.end;
      return moved;
    }
    if (!this.playing) return false;
    this.time = Math.min(this.end, this.time + seconds * Number(this.speed.value));
    if (this.time >= this.end) this.playing = false;
    return true;
  }

  /** Counts closures per second of the whole time, and finds the times at which frames changed. */
  survey(model) {
    this.counts = new Map();  // [verified, kept] by second
    this.joins = [];
    for (const robot of model.robots.values()) {
      let anchor = robot.id;
      for (const message of robot.log) {
        if (message.kind === 'closures')
          for (const one of message.closures) {
            const rank = {kept: 2, verified: 1}[one[4]];
            const second = Math.floor(message.t);
            if (!rank) continue;
            if (!this.counts.has(second)) this.counts.set(second, [0, 0]);
            this.counts.get(second)[rank - 1] += 1;
          }
        if (message.kind === 'keyframes' && message.optimized && message.anchor !== anchor) {
          anchor = message.anchor;
          this.joins.push({t: message.t, robot: robot.id});
        }
      }
    }
    this.joins.sort((a, b) => a.t - b.t);
  }

  draw() {
    const width = this.slider.clientWidth, height = this.slider.clientHeight;
    const ratio = devicePixelRatio;
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const c = this.canvas.getContext('2d');
    c.scale(ratio, ratio);
    const toX = (t) => (this.end > 0 ? (t / this.end) * width : 0);
    const middle = height - 13;
    const counts = this.counts ?? new Map();
    const most = Math.max(1, ...[...counts.values()].map(([verified, kept]) => verified + kept));
    counts.forEach((n, second) => {
      const w = Math.max(1.5, toX(second + 1) - toX(second) - 1);
      let y = middle - 4;
      [['kept', n[1]], ['verified', n[0]]].forEach(([verdict, count]) => {
        const h = (count / most) * (height - 24);
        c.fillStyle = `${VERDICTS[verdict].color}99`;
        c.fillRect(toX(second), y - h, w, h);
        y -= h;
      });
    });
    c.fillStyle = '#2f3540';
    c.beginPath();
    c.roundRect(0, middle - 2, width, 4, 2);
    c.fill();
    c.fillStyle = '#7fb2ff';
    c.beginPath();
    c.roundRect(0, middle - 2, toX(this.time), 4, 2);
    c.fill();
    let free = 0;  // robots that join at the same time are drawn side by side
    for (const {t, robot} of this.joins ?? []) {
      const x = Math.max(free, toX(t));
      free = x + 9;
      c.fillStyle = robotColor(robot);
      c.beginPath();
      c.arc(x, middle, 4, 0, 7);
      c.fill();
    }
    c.fillStyle = '#fff';
    c.beginPath();
    c.arc(Math.max(6, Math.min(width - 6, toX(this.time))), middle, 6, 0, 7);
    c.fill();
    this.play.classList.toggle('on', this.playing);
    this.live.classList.toggle('on', this.follows);
    this.clock.innerHTML = `<b>${duration(this.time)}</b> / ${duration(this.end)}`;
    this.slider.setAttribute('aria-valuenow', this.time.toFixed(1));
    this.slider.setAttribute('aria-valuemax', this.end.toFixed(1));
  }
}
