// SPDX-License-Identifier: MIT
// The live page: connects the link to the server, the map, the panel and the user's actions. *Level*: index into the plan's levels; *floor*: its name on the page.

import { Gestures } from './gestures.js';
import { LIVE, LIVE_KEYS, startLegend } from './legend.js';
import { stayAwake } from './live/awake.js';
import { onHeld } from './held.js';
import { Link } from './link.js';
import { Painter } from './live/paint.js';
import { Panel } from './live/panel.js';
import { PlanView } from './plan.js';
import { Orders } from './live/orders.js';
import { Replay } from './live/replay.js';
import { Speech } from './live/speech.js';
import { Taps } from './live/taps.js';
import { Charts } from './tools/charts.js';
import { Drops } from './tools/drop.js';
import { Globe } from './tools/globe.js';
import { readLink } from './tools/hash.js';
import { Layers } from './tools/layers.js';
import { Measure } from './tools/measure.js';
import { titled } from './tools/titles.js';
import { Tools } from './tools/tools.js';
import { inUnits, showScale } from './tools/units.js';
import { startTheme } from './theme.js';
import { View } from './view.js';
import { localise, missing, tr } from './language.js';

const BESIDE = 0.1;  // share of the free part, where only what lies over the map hides some of the plan
const $ = (id) => document.getElementById(id);
localise(document.body);

const view = new View(), planView = new PlanView($('walls'), $('rooms')), painter = new Painter($('canvas'));
const panel = new Panel((level) => { setFollows(false); showLevel(level); });
const scene = { frame: null, cloud: null, drawing: null, marks: [], trail: { points: new Float32Array(3072), count: 0 }, tapped: null, level: 0, isOld: false, layers: new Layers(), measure: new Measure() };
let plan = null, title = '', mode = null, follows = true, dirty = true, drawnStamp = -1, undrawn = [], turned = 0, fitted = false, arrived = false, fittedScale = 0, wantedLevel = 0, metNumber = 0, invited = false, isLive = true, broken = false, awake = false, globe = null, linked = readLink(location.hash), moment = linked?.t_s ?? null;

const taps = new Taps(view, {
  send: (kind, fields) => link.send(kind, fields), changed: () => { scene.tapped = taps.ghost; dirty = true; }, mayCheckIn: () => !$('here').hidden,
  globe: () => globe,
  keptHeading: () => (scene.frame?.told?.heading_known ? scene.frame.told.heading_rad : null),
});
const link = new Link({
  onHello: hello, onFrame: frame, onRefused: (reason) => hint(reason, 6000), onFailed: failed, onConsidered: (answer) => taps.considered(answer), onAge: connection, onUnsent: (text) => speech.unsent(text),
  isLive: () => isLive && scene.frame?.ended == null,
});
const speech = new Speech($('speech'), $('sentence'), $('invitation'), $('unspoken'));
const orders = new Orders((kind, fields) => link.send(kind, fields), (text) => speech.unsent(text));
const showLegend = startLegend($('legend-button'), LIVE, LIVE_KEYS, redraw);
const replay = new Replay((kind, fields) => link.send(kind, fields));
const drops = new Drops(hint), charts = new Charts($('charts'), () => painter.colour, seek);
const tools = new Tools({ view, scene, planView, layers: scene.layers, charts, hint, enter, seek, changed: redraw, plan: () => plan, globe: () => globe, takesFiles: () => drops.takes });
const painted = new MessageChannel();
painted.port1.onmessage = ({ data }) => data.forEach((seq) => link.send('drawn', { seq }));
const drawn = (window.echostep = { frames: 0, view, scene, link, charts, last: null, missing, tr });  // read by tests

