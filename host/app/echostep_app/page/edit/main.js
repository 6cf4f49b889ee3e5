// SPDX-License-Identifier: MIT
// The plan editor: loads the plan and the picture, connects sheet, tools, view and buttons, saves. A *level* is an index into the plan's levels.

import { Asking } from './asking.js';
import { elementsOf } from './elements.js';
import { box } from './geometry.js';
import { paint } from './paint.js';
import { localise, missing, tr } from '../static/language.js';
import { Pointer } from './pointer.js';
import { Sheet } from './sheet.js';
import { startTheme } from '../static/theme.js';
import { showScale } from '../static/tools/units.js';
import { Tools } from './tools.js';
import { View } from '../static/view.js';
import { HINTS, WORDS } from './words.js';

const byId = (id) => document.getElementById(id);
const KEYS = { v: 'select', w: 'wall', d: 'door', n: 'room', s: 'scale' };
const STEPS_M = [0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 25, 50, 100, 250], STEP_PX = 14; // of an arrow key: the first that is so long
const view = new View(), map = byId('map');
let sheet, tools, asking, stamp, waiting = false, checked = {};

// The plan's own names stay as they are: its title and its list of levels.
const say = (text) => { byId('status').textContent = tr(text); };
const wrong = (text) => { byId('wrong').textContent = tr(String(text)); };

function changed() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(draw);
}

function draw() {
  waiting = false;
  asking.paint();
  showScale(view);
  paint(tools, view, asking.current);
  const pressed = { rectangle: !tools.isLasso, lasso: tools.isLasso, add: tools.adds };
  for (const [id, is] of Object.entries(pressed)) byId(id).setAttribute('aria-pressed', String(is));
  for (const button of document.querySelectorAll('[data-tool]')) button.setAttribute('aria-pressed', String(button.dataset.tool === tools.name));
  byId('delete').disabled = !tools.chosen.size;
  byId('step-back').disabled = !sheet.past.length;
  byId('step-forth').disabled = !sheet.future.length;
  byId('save').toggleAttribute('data-unsaved', sheet.unsaved);
  byId('title').textContent = sheet.unsaved ? `${sheet.tree.name} ${tr(WORDS.unsaved)}` : sheet.tree.name;
  const names = sheet.tree.levels.map((level) => level.name), options = byId('level');
  if (names.join('\n') !== [...options.options].map((o) => o.text).join('\n')) options.replaceChildren(...names.map((name, k) => new Option(name, k)));
  options.value = sheet.k;
  options.hidden = names.length < 2;
}

function show() {
  const { picture } = sheet, rows = elementsOf(sheet.tree, sheet.k).flatMap((element) => element.rows), [perPx, x, y] = picture ? sheet.lies : [];
  view.fit(box(picture ? [...rows, [x, y, x + picture.width * perPx, y + picture.height * perPx]] : rows));
  changed();
}

function goLevel(level) {
  if (level < 0 || level >= sheet.tree.levels.length) return;
  tools.choose(tools.name);
  sheet.k = level;
  say(WORDS.level(sheet.level.name, sheet.level.height_m));
  changed();
}

async function save(over = false) {
  const { tree } = sheet;
  try {
    const headers = { 'content-type': 'application/json', ...(over ? {} : { 'if-match': stamp }) };
    const answer = await fetch('plan', { method: 'POST', headers, body: JSON.stringify(tree), signal: AbortSignal.timeout(30000) });
    const reply = await answer.json().catch(() => ({}));
    if (answer.status === 409 && confirm(tr(WORDS.writeOver(reply.error)))) { await save(true); return; }
    if (!answer.ok) { wrong(WORDS.notSaved(reply.error ?? answer.status)); return; }
    stamp = answer.headers.get('etag');
    sheet.saved = tree;
    wrong('');
    say(WORDS.saved(reply.saved));
  } catch { wrong(WORDS.noAnswer); }
  changed();
}

// What `echostep plan check` finds in the plan as it is drawn, one with each call.
async function check() {
  const { tree } = sheet;
  if (checked.tree !== tree) {
    const answer = await fetch('check', { method: 'POST', body: JSON.stringify(tree), signal: AbortSignal.timeout(30000) }).catch(() => null), reply = await answer?.json().catch(() => null);
    if (!answer?.ok) { wrong(reply?.error ?? WORDS.silent); return; }
    checked = { tree, k: -1, found: reply.found };
  }
  wrong('');
  const { found } = checked, finding = found[checked.k = (checked.k + 1) % found.length];
  if (!finding) { say(WORDS.nothingWrong); return; }
  tools.choose(tools.name);
  sheet.k = finding.level;
  [tools.cross, view.scale] = [finding.at, Math.max(view.scale, 30)];
  view.centre(...finding.at);
  say(WORDS.finding(checked.k + 1, found.length, finding.text));
  changed();
}

function turn(way) {
  tools.choose(tools.name);
  sheet[way]();
  changed();
}

