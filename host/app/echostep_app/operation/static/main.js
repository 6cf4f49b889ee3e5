// SPDX-License-Identifier: MIT
// The commander's page: connects the link to the server, the map and the list.

import { Gestures } from '../static/gestures.js';
import { COMMAND, COMMAND_KEYS, startLegend } from '../static/legend.js';
import { Link } from '../static/link.js';
import { PlanView } from '../static/plan.js';
import { startTheme } from '../static/theme.js';
import { View } from '../static/view.js';
import { localise, missing, tr } from '../static/language.js';
import { stayAwake } from '../static/live/awake.js';
import { Globe } from '../static/tools/globe.js';
import { Measure } from '../static/tools/measure.js';
import { titled } from '../static/tools/titles.js';
import { showScale } from '../static/tools/units.js';
import { Alarm } from './alarm.js';
import { Crews } from './crews.js';
import { Floors } from './floors.js';
import { List } from './list.js';
import { Painter } from './paint.js';
import { Orders } from './orders.js';
import { Sheet } from './sheet.js';
import { Storeys } from './storeys.js';
import { put, say } from '../static/text.js';
import { TimeBar } from '../static/timebar.js';
import { Trails } from './trails.js';
import { parseFrame, placesOf } from './wire.js';

const TAP_PX = 28;  // a wearer within this distance of a tap is chosen
const $ = (id) => document.getElementById(id);
localise(document.body);
const view = new View(), planView = new PlanView($('walls'), $('rooms')), painter = new Painter($('canvas')), trails = new Trails($('trails'), $('trails-next'));
const scene = { places: new Map(), rows: [], marks: [], level: 0, chosen: null, isOld: false, measure: new Measure() };
const storeys = new Storeys(), floors = new Floors((level) => (level === null ? stack() : visit(level)));
const list = new List(choose, (id) => sheet.signed((by) => link.send('send', { id, to: scene.chosen, by })));
const alarm = new Alarm(view, { show: goTo, open: (id) => list.choose(id), level: () => wantedLevel, showLevel: visit, floor: (level) => plan.levels[level].name });
let plan = null, wantedLevel = 0, fitted = false, isAsked = false, globe = null, drawnStamp = -1, undrawn = [], found = false, isRecorded = false;

const link = new Link({ onHello: hello, onFrame: frame, onRefused: hint, onFailed: (reason) => fault(reason), onConsidered: () => {}, onAge: connection, onUnsent: () => {}, isLive: () => !isRecorded, parse: parseFrame });
const sheet = new Sheet((kind, fields) => link.send(kind, fields), hint, { words: (x, y) => globe?.words(x, y), measure: measured });
const showLegend = startLegend($('legend-button'), COMMAND, COMMAND_KEYS, inOtherUnit), crews = new Crews((act) => sheet.signed(act), (kind, fields) => link.send(kind, fields));
const orders = new Orders((act) => sheet.signed(act), (kind, fields) => link.send(kind, fields), () => scene.chosen, hint);
const timeBar = new TimeBar((kind, fields) => link.send(kind, fields));
const painted = new MessageChannel();
painted.port1.onmessage = ({ data }) => data.forEach((seq) => link.send('drawn', { seq }));
const drawn = (window.echostep = { frames: 0, view, scene, storeys, link, last: null, missing, tr });  // read by tests

async function hello(message) {
  plan = message.plan;
  view.north = plan.north_rad;
  globe = plan.globe ? new Globe(plan.globe) : null;
  scene.measure.clear();
  found = fitted = false;
  fault('');
  trails.clear();
  isRecorded = message.replay;
  timeBar.show(message.replay);
  $('title').textContent = `${message.title}: ${plan.name}`;
  alarm.entitle(message.title);
  floors.plan(plan.levels);
  const wasStacked = storeys.on;
  storeys.clear();
  if (scene.chosen !== null) link.send('choose', { id: scene.chosen });
  await showLevel(Math.min(scene.level, plan.levels.length - 1));
  if (wasStacked) stack();
}

// Nothing while the server is away: when it is back, its hello shows the level again.
async function lines(level) {
  const answer = await fetch(new URL(`lines/${level}`, document.baseURI)).catch(() => null);
  if (answer && !answer.ok) fault(await answer.text());
  return answer?.ok ? answer.arrayBuffer() : null;
}