async function hello(message) {
  if (plan && (plan.digest !== message.plan.digest || title !== message.title)) startAnew();
  title = message.title;
  plan = message.plan;
  globe = plan.globe ? new Globe(plan.globe) : null;
  view.north = plan.north_rad;
  scene.trail.count = 0;
  scene.drawing = null;
  invited = false;
  panel.hello(message);
  const begins = message.replay && $('replay').hidden;
  replay.show(message.replay);
  if (begins) {  // the time bar takes room: the floor is fitted into what is left
    view.resize($('map').clientWidth, $('map').clientHeight);
    fitted = false;
  }
  isLive = !message.replay && !message.takes_files;
  broken = false;
  $('here').hidden = $('sheet-here').hidden = $('help').hidden = !isLive;
  drops.show(message.takes_files, !message.replay);
  if (!isLive) panel.team([]);
  else if (!awake) stayAwake();
  awake ||= isLive;
  speech.invite(isLive);
  taps.reconnected();
  charts.clear();
  await showLevel(Math.min(linked ? linked.level : scene.level, plan.levels.length - 1));
  if (linked) goToLink();
}

// The view of the link by which the page was opened; its moment comes when the replay has got so far.
function goToLink() {
  setFollows(false);
  const { x, y, scale, turn } = linked;
  Object.assign(view, { x, y, scale, turn });
  fitted = true;
  view.changed();
  linked = null;
}

function seek(t_s) { link.send('seek', { t_s }); }

function redraw() {
  dirty = true;
  view.changed();
}

// Another run on another plan answers at this address: what was chosen on the old plan means nothing on it.
function startAnew() {
  Object.assign(scene, { frame: null, cloud: null, level: 0 });
  fitted = arrived = false;
  taps.drop();
  scene.measure.clear();
  replay.forget();
}

async function showLevel(level) {
  wantedLevel = level;
  const answer = await fetch(new URL(`lines/${level}`, document.baseURI)).catch(() => null);
  if (!answer) return;  // the server is away; when it is back, its hello shows the level again
  if (!answer.ok) return panel.fault(await answer.text());
  const lines = await answer.arrayBuffer();
  if (level !== wantedLevel) return;
  scene.level = level;
  planView.show(lines, plan.levels[level]);
  if (!fitted) {
    view.fit(planView.box);
    fitted = true;
    fittedScale = view.scale;
    arrive(scene.frame?.told);
  }
  panel.floors(level, scene.frame?.told);
  view.changed();
}

// The first estimate in a view that is still as it was fitted.
function arrive(estimate) {
  if (arrived || !fitted || !estimate?.placed) return;
  arrived = true;
  if (view.scale === fittedScale && !linked) view.approach(estimate.x_m, estimate.y_m, planView.box);
}

// What is left of the last frame while no other one comes: no way to go, no claim.
function connection() {
  const { pulse, isOpen } = link;
  dirty ||= pulse.isSilent || scene.isOld;
  scene.isOld = pulse.isSilent;
  if (pulse.isSilent && scene.frame?.guidance && pulse.isLive()) {
    const text = 'Stop. There is nothing from the tracker.', stopped = { ...scene.frame.guidance, kind: 'stop', text, arrow_rad: null, left_m: null, spoken: text, spoken_s: null };
    panel.guidance(stopped);
    speech.update(stopped);
  }
  if (broken) panel.status('ended', 'ended by an error');
  else if (pulse.isSilent && pulse.isLive()) panel.status('lost', `no position for ${pulse.ago}`);
  else if (!isOpen) panel.status('waiting', 'not connected');
}

// `ended`: the reason is the error that ended the run.
function failed(reason, ended) {
  broken = Boolean(ended);
  panel.fault(reason);
}

// Store a frame; it is drawn with the next animation frame. A hidden page draws nothing, so it reports no frame as drawn and gets no more of them.
function frame(received) {
  scene.frame = received;
  if (received.cloud) scene.cloud = received.cloud;
  if (received.drawing) panel.drawing(scene.drawing = received.drawing.path.length ? received.drawing : null);
  if (received.team) panel.team(received.team);
  if (received.met && received.met.number !== metNumber) {
    metNumber = received.met.number;
    hint(received.met.text, 8000);
  }
  if (received.marks) panel.marks(scene.marks = received.marks);
  extend(scene.trail, received.trail);
  undrawn.push(received.seq);
  speech.alarm(received.play ? null : received.alarm);
  if (!received.alarm) speech.update(received.guidance);
  if (!received.play && !received.alarm) speech.sent(received.errand);
  orders.show(received.play ? [] : received.orders);
  dirty = true;
}

