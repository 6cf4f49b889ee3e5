// The live page: connects the link to the server, the map, the panel and the user's actions. *Level*: index into the plan's levels; *floor*: its name on the page.

import { Gestures } from './gestures.js';
import { Link } from './link.js';
import { Painter } from './paint.js';
import { Panel } from './panel.js';
import { PlanView } from './plan.js';
import { Replay } from './replay.js';
import { Speech } from './speech.js';
import { startTheme } from './theme.js';
import { View } from './view.js';

const $ = (id) => document.getElementById(id);
const FINGER_PX = 20;  // standard deviation of a tap on the screen
const LEAST_SD_M = 0.3;  // of a check-in

const view = new View(), planView = new PlanView($('walls'), $('rooms')), painter = new Painter($('canvas'));
const panel = new Panel((level) => { setFollows(false); showLevel(level); });
const scene = { frame: null, cloud: null, trail: { points: new Float32Array(3072), count: 0 }, tapped: null, level: 0 };
let plan = null, mode = null, follows = true, dirty = true, drawnStamp = -1, undrawn = [], sheetPosition = null, turned = 0, fitted = false, wantedLevel = 0, invited = false;

const link = new Link({ onHello: hello, onFrame: frame, onRefused: () => hint('Not accepted: this is a replay, or the tracker is too busy.', 3000), onState: connection });
const speech = new Speech($('speech'), $('sentence'));
const replay = new Replay((kind, fields) => link.send(kind, fields));
const painted = new MessageChannel();
painted.port1.onmessage = ({ data }) => data.forEach((seq) => link.send('drawn', { seq }));
const drawn = (window.echostep = { frames: 0, view, scene, link, last: null });  // read by tests

async function hello(message) {
  plan = message.plan;
  scene.trail.count = 0;
  invited = false;
  panel.hello(message);
  replay.show(message.replay);
  $('here').hidden = $('sheet-here').hidden = message.replay;
  await showLevel(Math.min(scene.level, plan.levels.length - 1));
}

async function showLevel(level) {
  wantedLevel = level;
  const walls = await fetch(new URL(`walls/${level}`, document.baseURI)).then((answer) => answer.arrayBuffer());
  if (level !== wantedLevel) return;
  scene.level = level;
  planView.show(new Float32Array(walls), plan.levels[level].rooms);
  if (!fitted) view.fit(planView.box);
  fitted = true;
  panel.floors(level, scene.frame?.told);
  view.changed();
}

function connection(open) {
  if (!open) panel.status('waiting', 'not connected');
}

// Store a frame; it is drawn with the next animation frame. A hidden page draws nothing, so it reports no frame as drawn and gets no more of them.
function frame(received) {
  scene.frame = received;
  if (received.cloud) scene.cloud = received.cloud;
  extend(scene.trail, received.trail);
  undrawn.push(received.seq);
  speech.update(received.guidance);
  dirty = true;
}

function extend(trail, { from, count, points }) {
  const total = from + count;
  if (3 * total > trail.points.length) {
    const more = new Float32Array(6 * total);
    more.set(trail.points.subarray(0, 3 * from));
    trail.points = more;
  }
  trail.points.set(points, 3 * from);
  trail.count = total;
}

function draw() {
  requestAnimationFrame(draw);
  const { told: estimate } = scene.frame ?? {};
  if (dirty && estimate && follows && !mode) {
    if (!view.shows(planView.box)) view.keep(estimate.x_m, estimate.y_m);
    if (estimate.level !== scene.level && estimate.level !== wantedLevel) showLevel(estimate.level);
  }
  const moved = drawnStamp !== view.stamp;
  if (!dirty && !moved) return;
  if (moved) {
    planView.draw(view);
    panel.scale(view);
    drawnStamp = view.stamp;
  }
  if (mode && $('cross').hidden === false) posing(view.toMap(view.width / 2, view.height / 2), mode === 'here' ? turned : null);
  painter.paint(view, scene);
  if (dirty && scene.frame && plan) {
    panel.frame(scene.frame, plan.levels[scene.level].rooms);
    panel.floors(scene.level, estimate);
    replay.frame(scene.frame.play);
    if (!estimate && !invited && scene.frame.words.startsWith('tap')) { invited = true; enter('here'); }
  }
  dirty = false;
  if (undrawn.length) {
    Object.assign(drawn, { frames: drawn.frames + 1, last: scene.frame });
    painted.port2.postMessage(undrawn);
    undrawn = [];
  }
}