async function showLevel(level) {
  wantedLevel = level;
  const rows = await lines(level);
  if (!rows || level !== wantedLevel) return;
  scene.level = level;
  planView.show(rows, plan.levels[level]);
  if (!fitted) view.fit(planView.box);
  fitted = true;
  stacked();
}

function visit(level) {
  storeys.on = false;
  stacked();
  if (level !== wantedLevel) showLevel(level);
}

// All storeys over each other.
async function stack() {
  await storeys.open(plan.levels, lines);
  stacked();
}

function stacked() {
  $('map').classList.toggle('stacked', storeys.on);
  floors.show(storeys.on ? null : scene.level, scene.rows);
  view.changed();
}

// What is left of the last frame while no other one comes: no row is heard now, and the radii are of then.
function connection() {
  const { pulse, isOpen } = link, isOld = pulse.isSilent && pulse.isLive();
  if (scene.frame && scene.isOld !== isOld) {
    scene.isOld = isOld;
    list.show(isOld ? scene.rows.map(then) : scene.rows, isRecorded);
  }
  ask();
  if (!pulse.isSilent && isOpen) return scene.frame && status(scene.frame);
  $('words').dataset.status = 'broken';
  put($('mark'), '✕');
  say($('status-text'), isOld ? `no news for ${pulse.ago}` : 'this page is not connected');
}

const then = (row) => ({ ...row, state: ['mayday', 'asked'].includes(row.state) ? row.state : 'stale', words: row.words.replace(/(, )?heard now$/, '') });

// Store a frame; it is drawn with the next animation frame. A hidden page draws nothing, so it reports no frame as drawn and gets no more of them.
function frame(received) {
  scene.places = placesOf(received.places);
  if (!received.trail_from) trails.clear();
  trails.add(received.trail, received.unix_s);
  timeBar.frame(received.play, false, received.unix_s);
  if (received.list) {
    scene.rows = received.list;
    list.show(received.list, isRecorded);
    floors.show(storeys.on ? null : scene.level, scene.rows);
    findFirst();
  }
  if (received.list && !isRecorded) alarm.update(received.list, scene.places);
  if (received.marks) scene.marks = received.marks;
  orders.show(received.order, received.unix_s);
  orders.log(received.log);
  link.outbox.wait(received.waiting);
  crews.show(received.crews, received.unix_s, isRecorded);
  list.details(received.details, received.distress);
  scene.frame = received;
  if (!link.pulse.isSilent) status(received);
  if (document.hidden) link.send('drawn', { seq: received.seq });  // nothing is drawn, but a mayday must still sound
  else undrawn.push(received.seq);
  ask();
}

function status({ summary, refused, connected, fault }) {
  put($('mark'), connected ? '●' : '✕');
  if ($('words').dataset.status !== (connected ? 'tracking' : 'broken')) $('words').dataset.status = connected ? 'tracking' : 'broken';
  say($('status-text'), connected ? 'connected' : 'no broker: the last known state');
  say($('summary'), (isRecorded ? 'recorded: ' : '') + summary);
  const why = [fault, refused && `rejected: ${refused}`].filter(Boolean).join('; ');
  say($('refused'), why);
  if ($('refused').hidden !== !why) $('refused').hidden = !why;
}

// The page begins on the floor of the most urgent wearer.
function findFirst() {
  const first = scene.rows.find(({ level }) => level !== null);
  if (found || !first || !plan) return;
  found = true;
  if (first.level !== wantedLevel) showLevel(first.level);
}

function choose(id) {
  scene.chosen = id;
  ask();
  link.send('choose', { id });
  const place = scene.places.get(id);
  if (place) goTo(place);
}

// The floor and the place of a wearer come into view.
function goTo({ x, y, level }) {
  visit(level);
  view.keep(x, y);
}

function fault(text) {
  say($('fault'), text);
  $('fault').hidden = !text;
}

// The list and the details are sent anew, also while nothing happens in them.
function inOtherUnit() {
  list.again();
  link.send('choose', { id: scene.chosen });
  view.changed();
}

// Draw with the next animation frame.
function ask() {
  if (!isAsked) requestAnimationFrame(draw);
  isAsked = true;
}

