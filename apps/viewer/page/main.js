// Connects the parts: messages go to the model; the model at the time of the slider goes to the
// scene and the panels.
import {Connection} from './connection.js';
import {Model} from './model.js';
import {Panels} from './panels.js';
import {Scene, VERDICTS} from './scene.js';
import {Timeline} from './timeline.js';

const SHOW_MS = 100;  // between updates of the scene
const CHARTS_MS = 1000;

const $ = (id) => document.getElementById(id);
const model = new Model();
const scene = new Scene($('canvas'), $('overlay'));
const panels = new Panels(
    {totals: $('totals'), robots: $('robots'), matrix: $('matrix'), charts: $('right')},
    {follow: toggleFollow, camera: toggleCamera});
const timeline = new Timeline(
    {slider: $('slider'), play: $('play'), live: $('live'), clock: $('clock'), speed: $('speed')},
    () => {
      changed = true;
    });

let changed = true, chartsChanged = true, caughtUp = false;
let source = 'run';  // live; run: a finished run
let pointed = null;  // position of the pointer in the scene
let camera = null;   // robot whose images are shown
let receivedAt = 0;  // time of the last message [ms since 1970]
let waiting = [];    // messages that have arrived and are not in the scene yet
let showing = [];    // messages that are in the scene and have not been drawn yet
const delays = [];   // {kind, ms}: from the reception by the viewer to the drawing

// ---- messages

const connection = new Connection({
  opened() {
    model.clear();
    caughtUp = false;
    setLink('loading', 'warn');
  },
  closed() {
    caughtUp = false;
    setLink('viewer gone', 'bad');
  },
  message(message) {
    if (message.kind === 'hello') return begin(message);
    if (message.kind === 'forgotten') return model.forgetNumbers(message.numbers);
    if (message.kind === 'caught_up') {
      caughtUp = true;
      if (camera !== null) connection.wantImages(camera, true);
      showLink();
    } else {
      receivedAt = Date.now();
      model.add(message);
      if (caughtUp && timeline.follows) waiting.push(message);
    }
    changed = chartsChanged = true;
  },
});

function begin({source: shown, title, labels}) {
  source = shown;
  $('title').textContent = title;
  $('live').textContent = {live: 'Live', run: 'End'}[source];
  if (source === 'live') $('empty').textContent = 'Waiting for robots that run with --view (or view.on: true)';
  document.title = `${title} – kimera_multi`;
  scene.meshes.setPalette(labels);
}

function setLink(text, className) {
  $('link').textContent = text;
  $('link').className = `badge ${className}`;
}

// Shows whether robots send, or since when not.
function showLink() {
  if (!caughtUp) return;
  if (source === 'run') return setLink('finished run', '');
  const over = model.over((Date.now() - receivedAt) / 1000);
  const at = over && new Date(over.at_ms).toTimeString().slice(0, 8);
  if (!over)
    setLink('live', 'good');
  else if (over.ended)
    setLink(`ended ${at}`, '');
  else
    setLink(`silent since ${at}`, 'bad');
}
setInterval(showLink, 1000);

// ---- display

function countClosures() {
  const counts = {kept: 0, verified: 0, candidate: 0, rejected: 0};
  for (const closure of model.closures().values()) ++counts[closure.verdict];
  return counts;
}

function show() {
  timeline.end = model.end;
  if (timeline.follows) timeline.time = model.end;
  model.seek(timeline.time);
  scene.update(model);
  showing.push(...waiting);
  waiting = [];
  const counts = countClosures();
  panels.updateCards(model);
  panels.mark(scene.follows, camera);
  panels.updateMatrix(model);
  panels.updateTotals(model, counts);
  for (const verdict of Object.keys(VERDICTS))
    layerButtons[verdict].querySelector('b').textContent = counts[verdict];
  for (const button of document.querySelectorAll('[data-layer]'))
    button.hidden = !model.layers.has(button.dataset.layer);
  const leftOut = model.objectsLeftOut();
  layerButtons.objects.title = leftOut ? `${leftOut} smaller objects are not sent` : '';
  $('empty').hidden = model.robots.size > 0;
  if (pointed) showPointed(...pointed);
  drawCamera();
}

let shownAt = 0, chartsAt = 0, lastTick = performance.now();
function tick(now) {
  requestAnimationFrame(tick);
  if (timeline.step((now - lastTick) / 1000)) changed = true;
  lastTick = now;
  // All messages of the past arrive at once: they are shown when they are complete.
  if (changed && now - shownAt >= SHOW_MS && (caughtUp || now - shownAt >= 1000)) {
    changed = false;
    shownAt = now;
    show();
    timeline.draw();
    chartsChanged = true;
  }
  if (chartsChanged && now - chartsAt >= (timeline.playing ? 250 : CHARTS_MS)) {
    chartsChanged = false;
    chartsAt = now;
    panels.updateCharts(model);
    timeline.survey(model);
    timeline.draw();
  }
}
requestAnimationFrame(tick);
scene.onDrawn = () => {
  if (!scene.building) drawLegend();
  const now = Date.now();
  showing = showing.filter(({kind, sent}) => {
    if (kind === 'mesh' && scene.building) return true;
    delays.push({kind, ms: now - sent});
    return false;
  });
  if (delays.length > 20000) delays.splice(0, 10000);
};

