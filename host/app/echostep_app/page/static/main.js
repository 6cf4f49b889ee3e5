// SPDX-License-Identifier: MIT
// The page: what both roles share, and the parts of the role that the server wrote into <html>, wearer or commander (wearer/role.js, commander/role.js).
// *Level*: index into the plan's levels; *floor*: its name on the page.

import { stayAwake } from './awake.js';
import { Commander } from './commander/role.js';
import { Floors } from './floors.js';
import { Gestures } from './gestures.js';
import { localise, missing, tr } from './language.js';
import { startLegend } from './legend.js';
import { Link } from './link.js';
import { PlanView } from './plan.js';
import { put, said, tell } from './text.js';
import { startTheme } from './theme.js';
import { TimeBar } from './timebar.js';
import { Globe } from './tools/globe.js';
import { Measure } from './tools/measure.js';
import { titled } from './tools/titles.js';
import { showScale } from './tools/units.js';
import { View } from './view.js';
import { Wearer } from './wearer/role.js';

const MARKS = { waiting: '○', tracking: '●', uncertain: '◐', lost: '✕', broken: '✕', ended: '■' };
const LONG = 26, VERY_LONG = 60;  // letters of a status that is written smaller
const HINT_MS = 6000;
const $ = (id) => document.getElementById(id);
const ROLES = { wearer: Wearer, commander: Commander }, role = document.documentElement.className;
for (const part of document.querySelectorAll('[data-for]')) if (part.dataset.for !== role) part.remove();
localise(document.body);

const view = new View(), planView = new PlanView($('walls'), $('rooms'));
const scene = { frame: null, marks: [], level: 0, isOld: false, measure: new Measure() };
const page = {
  view, planView, scene, plan: null, title: '', globe: null, isReplay: false, isLive: true, isFitted: false, wantedLevel: 0,
  send: (kind, fields) => link.send(kind, fields), seek: (t_s) => timeBar.seek(t_s), ask, fault, hint, lines, measured, showFloors, showLevel, status,
};
let isAsked = false, drawnStamp = -1, undrawn = [], hintEnds = 0, isAwake = false;

const timeBar = new TimeBar(page.send);
const parts = new ROLES[role](page);
const floors = new Floors((level) => parts.floorChosen(level), parts.hasAllFloors);
const link = page.link = new Link({
  onHello: hello, onFrame: frame, onRefused: (reason) => hint(reason), onFailed: (reason, ended) => { parts.failed?.(ended); fault(reason); },
  onConsidered: (answer) => parts.considered(answer), onAge: aged, onUnsent: (text) => parts.unsent?.(text), isLive: () => page.isLive && scene.frame?.ended == null, parse: parts.parse,
});
const showLegend = startLegend($('legend-button'), parts.legend, parts.keyNames, () => parts.inOtherUnit());
const painted = new MessageChannel();
painted.port1.onmessage = ({ data }) => data.forEach((seq) => link.send('drawn', { seq }));
const drawn = (window.echostep = { frames: 0, view, scene, link, last: null, missing, tr, ...parts.shown });  // read by tests

async function hello(message) {
  const { title, plan, replay } = message, isOther = page.plan && (page.plan.digest !== plan.digest || page.title !== title);
  if (isOther) startAnew();
  Object.assign(page, { title, plan, globe: plan.globe ? new Globe(plan.globe) : null, isReplay: replay, isLive: !replay && !message.takes_files });
  view.north = plan.north_rad;
  fault('');
  $('title').textContent = `${title.replace(/\((.*)\)$/, (_, how) => `(${how.split(', ').map(tr).join(', ')})`)}: ${plan.name}`;
  floors.plan(plan.levels);
  const begins = replay && $('replay').hidden;
  timeBar.show(replay);
  if (begins) {  // the time bar takes room: the floor is fitted into what is left
    view.resize($('map').clientWidth, $('map').clientHeight);
    page.isFitted = false;
  }
  if (page.isLive && !isAwake) stayAwake();
  isAwake ||= page.isLive;
  parts.hello(message);
  await showLevel(Math.min(parts.level ?? scene.level, plan.levels.length - 1));
  parts.shownAll?.();
}

// Another run on another plan answers at this address: what was chosen on the old plan means nothing on it.
function startAnew() {
  Object.assign(scene, { frame: null, level: 0 });
  page.isFitted = false;
  scene.measure.clear();
  timeBar.forget();
  parts.startAnew();
}

// Lines of a level; null while the server is away: when it is back, its hello shows the level again.
async function lines(level) {
  const answer = await fetch(new URL(`lines/${level}`, document.baseURI)).catch(() => null);
  if (answer && !answer.ok) fault(await answer.text());
  return answer?.ok ? answer.arrayBuffer() : null;
}