function extend(trail, { first, count, points }) {
  const total = first + count;
  if (3 * total > trail.points.length) {
    const more = new Float32Array(6 * total);
    more.set(trail.points.subarray(0, 3 * first));
    trail.points = more;
  }
  trail.points.set(points, 3 * first);
  trail.count = total;
}

function draw() {
  requestAnimationFrame(draw);
  const { told: estimate } = scene.frame ?? {};
  if (dirty && estimate && follows && !mode && !taps.ghost) {
    arrive(estimate);
    if (estimate.placed && !view.shows(planView.box)) view.keep(estimate.x_m, estimate.y_m, view.shows(planView.box, view.all) ? BESIDE : undefined);
    if (estimate.level !== scene.level && estimate.level !== wantedLevel) showLevel(estimate.level);
  }
  const moved = drawnStamp !== view.stamp;
  if (!dirty && !moved) return;
  if (moved) {
    planView.draw(view);
    showScale(view);
    drawnStamp = view.stamp;
  }
  if (mode && mode !== 'measure' && !$('cross').hidden) aim(view.toMap(view.width / 2, view.height / 2), mode === 'here' ? turned : null);
  $('rooms').toggleAttribute('hidden', !scene.layers.shows('names'));
  planView.names(view, [...(estimate?.placed ? [estimate] : []), ...(estimate?.hypotheses ?? [])].filter(({ level }) => level === scene.level).map(({ x_m, y_m }) => view.toScreen(x_m, y_m)));
  painter.paint(view, scene);
  if (dirty && scene.frame && plan) {
    panel.frame(scene.frame);
    connection();  // the frame may be older than the end of the connection
    taps.undoable(scene.frame.undo);
    panel.floors(scene.level, estimate);
    replay.frame(scene.frame.play, scene.frame.ended);
    charts.frame(scene.frame.play);
    if (moment !== null && scene.frame.play?.end_s >= moment) { link.send('play', { playing: false }); seek(moment); moment = null; }
    if (!estimate && !invited && scene.frame.words.startsWith('tap')) { invited = true; enter('here'); }
  }
  dirty = false;
  if (undrawn.length) {
    Object.assign(drawn, { frames: drawn.frames + 1, last: scene.frame });
    painted.port2.postMessage(undrawn);
    undrawn = [];
  }
}

// Modes: null, 'here' (a tap gives the wearer's position, a drag the heading too), 'go' (a tap gives the destination), 'measure' (two taps).
function enter(next, byKey = false) {
  mode = next;
  taps.drop();
  $('here').setAttribute('aria-pressed', String(mode === 'here'));
  $('map').classList.toggle('takes', mode !== null);
  $('cross').hidden = !(mode && byKey);
  $('goal').value = mode === 'go' ? 'map' : scene.frame?.goal ? panel.optionOf(scene.frame.goal) : '';
  hint(mode === 'here' ? 'Stand still. Tap where you are, drag in the direction you face.' : mode === 'go' ? 'Tap where you want to go.' : mode === 'measure' ? 'Tap two places.' : '');
  if (mode === 'measure') scene.measure.clear();
  view.changed();
}

let hintEnds = 0;
function hint(text, for_ms = 0) {
  clearTimeout(hintEnds);
  $('hint').textContent = tr(inUnits(text));
  $('hint').hidden = !text;
  if (for_ms) hintEnds = setTimeout(() => hint(''), for_ms);
}

const aim = (position, heading_rad) => taps.aim(position, heading_rad);

function posed(position, heading_rad) {
  const before = mode;
  enter(null);
  if (before === 'go') return go(position, scene.level);
  taps.put(position, heading_rad, scene.level, false);
  $('sheet-here').focus({ preventScroll: true });
}

function tapped(position) {
  if (mode === 'measure') return measured(position);
  taps.put(position, null, scene.level, true);
}

