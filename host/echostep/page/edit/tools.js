// SPDX-License-Identifier: MIT
// The tools: what a press, a move and a click on the sheet do. In: positions in metres. Out: changes of the sheet. Owns the held element, the draft and the selection.

import { cutDoor, distance, ends, fillDoor, foot, hit, moveDoor, moveJoints, moveWall, onGrid, round, same, scaled, snap } from './geometry.js';

import { questionAt } from './questions.js';

const REACH_PX = 14;

export class Tools {
  // `desk`: ask(question, answer) -> promise of a text or null, say(text), changed(), doorWidth() in metres, asked(question), placed(position)
  constructor(sheet, view, desk) {
    Object.assign(this, { sheet, view, desk, name: 'select', pressed: null, held: null, live: null, chosen: null, draft: null, chain: null, points: [], cross: [0, 0] });
  }

  get reach() { return REACH_PX / this.view.scale; }
  get level() { return this.live?.level ?? this.sheet.level; }
  get picture() { return this.live?.picture ?? this.sheet.picture; }
  get drags() { return this.name === 'select' || this.name === 'origin'; }

  choose(name) {
    this.stop();
    this.name = name;
    this.chosen = null;
  }

  // End a chain of walls, release the held element.
  stop() { Object.assign(this, { pressed: null, held: null, live: null, draft: null, chain: null, points: [] }); }

  // A second finger moves the sheet: give up what this press began, but not a chain of walls from before.
  cancel() {
    if (!this.chain || this.pressed?.began) this.stop();
    else Object.assign(this, { pressed: null, held: null, live: null });
  }

  // Returns whether the press belongs to the tool; otherwise dragging moves the sheet.
  down(p) {
    this.cross = p;
    this.pressed = { at: p, began: false };
    if (this.name === 'origin' && this.sheet.picture) this.held = { from: p };
    const asked = this.name === 'select' && questionAt(this.level, p, this.reach);
    if (asked) this.desk.asked(asked);
    else if (this.name === 'select') {
      const found = hit(this.level, p, this.reach);
      this.chosen = found;
      if (found) this.held = { found, from: p };
    }
    this.desk.changed();
    return Boolean(this.held) || !this.drags;
  }

  move(p) {
    this.cross = p;
    const { held, sheet } = this;
    if (this.name === 'wall' && this.pressed && !this.chain) {  // a drag draws a wall from where it began
      this.wall(this.pressed.at);
      this.pressed.began = true;
    }
    if (held?.found) {
      const level = this.dragged(held.found, held.from, p);
      if (level) this.live = { level };
    } else if (held) this.live = { picture: { ...sheet.picture, x: sheet.picture.x + p[0] - held.from[0], y: sheet.picture.y + p[1] - held.from[1] } };
    else if (this.chain) this.draft = [...this.chain.at, ...this.snapped(p).at];
    else if (this.name === 'scale' && this.points.length) this.draft = [...this.points[0], ...p];
    this.desk.changed();
  }

  dragged({ kind, k, at }, from, p) {
    const base = this.sheet.level;
    if (kind === 'door') return moveDoor(base, k, p);
    if (kind === 'wall') return moveWall(base, k, [onGrid(p[0] - from[0]), onGrid(p[1] - from[1])]);
    if (kind === 'room') return { ...base, rooms: base.rooms.with(k, { ...base.rooms[k], at: [onGrid(p[0]), onGrid(p[1])] }) };
    const other = ends(base.walls[k]).find((e) => !same(e, at)), walls = base.walls.filter((w) => !ends(w).some((e) => same(e, at)));
    return moveJoints(base, [[at, snap(p, { walls, from: other, reach: this.reach }).at]]);
  }

  snapped(p) { return snap(p, { walls: this.sheet.level.walls, from: this.chain?.at, before: this.chain?.before, reach: this.reach }); }

  up(p, click) {
    const { live, held, pressed } = this;
    this.pressed = null;
    if (held && (live || this.drags)) {
      [this.held, this.live] = [null, null];
      if (live?.level) { this.sheet.setLevel(live.level); this.rechoose(); this.desk.say('Moved'); }
      if (live?.picture) { this.sheet.change(this.sheet.tree, live.picture); this.desk.say('Picture moved'); }
    } else if (!this.drags && (click || this.name === 'wall')) {
      this[this.name](p);
      if (pressed?.began) this.stop();
    } else if (!this.drags) this.desk.say('Nothing changed: click. Two fingers or the right button move the sheet');
    this.desk.changed();
  }

