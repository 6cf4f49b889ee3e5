// The page: joins the link to the server, the map, the panel and what people do.

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
const FINGER_PX = 20;
const LEAST_SD_M = 0.3;

const view = new View(), planView = new PlanView($('walls'), $('rooms')), painter = new Painter($('canvas'));
const panel = new Panel((k) => { setFollows(false); showFloor(k); });
const scene = { frame: null, cloud: null, trail: { points: new Float32Array(3072), count: 0 }, tapped: null, level: 0 };
let plan = null, mode = null, follows = true, dirty = true, drawnStamp = -1, undrawn = [], sheetAt = null, turned = 0, fitted = false, wanted = 0, invited = false;

const link = new Link({ onHello: hello, onFrame: frame, onRefused: () => hint('Not taken: this is a replay, or it is too busy.', 3000), onState: connection });
const speech = new Speech($('speech'), $('sentence'));
const replay = new Replay((kind, fields) => link.say(kind, fields));
const painted = new MessageChannel();
painted.port1.onmessage = ({ data }) => data.forEach((seq) => link.say('drawn', { seq }));
const drawn = (window.echostep = { frames: 0, view, scene, link, last: null });  // what tests look at

async function hello(said) {
  plan = said.plan;
  scene.trail.count = 0;
  invited = false;
  panel.hello(said);
  replay.show(said.replay);
  $('here').hidden = $('sheet-here').hidden = said.replay;
  await showFloor(Math.min(scene.level, plan.levels.length - 1));
}

async function showFloor(k) {
  wanted = k;
  const walls = await fetch(new URL(`walls/${k}`, document.baseURI)).then((answer) => answer.arrayBuffer());
  if (k !== wanted) return;
  scene.level = k;
  planView.show(new Float32Array(walls), plan.levels[k].rooms);
  if (!fitted) view.fit(planView.box);
  fitted = true;
  panel.floors(k, scene.frame?.told);
  view.changed();
}

function connection(open) {
  if (!open) panel.status('waiting', 'not connected');
}

// Catch up with what the server sent; draw with the next picture. A page that is not seen draws nothing and says so by its silence.
function frame(got) {
  scene.frame = got;
  if (got.cloud) scene.cloud = got.cloud;
  extend(scene.trail, got.trail);
  undrawn.push(got.seq);
  speech.hear(got.guidance);
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
  const { told } = scene.frame ?? {};
  if (dirty && told && follows && !mode) {
    if (!view.shows(planView.box)) view.keep(told.x_m, told.y_m);
    if (told.level !== scene.level && told.level !== wanted) showFloor(told.level);
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
    panel.floors(scene.level, told);
    replay.frame(scene.frame.play);
    if (!told && !invited && scene.frame.words.startsWith('tap')) { invited = true; enter('here'); }
  }
  dirty = false;
  if (undrawn.length) {
    Object.assign(drawn, { frames: drawn.frames + 1, last: scene.frame });
    painted.port2.postMessage(undrawn);
    undrawn = [];
  }
}

// Modes: null, 'here' (a tap says where I am, a drag where I look), 'go' (a tap says where I want to go).
function enter(next, byKey = false) {
  mode = next;
  closeSheet();
  scene.tapped = null;
  $('here').setAttribute('aria-pressed', String(mode === 'here'));
  $('map').classList.toggle('takes', mode !== null);
  $('cross').hidden = !(mode && byKey);
  $('goal').value = mode === 'go' ? 'map' : scene.frame?.guidance?.own ? $('goal').value : '';
  hint(mode === 'here' ? 'Stand still. Tap where you are, drag to where you look.' : mode === 'go' ? 'Tap where you want to go.' : '');
  view.changed();
}

let hintEnds = 0;
function hint(text, for_ms = 0) {
  clearTimeout(hintEnds);
  $('hint').textContent = text;
  $('hint').hidden = !text;
  if (for_ms) hintEnds = setTimeout(() => hint(''), for_ms);
}