async function showLevel(level) {
  page.wantedLevel = level;
  const rows = await lines(level);
  if (!rows || level !== page.wantedLevel) return;
  scene.level = level;
  planView.show(rows, page.plan.levels[level]);
  if (!page.isFitted) {
    view.fit(planView.box);
    page.isFitted = true;
    parts.fitted?.();
  }
  showFloors();
  view.changed();
}

function showFloors() {
  if (page.plan) floors.show(parts.isStacked ? null : scene.level, (level) => parts.floorNote(level));
}

// What is left of the last frame while no other one comes.
function aged() {
  const { pulse } = link, isOld = pulse.isSilent && pulse.isLive(), isNew = isOld !== scene.isOld;
  scene.isOld = isOld;
  parts.aged(isNew);
  ask();
}

// Store a frame; it is drawn with the next animation frame. A hidden page draws nothing, so it reports no frame as drawn and gets no more of them, unless
// its role takes them in any case.
function frame(received) {
  scene.frame = received;
  if (received.marks) scene.marks = received.marks;
  parts.frame(received);
  timeBar.frame(received.play, received.ended, received.unix_s);
  aged();  // the frame may be older than the end of the connection
  if (document.hidden && parts.takesHidden) link.send('drawn', { seq: received.seq });
  else undrawn.push(received.seq);
}

// Draw with the next animation frame.
function ask() {
  if (!isAsked) requestAnimationFrame(draw);
  isAsked = true;
}

function draw() {
  try { parts.follow(); } finally { isAsked = false; }  // what moves the view here is drawn at once
  if (drawnStamp !== view.stamp) {
    planView.draw(view);
    showScale(view);
    $('needle').style.transform = `rotate(${-view.tilt}rad)`;
    drawnStamp = view.stamp;
  }
  parts.paint();
  Object.assign(drawn, { frames: drawn.frames + 1, last: scene.frame });
  if (undrawn.length) painted.port2.postMessage(undrawn);
  undrawn = [];
}

function status(name, words) {
  const text = said(words);
  Object.assign($('words').dataset, { status: name, long: text.length > VERY_LONG ? 'very' : String(text.length > LONG) });
  put($('mark'), MARKS[name]);
  put($('status-text'), text);
}

// A fault of the server or of this page, in words; empty: none.
function fault(text) { tell($('fault'), text); }

// `for_ms` 0: until the next one.
function hint(text, for_ms = HINT_MS) {
  clearTimeout(hintEnds);
  tell($('hint'), text);
  if (text && for_ms) hintEnds = setTimeout(() => hint(''), for_ms);
}

// Two places whose distance is shown.
function measured(position) {
  scene.measure.add(position, scene.level);
  hint(scene.measure.text ? `Distance: ${scene.measure.text}. Escape ends measuring.` : 'Tap the second place.');
  ask();
}

function key(name) {
  const actions = {
    l: () => showLegend(false), '?': () => showLegend(true), n: () => view.northUp(), w: () => $('whole').click(), ' ': () => !$('replay').hidden && $('play').click(), ...parts.keys,
    Escape: () => { scene.measure.clear(); parts.keys.Escape(); ask(); },
  }, action = actions[name.length === 1 ? name.toLowerCase() : name];
  action?.();
  return Boolean(action);
}

new Gestures($('map'), view, {
  takesPose: () => parts.takesPose?.() ?? false, posing: (...pose) => parts.posing?.(...pose), posed: (...pose) => parts.posed(...pose),
  tapped: (position, pixel) => parts.tapped(position, pixel), moved: () => parts.moved(), key,
});
$('closer').onclick = () => view.zoom(1.4);
$('farther').onclick = () => view.zoom(1 / 1.4);
$('whole').onclick = () => parts.fitWhole();
$('north').onclick = () => view.northUp();
window.addEventListener('error', ({ message }) => fault(`This page has a fault: ${message}. Reload it.`));
window.addEventListener('unhandledrejection', ({ reason }) => fault(`This page has a fault: ${reason?.message ?? reason}. Reload it.`));
view.onChanged = ask;
view.layOver(...['messages', 'floors', 'floor'].map($));
startTheme($('theme'), () => { parts.painter.recolour(); parts.recoloured?.(); view.changed(); });
view.resize($('map').clientWidth, $('map').clientHeight);
new ResizeObserver(([{ contentRect }]) => view.resize(contentRect.width, contentRect.height)).observe($('map'));
titled({ 'legend-button': 'L, ?', north: 'N', whole: 'W', closer: '+', farther: '−', ...parts.titles });
