// SPDX-License-Identifier: MIT
// The verbs: what a press, a movement and a tap on the sheet do. In: positions in metres. Out: changes of the sheet. Owns the selection and what is being drawn.

import { elementAt, elementsOf, elementsWithin, without } from './elements.js';
import { cutDoor, distance, foot, length, onGrid, rectangle, round, same, snap } from './geometry.js';
import { tr } from '../static/language.js';
import { questionAt } from './questions.js';
import { WORDS } from './words.js';

const REACH_PX = 14;
const TWO_POINTS = ['wall', 'door', 'scale']; // verbs that take two points: by a drag, or by two taps
const NARROWEST_M = 0.3; // of a door

export class Tools {
  // `desk`: say(text), changed(), asked(question), placed(position)
  constructor(sheet, view, desk) {
    Object.assign(this, { sheet, view, desk, name: 'select', isLasso: false, adds: false, chosen: new Set(), pressed: null, area: null, chain: null, draft: null, cross: [0, 0] });
  }

  get reach() { return REACH_PX / this.view.scale; }
  get elements() { return elementsOf(this.sheet.tree, this.sheet.k); }
  get selected() { return this.elements.filter(({ of }) => this.chosen.has(of)); }

  choose(name) {
    this.stop();
    this.name = name;
    this.chosen = new Set();
  }

  // Give up what is being drawn.
  stop() { Object.assign(this, { pressed: null, area: null, chain: null, draft: null }); }

  // A second finger moves the sheet: give up what this press began, but not what earlier taps did.
  cancel() {
    if (this.area || this.chain?.dragged) this.stop();
    else this.pressed = null;
  }

  // `other`: the other kind of area, a lasso instead of a rectangle.
  down(p, other = false) {
    this.cross = p;
    this.pressed = p;
    if (this.name === 'select') this.area = { corners: [p], isLasso: this.isLasso !== other };
    this.desk.changed();
  }

  move(p) {
    this.cross = p;
    const { area, chain, pressed } = this;
    if (area) area.corners = area.isLasso ? [...area.corners, p] : rectangle(area.corners[0], p);
    else if (TWO_POINTS.includes(this.name)) {
      if (pressed && !chain) this.chain = { ...this.snapped(pressed), dragged: true };
      if (this.chain) this.draft = [...this.chain.at, ...this.snapped(p).at];
    }
    this.desk.changed();
  }

  // `adds`: what is selected stays so.
  up(p, isTap, adds = false) {
    const { area, chain } = this;
    [this.pressed, this.area] = [null, null];
    if (area) this.surround(isTap ? p : null, area.corners, this.adds || adds);
    else if (!TWO_POINTS.includes(this.name)) { if (isTap) this[this.name](p); }
    else if (chain) this[this.name](chain.at, this.snapped(p));
    else this.begin(this.snapped(p));
    this.desk.changed();
  }

  // Select what a tap at p hits, or without a tap what lies within the corners; the mark of a question shows its question.
  surround(p, corners, adds) {
    const question = p && questionAt(this.sheet.level, p, this.reach);
    if (question) { this.desk.asked(question); return; }
    const hit = p && elementAt(this.elements, p, this.reach)?.of;
    if (adds && this.chosen.has(hit)) this.chosen.delete(hit);
    else this.chosen = new Set([...(adds ? this.chosen : []), ...(hit ? [hit] : []), ...(p ? [] : elementsWithin(this.elements, corners).map(({ of }) => of))]);
    this.desk.say(this.chosen.size ? WORDS.selected(this.chosen.size) : WORDS.nothing);
  }

  remove() {
    const { sheet, chosen } = this, { length } = this.selected;
    if (!length) { this.desk.say(WORDS.noneSelected); return; }
    sheet.change(without(sheet.tree, sheet.k, chosen), WORDS.deleted(length));
    this.choose(this.name);
    this.desk.changed();
  }

  snapped(p) {
    const { chain, sheet, reach, name } = this, { walls } = sheet.level;
    if (name === 'scale') return { at: p };
    if (name === 'wall' && chain && !chain.dragged && distance(p, chain.at) <= reach) return { at: chain.at }; // the last corner again
    return snap(p, { walls, reach, ...(name === 'wall' && { from: chain?.at, before: chain?.before }) });
  }

  begin({ at, kind }) {
    this.chain = { at, first: at };
    this.desk.say(this.name === 'wall' ? WORDS.wallFrom(at, kind) : WORDS.second);
  }

  // A wall that is tapped goes on at its end; one that is dragged, or comes back to its begin, is ended.
  wall(from, { at, kind }) {
    const { chain, sheet } = this, { level } = sheet;
    this.stop();
    if (same(at, from)) { this.desk.say(WORDS.wallEnded); return; }
    sheet.setLevel({ ...level, walls: [...level.walls, [...from, ...at]] }, WORDS.wall(distance(from, at), kind));
    if (!chain.dragged && !same(at, chain.first)) this.chain = { at, before: from, first: chain.first };
  }

  // Cut into the wall that lies along it, or put into the gap that it closes.
  door(from, { at }) {
    const { sheet, reach } = this, { level } = sheet, middle = [(from[0] + at[0]) / 2, (from[1] + at[1]) / 2], width = distance(from, at);
    this.stop();
    if (width < NARROWEST_M) { this.desk.say(WORDS.narrow(NARROWEST_M)); return; }
    const near = level.walls.map((wall, k) => ({ k, away: Math.max(...[from, at].map((end) => foot(end, wall).away)) })).sort((a, b) => a.away - b.away)[0];
    const isGap = [from, at].every((end) => level.walls.some((wall) => same(foot(end, wall).at, end)));
    let made = null;
    if (near?.away < Math.min(reach, width / 2)) made = cutDoor(level, near.k, middle, onGrid(width));
    else if (isGap) made = { ...level, doors: [...(level.doors ?? []), { line: [...from, ...at], state: 'unknown' }] };
    if (made) sheet.setLevel(made, WORDS.door(length(made.doors.at(-1).line)));
    else this.desk.say(WORDS.noWall);
  }

  room(p) {
    const { level } = this.sheet, rooms = level.rooms ?? [], index = rooms.findIndex(({ at }) => distance(at, p) <= this.reach);
    const name = prompt(tr(WORDS.roomName), rooms[index]?.name ?? '')?.trim();
    if (!name) return;
    this.sheet.setLevel({ ...level, rooms: index < 0 ? [...rooms, { name, at: p.map(onGrid) }] : rooms.with(index, { ...rooms[index], name }) }, WORDS.room(name));
    this.desk.changed();
  }

  place(p) { this.desk.placed(p); }

  scale(from, { at }) {
    const { sheet, desk } = this;
    this.stop();
    if (!sheet.picture) { desk.say(WORDS.noPicture); return; }
    const [before, ...corner] = sheet.lies, metres = Number(prompt(tr(WORDS.distance))?.replace(',', '.') ?? 0), perPx = before * metres / distance(from, at);
    if (metres > 0 && metres < 1e5 && Number.isFinite(perPx)) sheet.change({ ...sheet.tree, picture: [perPx, ...corner] }, WORDS.scaled(round(perPx)));
    else desk.say(WORDS.noScale);
    desk.changed();
  }
}