function posing(place, heading_rad) {
  scene.tapped = place && { x_m: place[0], y_m: place[1], heading_rad };
  dirty = true;
}

function posed([x_m, y_m], heading_rad) {
  const meant = mode;
  enter(null);
  if (meant === 'go') {
    link.say('go_to', { x_m, y_m, level: scene.level });
    return;
  }
  const sd_m = Math.max(LEAST_SD_M, FINGER_PX / view.scale);
  link.say('check_in', { x_m, y_m, heading_rad, sd_m, level: scene.level });
  posing([x_m, y_m], heading_rad);
  hint(heading_rad === null ? 'Taken. Where you look is found while you walk.' : 'Taken.', 2500);
  setTimeout(() => { if (!mode) posing(null, null); }, 1500);
}

function tapped(place, [sx, sy]) {
  sheetAt = place;
  posing(place, null);
  const sheet = $('sheet');
  sheet.hidden = false;
  sheet.style.left = `${Math.min(Math.max(sx - sheet.offsetWidth / 2, 4), view.width - sheet.offsetWidth - 4)}px`;
  sheet.style.top = `${Math.min(sy + 18, view.height - sheet.offsetHeight - 4)}px`;
}

function closeSheet() {
  $('sheet').hidden = true;
  sheetAt = null;
}

function key(name) {
  const middle = view.toMap(view.width / 2, view.height / 2);
  const deeds = {
    n: () => view.rotate(-view.turn), w: () => { setFollows(false); view.fit(planView.box); }, f: toggleFollow,
    h: () => !$('here').hidden && enter('here', true), g: () => enter('go', true),
    Escape: () => { enter(null); posing(null, null); },
    Enter: () => mode && posed(middle, mode === 'here' ? turned : null),
    ',': () => { turned += Math.PI / 12; dirty = true; }, '.': () => { turned -= Math.PI / 12; dirty = true; },
  };
  deeds[name]?.();
  return name in deeds;
}

function setFollows(on) {
  follows = on;
  dirty = true;
  $('follow').setAttribute('aria-pressed', String(on));
}

function toggleFollow() {
  const { told } = scene.frame ?? {};
  setFollows(!follows);
  if (follows && told && !view.shows(planView.box)) view.centre(told.x_m, told.y_m);
}

new Gestures($('map'), view, { takes: () => mode !== null, tapped, posing, posed, key, moved: () => { setFollows(false); closeSheet(); } });
$('here').onclick = (e) => enter(mode === 'here' ? null : 'here', e.detail === 0);
$('follow').onclick = () => toggleFollow();
$('closer').onclick = () => view.zoom(1.4);
$('farther').onclick = () => view.zoom(1 / 1.4);
$('whole').onclick = () => { setFollows(false); view.fit(planView.box); };
$('north').onclick = () => view.rotate(-view.turn);
$('nowhere').onclick = () => { link.say('go_nowhere'); $('goal').value = ''; };
$('goal').onchange = () => {
  const { value } = $('goal');
  if (value === 'map') return enter('go', true);
  enter(null);
  if (!value) return link.say('go_nowhere');
  const [floor, k] = value.split(' ').map(Number), [x_m, y_m] = plan.levels[floor].rooms[k].at_m;
  $('goal').value = value;
  return link.say('go_to', { x_m, y_m, level: floor });
};
$('sheet-here').onclick = () => { const place = sheetAt; mode = 'here'; posed(place, null); };
$('sheet-go').onclick = () => { const place = sheetAt; mode = 'go'; posed(place, null); };
$('sheet-close').onclick = () => { closeSheet(); posing(null, null); };
startTheme($('theme'), () => { painter.recolour(); dirty = true; view.changed(); });
view.resize($('map').clientWidth, $('map').clientHeight);
new ResizeObserver(([{ contentRect }]) => view.resize(contentRect.width, contentRect.height)).observe($('map'));
requestAnimationFrame(draw);
