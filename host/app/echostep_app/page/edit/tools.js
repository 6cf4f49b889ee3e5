// SPDX-License-Identifier: MIT
// The tools: what a press, a move and a click on the sheet do. In: positions in metres. Out: changes of the sheet. Owns the held element, the draft and the selection.

import { asDoor, asWindow, cutDoor, distance, ends, fillDoor, foot, hit, moveDoor, moveJoints, moveWall, onGrid, round, same, scaled, snap } from './geometry.js';
import { earthClick } from './earth.js';
import { OUTLINES, endOutline, outlineClick, rectangle, startClick } from './outline.js';
import { questionAt } from './questions.js';
import { hitShape, isShape, kindOf, movedShape, outlineOf, removedShape, sameShape, sides } from './shapes.js';
import { WORDS } from './words.js';

const REACH_PX = 14;
const BY_DRAG = ['wall', 'start', ...OUTLINES]; // tools that draw by a drag too

export class Tools {
  // `desk`: ask(question, answer, refusal) -> promise of a text or null, askConnector(kind, fields), say(text), changed(), doorWidth() in metres, asked(question), placed(position)
  constructor(sheet, view, desk) {
    Object.assign(this, { sheet, view, desk, name: 'select', pressed: null, held: null, live: null, chosen: null, draft: null, box: null, chain: null, points: [], known: [], cross: [0, 0] });
  }

  get reach() { return REACH_PX / this.view.scale; }
  get tree() { return this.live?.tree ?? this.sheet.tree; }
  get level() { return this.live?.level ?? this.tree.levels[this.sheet.k]; }
  get picture() { return this.live?.picture ?? this.sheet.picture; }
  get drags() { return this.name === 'select' || this.name === 'origin'; }

  // Returns what is given up thereby, in words.
  choose(name) {
    const given = this.chain && this.name !== 'wall' ? `${WORDS.givenUp(this.name)}. ` : '';
    this.stop();
    this.name = name;
    this.chosen = null;
    return given;
  }

  // End what is drawn: an outline is closed where it has enough corners.
  end() {
    if (this.chain?.corners && !this.chain.box) endOutline(this);
    else { this.stop(); this.desk.say(WORDS.ended); }
    this.desk.changed();
  }

  // End a chain of walls, release the held element.
  stop() { Object.assign(this, { pressed: null, held: null, live: null, draft: null, box: null, chain: null, points: [], known: [] }); }