  rechoose() {
    if (this.chosen?.kind === 'door') this.chosen = { kind: 'door', k: this.sheet.level.doors.length - 1 };
    else if (this.chosen?.kind === 'end') this.chosen = { kind: 'wall', k: this.chosen.k };
  }

  wall(p) {
    const { at, kind } = this.snapped(p), { chain, sheet } = this;
    if (!chain) {
      this.chain = { at, first: at };
      this.points = [at];
    } else if (same(at, chain.at)) {
      this.stop();
      this.desk.say('Wall ended');
      return;
    } else {
      sheet.setLevel({ ...sheet.level, walls: [...sheet.level.walls, [...chain.at, ...at]] });
      this.desk.say(`Wall ${distance(chain.at, at).toFixed(2)} m, to ${kind}`);
      if (same(at, chain.first)) this.stop();
      else Object.assign(this, { chain: { at, before: chain.at, first: chain.first }, points: [at], draft: null });
      return;
    }
    this.desk.say(`Wall from x ${at[0].toFixed(2)}, y ${at[1].toFixed(2)} m, ${kind}`);
  }

  door(p) {
    const { sheet } = this, width = this.desk.doorWidth();
    const near = sheet.level.walls.map((w, k) => ({ k, ...foot(p, w) })).sort((a, b) => a.away - b.away)[0];
    if (!near || near.away > 1.5 * this.reach) { this.desk.say('No wall here: a door is cut into a wall'); return; }
    const cut = cutDoor(sheet.level, near.k, p, width);
    if (cut) sheet.setLevel(cut);
    this.desk.say(cut ? `Door ${width.toFixed(2)} m` : `This wall is shorter than ${width.toFixed(2)} m`);
  }

  place(p) { this.desk.placed(p); }

  erase(p) { this.remove(hit(this.sheet.level, p, this.reach)); }

  remove(found) {
    const { level } = this.sheet;
    if (!found) { this.desk.say('Nothing here'); return; }
    if (found.kind === 'door') this.sheet.setLevel(fillDoor(level, found.k).level);
    else if (found.kind === 'room') this.sheet.setLevel({ ...level, rooms: level.rooms.toSpliced(found.k, 1) });
    else this.sheet.setLevel({ ...level, walls: level.walls.toSpliced(found.k, 1) });
    this.chosen = null;
    this.desk.say(`Deleted a ${found.kind === 'end' ? 'wall' : found.kind}`);
  }

  async room(p) {
    const { level, k: levelIndex } = this.sheet, rooms = level.rooms ?? [], found = hit({ ...level, walls: [], doors: [] }, p, this.reach);
    const name = (await this.desk.ask('Name of the room', found ? rooms[found.k].name : ''))?.trim();
    if (!name || this.sheet.k !== levelIndex) return;
    const at = [onGrid(p[0]), onGrid(p[1])];
    this.sheet.setLevel({ ...level, rooms: found ? rooms.with(found.k, { ...rooms[found.k], name }) : [...rooms, { name, at }] });
    this.desk.say(`Room ${name}`);
    this.desk.changed();
  }

  async scale(p) {
    if (!this.sheet.picture) { this.desk.say('There is no picture to scale: start with --picture IMAGE'); return; }
    if (!this.points.length) { this.points = [p]; this.desk.say('Now the second point'); return; }
    const [a] = this.points, metres = Number((await this.desk.ask('Distance of the two points in metres', ''))?.replace(',', '.') ?? 0);
    this.stop();
    if (metres > 0 && metres < 1e5 && distance(a, p) > 0) {
      this.sheet.change(this.sheet.tree, { ...this.sheet.picture, ...scaled(this.sheet.picture, a, p, metres), set: true });
      this.desk.say(`Scale: ${round(this.sheet.picture.perPx)} m a pixel`);
    } else this.desk.say('Scale unchanged: the distance is a number of metres');
    this.desk.changed();
  }
}