// Modes: null, 'here' (a tap gives the wearer's position, a drag the heading too), 'go' (a tap gives the destination).
function enter(next, byKey = false) {
  mode = next;
  closeSheet();
  scene.tapped = null;
  $('here').setAttribute('aria-pressed', String(mode === 'here'));
  $('map').classList.toggle('takes', mode !== null);
  $('cross').hidden = !(mode && byKey);
  $('goal').value = mode === 'go' ? 'map' : scene.frame?.guidance?.own ? $('goal').value : '';
  hint(mode === 'here' ? 'Stand still. Tap where you are, drag in the direction you face.' : mode === 'go' ? 'Tap where you want to go.' : '');
  view.changed();
}

let hintEnds = 0;
function hint(text, for_ms = 0) {
  clearTimeout(hintEnds);
  $('hint').textContent = text;
  $('hint').hidden = !text;
  if (for_ms) hintEnds = setTimeout(() => hint(''), for_ms);
}

function posing(position, heading_rad) {
  scene.tapped = position && { x_m: position[0], y_m: position[1], heading_rad };
  dirty = true;
}

function posed([x_m, y_m], heading_rad) {
  const before = mode;
  enter(null);
  if (before === 'go') {
    link.send('go_to', { x_m, y_m, level: scene.level });
    return;
  }
  const sd_m = Math.max(LEAST_SD_M, FINGER_PX / view.scale);
  link.send('check_in', { x_m, y_m, heading_rad, sd_m, level: scene.level });
  posing([x_m, y_m], heading_rad);
  hint(heading_rad === null ? 'Sent. Your direction is found while you walk.' : 'Sent.', 2500);
  setTimeout(() => { if (!mode) posing(null, null); }, 1500);
}

function tapped(position, [sx, sy]) {
  sheetPosition = position;
  posing(position, null);
  const sheet = $('sheet');
  sheet.hidden = false;
  sheet.style.left = `${Math.min(Math.max(sx - sheet.offsetWidth / 2, 4), view.width - sheet.offsetWidth - 4)}px`;
  sheet.style.top = `${Math.min(sy + 18, view.height - sheet.offsetHeight - 4)}px`;
}

function closeSheet() {
  $('sheet').hidden = true;
  sheetPosition = null;
}

function key(name) {
  const middle = view.toMap(view.width / 2, view.height / 2);
  const actions = {
    n: () => view.rotate(-view.turn), w: () => { setFollows(false); view.fit(planView.box); }, f: toggleFollow,
    h: () => !$('here').hidden && enter('here', true), g: () => enter('go', true),
    Escape: () => { enter(null); posing(null, null); },
    Enter: () => mode && posed(middle, mode === 'here' ? turned : null),
    ',': () => { turned += Math.PI / 12; dirty = true; }, '.': () => { turned -= Math.PI / 12; dirty = true; },
  };
  actions[name]?.();
  return name in actions;
}

function setFollows(on) {
  follows = on;
  dirty = true;
  $('follow').setAttribute('aria-pressed', String(on));
}

function toggleFollow() {
  const { told: estimate } = scene.frame ?? {};
  setFollows(!follows);
  if (follows && estimate && !view.shows(planView.box)) view.centre(estimate.x_m, estimate.y_m);
}

new Gestures($('map'), view, { takesPose: () => mode !== null, tapped, posing, posed, key, moved: () => { setFollows(false); closeSheet(); } });
$('here').onclick = (e) => enter(mode === 'here' ? null : 'here', e.detail === 0);
$('follow').onclick = () => toggleFollow();
$('closer').onclick = () => view.zoom(1.4);
$('farther').onclick = () => view.zoom(1 / 1.4);
$('whole').onclick = () => { setFollows(false); view.fit(planView.box); };
$('north').onclick = () => view.rotate(-view.turn);
$('end-guidance').onclick = () => { link.send('go_nowhere'); $('goal').value = ''; };
$('goal').onchange = () => {
  const { value } = $('goal');
  if (value === 'map') return enter('go', true);
  enter(null);
  if (!value) return link.send('go_nowhere');
  const [level, room] = value.split(' ').map(Number), [x_m, y_m] = plan.levels[level].rooms[room].at_m;
  $('goal').value = value;
  return link.send('go_to', { x_m, y_m, level });
};
$('sheet-here').onclick = () => { const position = sheetPosition; mode = 'here'; posed(position, null); };
$('sheet-go').onclick = () => { const position = sheetPosition; mode = 'go'; posed(position, null); };
$('sheet-close').onclick = () => { closeSheet(); posing(null, null); };
startTheme($('theme'), () => { painter.recolour(); dirty = true; view.changed(); });
view.resize($('map').clientWidth, $('map').clientHeight);
new ResizeObserver(([{ contentRect }]) => view.resize(contentRect.width, contentRect.height)).observe($('map'));
requestAnimationFrame(draw);