function draw() {
  isAsked = false;
  alarm.keep(scene.places);
  if (drawnStamp !== view.stamp) {
    planView.draw(view);
    showScale(view);
  }
  const here = scene.rows.filter(({ id }) => scene.places.has(id) && (storeys.on || scene.places.get(id).level === scene.level)).map((row) => {
    const place = scene.places.get(row.id);
    return scene.isOld ? { ...then(row), place: { ...place, heading: NaN, radius: NaN, protection: NaN } } : { ...row, place };
  });
  if (storeys.on) storeys.paint(painter, view, here, scene.chosen);
  else paint(here);
  [drawnStamp, drawn.last] = [view.stamp, scene.frame ?? null];
  if (trails.isBehind) ask();
  drawn.frames++;
  if (undrawn.length) painted.port2.postMessage(undrawn);
  undrawn = [];
}

function paint(here) {
  planView.names(view, here.map(({ place }) => view.toScreen(place.x, place.y)));
  trails.paint(view, scene.level, painter.colour.trail);
  painter.paint(view, here, scene.chosen, trails.points(scene.chosen), scene.marks, scene.level);
  scene.measure.paint(painter.pen, view, scene.level, painter.colour);
}

// Two places whose distance is shown; the first one from the sheet of a place, the second by a tap.
function measured(position, level) {
  scene.measure.add(position, level);
  hint(scene.measure.text ? `Distance: ${scene.measure.text}. Escape ends measuring.` : 'Tap the second place.');
  view.changed();
}

function tapped(position, pixel) {
  if (storeys.on) {
    if (!storeys.stamp) return;  // not painted yet
    const { id, level } = storeys.at(pixel, TAP_PX);
    return id === undefined ? visit(level) : list.choose(id);
  }
  if (scene.measure.points.length === 1) return measured(position, scene.level);
  const near = scene.rows.map(({ id }) => scene.places.get(id)).filter((place) => place?.level === scene.level).map(({ id, x, y }) => {
    const [sx, sy] = view.toScreen(x, y);
    return { id, far: Math.hypot(sx - pixel[0], sy - pixel[1]) };
  }).filter(({ far }) => far < TAP_PX).sort((a, b) => a.far - b.far);
  if (near.length) return list.choose(near[0].id);
  place(position, pixel);
}

// What can be done at a place: with the mark that is there, or a new one.
function place([x_m, y_m], pixel) {
  const mark = scene.marks.find(({ x_m: x, y_m: y, level }) => {
    const [sx, sy] = view.toScreen(x, y);
    return level === scene.level && Math.hypot(sx - pixel[0], sy - pixel[1]) < TAP_PX;
  });
  sheet.open({ x_m, y_m, level: scene.level }, mark, pixel, [view.width, view.height]);
}

let hinted = 0;
function hint(text) {
  say($('hint'), text);
  $('hint').hidden = false;
  clearTimeout(hinted);
  hinted = setTimeout(() => { $('hint').hidden = true; }, 6000);
}

function key(name) {
  const middle = [view.width / 2, view.height / 2];
  const does = { m: () => { if (storeys.on) return; place(view.toMap(...middle), middle); $('mark-cleared').focus(); }, l: () => showLegend(false), '?': () => showLegend(true), p: () => $('crews-button').click(), v: () => $('all-floors').click(), n: () => view.northUp(), ' ': () => $('play').click(), w: () => view.fit(planView.box), Escape: () => { scene.measure.clear(); ask(); sheet.close(); list.choose(null); } }[name.length === 1 ? name.toLowerCase() : name];
  does?.();
  return Boolean(does);
}

new Gestures($('map'), view, { takesPose: () => false, tapped, posing: () => {}, posed: () => {}, moved: () => { sheet.close(); alarm.isLeft = true; }, key });
$('acknowledge').onclick = () => sheet.signed((by) => link.send('acknowledge', { id: scene.chosen, by }));
$('closer').onclick = () => view.zoom(1.4);
$('farther').onclick = () => view.zoom(1 / 1.4);
$('whole').onclick = () => view.fit(planView.box);
$('north').onclick = () => view.northUp();
window.addEventListener('error', ({ message }) => fault(`This page has a fault: ${message}. Reload it.`));
window.addEventListener('unhandledrejection', ({ reason }) => fault(`This page has a fault: ${reason?.message ?? reason}. Reload it.`));
view.onChanged = ask;
view.layOver(...['messages', 'floors', 'floor'].map($));
startTheme($('theme'), () => { painter.recolour(); view.changed(); });
view.resize($('map').clientWidth, $('map').clientHeight);
new ResizeObserver(([{ contentRect }]) => view.resize(contentRect.width, contentRect.height)).observe($('map'));
stayAwake();
titled({ 'legend-button': 'L, ?', north: 'N', whole: 'W', 'crews-button': 'P' });