function drawLegend() {
  const {meshes} = scene;
  const known =
      ['labels', 'team'].includes(meshes.mode) ? [...meshes.labels].sort((a, b) => a - b) : [];
  const html = known
                   .map((id) => {
                     const item = document.createElement('span');
                     item.textContent = meshes.nameOf(id);
                     return `<span><i style="background:rgb(${
                         meshes.colorOf(id).map(Math.round)})"></i>${item.innerHTML}</span>`;
                   })
                   .join('');
  if ($('legend').innerHTML !== html) $('legend').innerHTML = html;
}

// ---- camera image

function toggleCamera(robot) {
  if (camera !== null) connection.wantImages(camera, false);
  camera = camera === robot ? null : robot;
  if (camera !== null) connection.wantImages(camera, true);
  drawnImage = undefined;
  changed = true;
}
$('camera').querySelector('button').onclick = () => toggleCamera(camera);

function noImageText(robot) {
  if (source !== 'live') return 'results keep no images';
  return robot?.state && robot.state.phase !== 'running' ? 'no image was kept: its input has ended' :
                                                           'no image yet';
}

let drawnImage;
async function drawCamera() {
  $('camera').hidden = camera === null;
  if (camera === null) return;
  const image = model.robots.get(camera)?.image ?? null;
  if (image === drawnImage) return;
  drawnImage = image;
  const caption = $('camera').querySelector('span');
  caption.textContent = image ?
      `${model.name(camera)}: ${image.features} features` :
      `${model.name(camera)}: ${noImageText(model.robots.get(camera))}`;
  if (!image?.jpeg) return;
  const bitmap = await createImageBitmap(new Blob([image.jpeg], {type: 'image/jpeg'}));
  const canvas = $('camera').querySelector('canvas');
  canvas.width = 2 * bitmap.width;
  canvas.height = 2 * bitmap.height;
  const c = canvas.getContext('2d');
  c.scale(2, 2);
  c.drawImage(bitmap, 0, 0);
  c.strokeStyle = '#6fdc8c';
  c.lineWidth = bitmap.width / 260;  // constant width on the screen, independent of the size of the image
  for (let i = 0; i < image.pixels.length; i += 2) {
    c.beginPath();
    c.arc(image.pixels[i] + 0.5, image.pixels[i + 1] + 0.5, bitmap.width / 110, 0, 7);
    c.stroke();
  }
}

// ---- tools

function toggleFollow(robot) {
  scene.follow(scene.follows === robot ? null : robot);
  changed = true;
}
scene.onFollow = toggleFollow;

function viewAll(above) {
  scene.follow(null);
  scene.touched = false;
  scene.fit(above);
  scene.touched = above;
  changed = true;
}
$('view-all').onclick = () => viewAll(false);
$('view-top').onclick = () => viewAll(true);
$('measure').onclick = () => {
  scene.measure(scene.measured === null);
  $('measure').classList.toggle('on', scene.measured !== null);
};

const meshModes = {
  labels: 'Labels',
  colors: 'Colours',
  robots: 'Robots',
  team: 'Team',
  normals: 'Normals',
  off: 'Off'
};
for (const [mode, text] of Object.entries(meshModes)) {
  const button = document.createElement('button');
  button.textContent = text;
  button.className = mode === scene.meshes.mode ? 'on' : '';
  if (mode === 'team') button.dataset.layer = mode;
  button.onclick = () => {
    scene.meshes.setMode(mode);
    for (const other of $('mesh-modes').querySelectorAll('button'))
      other.classList.toggle('on', other === button);
    scene.dirty = changed = true;
  };
  $('mesh-modes').append(button);
}

const layerButtons = {};
function addLayer(name, text, color) {
  const button = document.createElement('button');
  if (color)
    button.append(Object.assign(document.createElement('i'), {style: `background:${color}`}));
  button.append(text);
  if (color) button.append(document.createElement('b'));
  button.classList.toggle('on', scene.layers[name]);
  button.onclick = () => button.classList.toggle(
      'on', (scene.setLayer(name, !scene.layers[name]), scene.layers[name]));
  layerButtons[name] = button;
  $('layers').append(button);
  return button;
}
addLayer('optimized', 'Optimised');
addLayer('odometry', 'Odometry');
addLayer('keyframes', 'Keyframes');
for (const [verdict, {color, text}] of Object.entries(VERDICTS)) addLayer(verdict, text, color);
for (const [name, text] of [['objects', 'Objects'], ['map_2d', '2D map']])
  addLayer(name, text).dataset.layer = name;