function step(e, [dx, dy]) {
  const by = e.shiftKey ? 0.05 : STEPS_M.find((m) => m * view.scale >= STEP_PX) ?? STEPS_M.at(-1), [x, y] = tools.cross;
  tools.move([Math.round((x + dx * by) / 0.05) * 0.05, Math.round((y + dy * by) / 0.05) * 0.05]);
  view.keep(...tools.cross);
  if (!tools.draft && !tools.area) say(WORDS.cross(tools.cross));
}

// A tap at the cross.
function enter(e) {
  tools.down(tools.cross);
  tools.up(tools.cross, true, e.shiftKey);
}

// Begins and ends a rectangle or lasso at the cross.
function surround(e) {
  if (tools.name !== 'select') enter(e);
  else if (tools.area) tools.up(tools.cross, false, e.shiftKey);
  else tools.down(tools.cross);
}

// Which kind of area the next drag draws.
function surroundBy(isLasso) {
  if (tools.name !== 'select') pick('select');
  tools.isLasso = isLasso;
  changed();
}

function escape() {
  tools.choose(tools.name);
  say(WORDS.ended);
}

function key(e) {
  const ctrl = e.ctrlKey || e.metaKey, name = e.key.length === 1 ? e.key.toLowerCase() : e.key;
  if (e.key === '?') { byId('keys').classList.toggle('unseen'); return; }
  const always = ctrl && { s: save, z: () => turn(e.shiftKey ? 'redo' : 'undo'), y: () => turn('redo') }[name];
  if (always) { e.preventDefault(); always(); return; }
  if (ctrl || e.altKey || document.activeElement !== map) return;
  const done = {
    ArrowLeft: () => step(e, [-1, 0]), ArrowRight: () => step(e, [1, 0]), ArrowUp: () => step(e, [0, 1]), ArrowDown: () => step(e, [0, -1]),
    Enter: () => enter(e), ' ': () => surround(e), Escape: escape, Delete: () => tools.remove(), Backspace: () => tools.remove(), l: () => surroundBy(!tools.isLasso),
    '+': () => view.zoom(1.25), '=': () => view.zoom(1.25), '-': () => view.zoom(0.8), 0: show, a: () => asking.accept(), m: () => asking.place(), r: () => asking.reject(), q: () => asking.next(), c: check, PageUp: () => goLevel(sheet.k + 1), PageDown: () => goLevel(sheet.k - 1),
  }[name] ?? (KEYS[name] && (() => pick(KEYS[name])));
  if (!done) return;
  e.preventDefault();
  done();
  changed();
}

function pick(name) {
  tools.choose(name);
  say(name === 'scale' && !sheet.picture ? WORDS.noPicture : HINTS[name]);
  changed();
}

async function loadPicture() {
  const answer = await fetch('picture');
  if (answer.status !== 200) return;
  const image = new Image();
  image.src = URL.createObjectURL(await answer.blob());
  try { await image.decode(); } catch { wrong(WORDS.noShow); return; }
  const [width, height] = [image.naturalWidth || 1000, image.naturalHeight || 1000];
  byId('image').setAttribute('href', image.src);
  byId('image').setAttribute('width', width);
  byId('image').setAttribute('height', height);
  sheet.picture = { width, height };
}

async function start() {
  localise(document.body);
  const answer = await fetch('plan'), tree = await answer.json();
  if (!answer.ok) { wrong(tree.error); return; }
  stamp = answer.headers.get('etag');
  sheet = new Sheet(tree, say);
  await loadPicture();
  tools = new Tools(sheet, view, { say, changed, asked: (question) => asking.show(question, false), placed: (p) => asking.placed(p) });
  asking = new Asking(sheet, view, tools, { say, changed });
  new Pointer(map, view, { down: (p, e) => tools.down(p, e.altKey || e.ctrlKey), move: (p) => tools.move(p), up: (p, isTap, e) => tools.up(p, isTap, e.shiftKey), cancel: () => { tools.cancel(); changed(); }, moved: changed });
  new ResizeObserver(() => { view.resize(map.clientWidth, map.clientHeight); changed(); }).observe(map);
  view.resize(map.clientWidth, map.clientHeight);
  show();
  tools.cross = [view.x, view.y];
  document.addEventListener('keydown', key);
  for (const button of document.querySelectorAll('[data-tool]')) button.onclick = () => pick(button.dataset.tool);
  const clicks = {
    rectangle: () => surroundBy(false), lasso: () => surroundBy(true), add: () => { tools.adds = !tools.adds; changed(); }, delete: () => tools.remove(),
    'step-back': () => turn('undo'), 'step-forth': () => turn('redo'), whole: show, save: () => save(), check,
    closer: () => { view.zoom(1.25); changed(); }, farther: () => { view.zoom(0.8); changed(); },
  };
  for (const [id, done] of Object.entries(clicks)) byId(id).onclick = done;
  byId('level').onchange = () => goLevel(Number(byId('level').value));
  startTheme(byId('look'), changed);
  addEventListener('beforeunload', (e) => { if (sheet.unsaved) e.preventDefault(); });
  const asked = asking.open.length && WORDS.questions(asking.open.length);
  say(sheet.picture && !tree.picture ? WORDS.scaleFirst : asked || HINTS.select);
  window.echostep = { view, sheet, tools, asking, missing, tr };
}

start().catch((error) => wrong(WORDS.noStart(error.message)));