  // A second finger moves the sheet: give up what this press began, but not what earlier ones did.
  cancel() {
    if (this.pressed?.began) this.stop();
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
      const found = this.find(p);
      this.chosen = found;
      if (found) this.held = { found, from: p };
    }
    this.desk.changed();
    return Boolean(this.held) || !this.drags;
  }

  // The element at p. A corner of the chosen outline has precedence, then walls, doors and names, then outlines.
  find(p) {
    const { sheet, reach, chosen } = this, shape = hitShape(sheet.tree, sheet.k, p, reach);
    return (shape?.kind === 'start' || (shape?.kind === 'corner' && sameShape(shape.of, chosen?.of ?? chosen)) ? shape : hit(sheet.level, p, reach)) ?? shape?.of ?? shape;
  }

  move(p) {
    this.cross = p;
    const { held, sheet } = this;
    if (this.pressed && !this.chain && BY_DRAG.includes(this.name)) this.begin(this.pressed);
    if (held?.found) {
      const { found, from } = held, moved = this.dragged(found, [onGrid(p[0] - from[0]), onGrid(p[1] - from[1])]);
      if (moved) this.live = moved;
    } else if (held) this.live = { picture: { ...sheet.picture, x: sheet.picture.x + p[0] - held.from[0], y: sheet.picture.y + p[1] - held.from[1] } };
    else if (this.chain?.box) this.box = rectangle(this.chain.at, this.snapped(p).at);
    else if (this.chain) this.draft = [...this.chain.at, ...this.snapped(p).at];
    else if (this.name === 'earth' && this.points.length) this.draft = [...this.points[0], ...this.snapped(p).at];
    else if (this.name === 'scale' && this.points.length) this.draft = [...this.points[0], ...p];
    this.desk.changed();
  }

  // A drag draws a wall, a rectangle or the start from where it began.
  begin(pressed) {
    pressed.began = true;
    if (OUTLINES.includes(this.name)) { const { at } = this.snapped(pressed.at); this.chain = { at, corners: [at], box: true }; } else this[this.name](pressed.at);
  }

  // The level or the plan with an element moved by a vector; `exact`: neither attracted by corners nor by the grid. Null where it cannot be.
  dragged(found, by, exact = false) {
    const { sheet } = this, base = sheet.level, { kind, k } = found, add = ([x, y]) => [round(x + by[0]), round(y + by[1])];
    if (isShape(found)) { const tree = movedShape(sheet.tree, sheet.k, found, by); return tree && { tree, by }; }
    if (kind === 'room') { const at = add(base.rooms[k].at); return { level: { ...base, rooms: base.rooms.with(k, { ...base.rooms[k], at }) }, by }; }
    if (kind === 'wall') return { level: moveWall(base, k, by), by };
    if (kind === 'door' || kind === 'window') {
      const here = kind === 'door' ? base : asDoor(base, k), at = kind === 'door' ? k : here.doors.length - 1;
      const centre = ({ line: [x0, y0, x1, y1] }) => [(x0 + x1) / 2, (y0 + y1) / 2], from = centre(here.doors[at]), level = moveDoor(here, at, add(from), exact);
      return level && { level: kind === 'door' ? level : asWindow(level), by: apart(from, centre(level.doors.at(-1))) };
    }
    const other = ends(base.walls[k]).find((e) => !same(e, found.at)), walls = base.walls.filter((w) => !ends(w).some((e) => same(e, found.at)));
    const to = exact ? add(found.at) : snap(add(found.at), { walls, from: other, reach: this.reach }).at;
    return { level: moveJoints(base, [[found.at, to]]), by: apart(found.at, to) };
  }

  // What is drawn attracts as walls do: so an outline can be closed.
  snapped(p) {
    const { chain, sheet, reach } = this, drawn = chain?.corners ? sides(chain.corners).slice(0, -1) : [];
    return snap(p, { walls: [...sheet.level.walls, ...drawn], from: chain?.box ? null : chain?.at, before: chain?.before, reach });
  }

  up(p, click) {
    const { live, held, pressed } = this;
    this.pressed = null;
    if (held && (live || this.drags)) {
      [this.held, this.live] = [null, null];
      if (live?.picture) this.sheet.change(this.sheet.tree, WORDS.pictureMoved([live.picture.x - this.sheet.picture.x, live.picture.y - this.sheet.picture.y]), live.picture);
      else if (live) this.take(live);
    } else if (!this.drags && (click || BY_DRAG.includes(this.name))) {
      this[this.name](p);
      if (pressed?.began) this.stop();
    } else if (!this.drags) this.desk.say(WORDS.unchanged);
    this.desk.changed();
  }

  // Make a movement of the chosen element a change of the sheet.
  take({ level, tree, by }) {
    if (!by[0] && !by[1]) return;
    const words = WORDS.moved(kindOf(this.sheet.tree, this.chosen), by);
    if (level) this.sheet.setLevel(level, words);
    else this.sheet.change(tree, words);
    this.rechoose();
  }

  rechoose() {
    const { kind } = this.chosen ?? {};
    if (kind === 'door' || kind === 'window') this.chosen = { kind, k: this.sheet.level[`${kind}s`].length - 1 };
    else if (this.chosen?.kind === 'end') this.chosen = { kind: 'wall', k: this.chosen.k };
  }

  wall(p) {
    const { at, kind } = this.snapped(p);
    if (!this.chain) {
      Object.assign(this, { chain: { at, first: at }, points: [at] });
      this.desk.say(WORDS.wallFrom(at, kind));
    } else if (same(at, this.chain.at)) {
      this.stop();
      this.desk.say(WORDS.wallEnded);
    } else this.wallTo(at, kind);
  }

  wallTo(at, kind) {
    const { chain, sheet } = this;
    sheet.setLevel({ ...sheet.level, walls: [...sheet.level.walls, [...chain.at, ...at]] }, WORDS.wall(chain.at, at, kind));
    if (same(at, chain.first)) this.stop();
    else Object.assign(this, { chain: { at, before: chain.at, first: chain.first }, points: [at], draft: null });
  }

  obstacle(p) { outlineClick(this, p); }
  stairs(p) { outlineClick(this, p); }
  lift(p) { outlineClick(this, p); }
  ramp(p) { outlineClick(this, p); }
  start(p) { startClick(this, p); }
  earth(p) { earthClick(this, p); }

  window(p) { this.door(p, WORDS.window, asWindow); }

  door(p, words = WORDS.door, made = (level) => level) {
    const { sheet } = this, width = this.desk.doorWidth();
    const near = sheet.level.walls.map((w, k) => ({ k, ...foot(p, w) })).sort((a, b) => a.away - b.away)[0];
    if (!near || near.away > 1.5 * this.reach) { this.desk.say(WORDS.noWall); return; }
    const cut = cutDoor(sheet.level, near.k, p, width);
    if (cut) sheet.setLevel(made(cut), words(width));
    else this.desk.say(WORDS.short(width));
  }

  place(p) { this.desk.placed(p); }

  erase(p) { this.remove(this.find(p)); }

  remove(found) {
    const { sheet } = this, { level } = sheet;
    if (!found) { this.desk.say(WORDS.nothing); return; }
    const words = WORDS.deleted(found.kind === 'end' ? 'wall' : kindOf(sheet.tree, found.of ?? found));
    if (isShape(found)) sheet.change(removedShape(sheet.tree, sheet.k, found), words);
    else if (found.kind === 'door') sheet.setLevel(fillDoor(level, found.k).level, words);
    else if (found.kind === 'window') sheet.setLevel(fillDoor(asDoor(level, found.k), (level.doors ?? []).length).level, words);
    else if (found.kind === 'room') sheet.setLevel({ ...level, rooms: level.rooms.toSpliced(found.k, 1) }, words);
    else sheet.setLevel({ ...level, walls: level.walls.toSpliced(found.k, 1) }, words);
    this.chosen = null;
  }

  async room(p) {
    const { level, k: levelIndex } = this.sheet, rooms = level.rooms ?? [], found = hit({ ...level, walls: [], doors: [] }, p, this.reach);
    const name = (await this.desk.ask(WORDS.roomName, found ? rooms[found.k].name : ''))?.trim();
    if (!name || this.sheet.k !== levelIndex) return;
    const at = [onGrid(p[0]), onGrid(p[1])];
    this.sheet.setLevel({ ...level, rooms: found ? rooms.with(found.k, { ...rooms[found.k], name }) : [...rooms, { name, at }] }, WORDS.room(name));
    this.desk.changed();
  }

  async scale(p) {
    const { sheet, desk } = this;
    if (!sheet.picture) { desk.say(WORDS.noPicture); return; }
    if (!this.points.length) { this.points = [p]; desk.say(WORDS.second); return; }
    const [a] = this.points, metres = Number((await desk.ask(WORDS.distance, ''))?.replace(',', '.') ?? 0);
    this.stop();
    if (metres > 0 && metres < 1e5 && distance(a, p) > 0) {
      const picture = { ...sheet.picture, ...scaled(sheet.picture, a, p, metres), set: true };
      sheet.change(sheet.tree, WORDS.scaled(round(picture.perPx)), picture);
    } else desk.say(WORDS.noScale);
    desk.changed();
  }
}

const apart = (from, to) => [to[0] - from[0], to[1] - from[1]];