function measured(position) {
  scene.measure.add(position, scene.level);
  hint(scene.measure.text ? `Distance: ${scene.measure.text}. Escape ends measuring.` : 'Tap the second place.');
  dirty = true;
}

function go([x_m, y_m], level) { link.send('go_to', { x_m, y_m, level }); }

function key(name) {
  const middle = view.toMap(view.width / 2, view.height / 2);
  const actions = {
    l: () => showLegend(false), '?': () => showLegend(true), t: () => tools.open(), c: () => tools.setCharts(!charts.on), d: () => enter('measure', true), n: () => view.northUp(), w: fitWhole, f: toggleFollow,
    h: () => !$('here').hidden && enter('here', true), g: () => enter('go', true),
    ' ': () => !$('replay').hidden && $('play').click(),
    Escape: () => { scene.measure.clear(); enter(null); },
    Enter: () => (mode === 'measure' ? measured(middle) : mode && posed(middle, mode === 'here' ? turned : null)),
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

// The whole plan, and the whole track and drawing where these lead out of it.
function fitWhole() {
  setFollows(false);
  const box = planView.isEmpty && scene.drawing ? [Infinity, Infinity, -Infinity, -Infinity] : [...planView.box], { points, count } = scene.trail, walls = scene.drawing?.walls ?? [];
  const add = (x, y) => { if (Number.isNaN(x)) return; box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y); box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y); };
  for (let k = 0; k < count; k++) add(points[3 * k], points[3 * k + 1]);
  for (let k = 0; k < walls.length; k += 5) { add(walls[k], walls[k + 1]); add(walls[k + 2], walls[k + 3]); }
  view.fit(box);
}

function toggleFollow() {
  const { told: estimate } = scene.frame ?? {};
  setFollows(!follows);
  if (follows && estimate && !view.shows(planView.box)) view.centre(estimate.x_m, estimate.y_m);
}

new Gestures($('map'), view, { takesPose: () => mode === 'here' || mode === 'go', tapped, posing: aim, posed, key, moved: () => { setFollows(false); taps.moved(); } });
$('here').onclick = (e) => enter(mode === 'here' ? null : 'here', e.detail === 0);
$('follow').onclick = () => toggleFollow();
$('closer').onclick = () => view.zoom(1.4);
$('farther').onclick = () => view.zoom(1 / 1.4);
$('whole').onclick = fitWhole;
$('north').onclick = () => view.northUp();
onHeld($('help'), () => link.send('call', { help: true }), () => hint('Hold Help! for a second.', 4000));
$('fine').onclick = () => link.send('call', { help: false });
$('end-guidance').onclick = () => link.send('go_nowhere');
$('met').onchange = () => {
  if ($('met').value) link.send('met', { name: $('met').value });
  $('met').value = '';
};
$('goal').onchange = () => {
  const { value } = $('goal');
  if (value === 'map') return enter('go', true);
  enter(null);
  if (!value) return link.send('go_nowhere');
  const [level, room] = value.split(' ').map(Number);
  $('goal').value = value;
  return go(plan.levels[level].rooms[room].at_m, level);
};
$('sheet-go').onclick = () => {
  const { x_m, y_m, level } = taps.ghost;
  taps.drop();
  go([x_m, y_m], level);
};
window.addEventListener('error', ({ message }) => panel.fault(`This page has a fault: ${message}. Reload it.`));
window.addEventListener('unhandledrejection', ({ reason }) => panel.fault(`This page has a fault: ${reason?.message ?? reason}. Reload it.`));
view.layOver(...['messages', 'floors', 'floor'].map($));
startTheme($('theme'), () => { painter.recolour(); charts.paint(); redraw(); });
view.resize($('map').clientWidth, $('map').clientHeight);
new ResizeObserver(([{ contentRect }]) => view.resize(contentRect.width, contentRect.height)).observe($('map'));
requestAnimationFrame(draw);
titled({ 'legend-button': 'L, ?', north: 'N', whole: 'W', follow: 'F', here: 'H', goal: 'G', 'tools-button': 'T', 'tool-measure': 'D', 'tool-charts': 'C', closer: '+', farther: '−' });