// ---- pointer and keys

const pointer = (event) => {
  const box = $('canvas').getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};
$('canvas').addEventListener('pointermove', (event) => {
  if (event.buttons) return;
  pointed = pointer(event);
  showPointed(...pointed);
});
$('canvas').addEventListener('pointerleave', () => {
  pointed = null;
  scene.setHovered(null);
  $('tip').hidden = true;
});

// A closure of a recorded graph, or of a robot that is not shown, comes without its matches.
function supportOf({matches, inliers}) {
  return matches || !inliers ? `${matches} matches, ${inliers} inliers` :
                               `${inliers} inliers, matches not known`;
}

// Text on a closure: [tag, text, class] of each line, and the colour of the first.
function closureText({closure}) {
  const of = ([robot, keyframe]) => `${model.name(robot)} keyframe ${keyframe}`;
  const lines = [
    ['b', closure.verdict, ''], ['p', `${of(closure.from)} – ${of(closure.to)}`, ''],
    ['p', supportOf(closure), '']
  ];
  if (closure.reason) lines.push(['p', closure.reason, 'reason']);
  return {lines, color: VERDICTS[closure.verdict].color};
}

function objectText({name, color, size, robots}) {
  const sides = size.map((side) => side.toFixed(2)).join(' × ');
  const seen = robots.map((robot) => model.name(robot)).join(', ');
  return {
    lines: [['b', name, ''], ['p', `${sides} m`, ''], ['p', `seen by ${seen}`, '']],
    color: `rgb(${color.map(Math.round)})`
  };
}

// Shows what is at a point of the scene: a closure, else an object.
function showPointed(x, y) {
  const closure = scene.closureAt(x, y), object = closure ? null : scene.objectAt(x, y);
  scene.setHovered(closure);
  const tip = $('tip');
  tip.hidden = !closure && !object;
  if (tip.hidden) return;
  const {lines, color} = closure ? closureText(closure) : objectText(object);
  tip.replaceChildren(...lines.map(
      ([tag, text, className]) =>
          Object.assign(document.createElement(tag), {textContent: text, className})));
  tip.firstChild.style.color = color;
  const room = $('canvas').clientWidth - tip.offsetWidth - 8;
  tip.style.left = `${Math.min(x + 14, room)}px`;
  tip.style.top = `${Math.min(y + 14, $('canvas').clientHeight - tip.offsetHeight - 8)}px`;
}

let pressed = null;
$('canvas').addEventListener('pointerdown', (event) => {
  pressed = pointer(event);
});
$('canvas').addEventListener('click', (event) => {
  const [x, y] = pointer(event);
  if (!scene.measured || !pressed || Math.hypot(x - pressed[0], y - pressed[1]) > 4) return;
  scene.addMeasured(scene.pick(x, y));
});
addEventListener('keydown', (event) => {
  if (event.target.closest('button, select') || event.ctrlKey || event.metaKey) return;
  const action = {
    ' ': () => timeline.togglePlay(),
    t: () => viewAll(true),
    f: () => viewAll(false),
    Escape: () => scene.follow(null)
  }[event.key];
  if (!action) return;
  event.preventDefault();
  action();
});

// ---- for tests and for the console

window.kimera = {
  get ready() { return caughtUp && !changed && !scene.building && model.robots.size > 0; },
  get source() { return source; },
  get time() { return model.time; },
  get end() { return model.end; },
  get robots() {
    return [...model.robots.values()]
        .filter((r) => r.lastReceived !== null)
        .map((r) => ({
               id: r.id,
               name: model.name(r.id),
               phase: r.state?.phase,
               anchor: r.optimized.length ? r.anchor : r.id,
               keyframes: Math.max(r.odometry.length, r.optimized.length),
               links: r.state?.links ?? []
             }));
  },
  get frames() { return model.frames().map((f) => f.robots.map((r) => r.id)); },
  get closures() { return countClosures(); },
  get faces() { return model.faces(); },
  get drawnFaces() { return scene.meshes.faces; },
  get objects() { return scene.objects.boxes.length; },
  get rasters() { return scene.rasters.shown.size; },
  get bytes() { return model.bytes; },
  get delays() { return [...delays]; },
  get frameTimes() {
    return scene.frameTimes.map(([, ms]) => ms);
  },
  seek(time) { timeline.go(time); },
  goLive() { timeline.goLive(); },
  viewAll,
  scene,
  model,
};
