// SPDX-License-Identifier: MIT
// Wearers on the map: a sign by state, an arrow along the heading, the circle of the protection radius (dashed) or of the 95 % radius (dotted), the name.

import { paintMarks } from '../marks.js';
import { Painter } from '../paint.js';
import { URGENT } from './list.js';
import { Sprites } from './sprites.js';
import { trace } from './trails.js';

const OF_STATE = { mayday: 'bad', asked: 'bad', lost: 'bad', stale: 'bad', uncertain: 'fair', waiting: 'faint', tracking: 'good', ended: 'faint' };
const WIDEST_M = 60;  // radius that is still drawn
const WIDEST_SPRITE_PX = 80;  // radius of a circle that is kept as a picture
const SIGN_PX = 8, ARROW_PX = SIGN_PX + 9, MAYDAY_PX = SIGN_PX + 19, FAN_PX = 4 * SIGN_PX, FAN = 6;  // signs around one
const HEADINGS = 72;  // directions in which an arrow is drawn
const FONT = '600 13px system-ui, sans-serif';
const MOST_WIDTHS = 1024;  // names whose width is kept

export class TeamPainter extends Painter {
  constructor(canvas) {
    super(canvas);
    Object.assign(this, { widths: new Map(), isLeft: new Set(), sprites: new Sprites() });
  }

  recolour() {
    super.recolour();
    this.sprites?.clear();
  }

  // `wearers`: rows of the list with their `place`, the most urgent first; `trail`: points of the chosen one.
  paint(view, wearers, trail, { chosen, marks, level, measure }) {
    this.begin(view);
    this.pen.beginPath();
    trace(this.pen, trail, level, (x, y) => view.toScreen(x, y));
    this.stroke(this.colour.trail, 3);
    paintMarks(this, view, marks, level);
    this.wearers(view, wearers.map((wearer) => ({ ...wearer, at: view.toScreen(wearer.place.x, wearer.place.y) })), chosen);
    measure.paint(this, view, level);
  }

  begin(view) {
    super.begin(view);
    this.pen.imageSmoothingEnabled = false;
  }

  // A picture that is painted once, around the origin by `paint(painter)`, and then copied.
  sprite(key, sx, sy, half, paint) {
    this.sprites.draw(this.pen, key, sx, sy, half, (pen) => paint(Object.assign(Object.create(this), { pen })));
  }

  // `at`: their pixels. Returns those that are shown with the pixels of their signs: on one spot they are fanned out.
  wearers(view, wearers, chosen) {
    const shown = fanned(wearers.filter(({ at: [sx, sy] }) => sx > -200 && sy > -200 && sx < view.width + 200 && sy < view.height + 200));
    for (const wearer of [...shown].reverse()) this.wearer(view, wearer, wearer.id === chosen);
    this.names(view, shown, chosen);
    return this.shown = shown;
  }

  wearer(view, { state, place, spot, at: [sx, sy] }, isChosen) {
    const name = OF_STATE[state] ?? 'faint', colour = this.colour[name], safe = Number.isFinite(place.protection), radius = safe ? place.protection : place.radius;
    if (state !== 'ended' && radius < WIDEST_M && radius * view.scale > SIGN_PX) this.around(...spot, Math.round(radius * view.scale), name, safe);
    if (state === 'mayday') for (const more of [12, 17]) this.circle([sx, sy], SIGN_PX + more, this.colour.bad, 2.5);
    if (isChosen) this.circle([sx, sy], SIGN_PX + 9, this.colour.ink, 2.5);
    const heading = Number.isFinite(place.heading) ? Math.round((-place.heading - view.turn) / (2 * Math.PI) * HEADINGS) : null;
    this.sprite(`sign ${state} ${heading === null ? '' : (heading % HEADINGS + HEADINGS) % HEADINGS}`, sx, sy, [ARROW_PX + 3, ARROW_PX + 3], (onto) => {
      if (heading !== null) onto.arrow(2 * Math.PI * heading / HEADINGS, colour);
      onto.badge(state, colour);
    });
  }

  // The circle of a radius: dashed when it is a protection radius, else dotted.
  around(sx, sy, radius, name, safe) {
    const paint = (onto, x, y) => onto.circle([x, y], radius, this.colour[name], 1.5, safe ? [6, 5] : [2, 5]);
    if (radius > WIDEST_SPRITE_PX) paint(this, sx, sy);
    else this.sprite(`circle ${name} ${safe} ${radius}`, sx, sy, [radius + 2, radius + 2], (onto) => paint(onto, 0, 0));
  }

  arrow(angle, colour) {
    this.path([[0, ARROW_PX], [0.62, SIGN_PX], [-0.62, SIGN_PX]].map(([turn, far]) => [far * Math.cos(angle + turn), far * Math.sin(angle + turn)]));
    this.pen.closePath();
    this.sign(colour, 0, true, 2);
  }

  // Triangle: mayday; hollow: asked after a fall. Filled: tracking. Half: uncertain. Cross: lost. Hollow: silent. Square: ended.
  badge(state, colour) {
    const { pen } = this;
    if (state === 'ended') this.path([[-6, -6], [6, -6], [6, 6], [-6, 6]]);
    else if (['mayday', 'asked'].includes(state)) this.path([[0, -14], [13, 9], [-13, 9]]);
    else this.ring([0, 0], SIGN_PX);
    pen.closePath();
    this.sign(colour, 2.5, ['tracking', 'mayday'].includes(state), 5);
    if (state === 'lost') for (const s of [-1, 1]) this.line([[-4, -4 * s], [4, 4 * s]], colour, 2.5);
    if (state !== 'uncertain') return;
    pen.beginPath();
    pen.arc(0, 0, SIGN_PX, -Math.PI / 2, Math.PI / 2);
    pen.fillStyle = colour;
    pen.fill();
  }

  // Names beside their signs, right or left, the most urgent first; none covers another name or a mayday's sign, but for the chosen one; other signs
  // are covered, and the map's edge cuts a name, only where both sides are taken.
  names(view, shown, chosen) {
    const isWhole = ([left, , right]) => left >= 0 && right <= view.width;
    const around = ({ id, at: [sx, sy] }, half) => [sx - half, sy - half, sx + half, sy + half, id], signs = shown.map((wearer) => around(wearer, SIGN_PX));
    const taken = shown.filter(({ state }) => state === 'mayday').map((wearer) => around(wearer, MAYDAY_PX)), first = shown.filter(({ id }) => id === chosen);
    for (const { id, name, state, at: [sx, sy] } of [...first, ...shown.filter((wearer) => wearer.id !== chosen)]) {
      const width = this.width(name), far = (state === 'mayday' ? MAYDAY_PX : SIGN_PX + 8) + 3;
      const sides = [sx + far, sx - far - width], boxes = (this.isLeft.has(id) ? sides.reverse() : sides).map((left) => [left, sy - 9, left + width, sy + 9, id]), free = boxes.filter((box) => !taken.some((other) => cover(box, other)));
      const box = free.find((one) => isWhole(one) && !signs.some((other) => cover(one, other))) ?? free.find(isWhole) ?? free[0] ?? (id === chosen ? boxes[0] : null);
      if (!box) continue;
      this.isLeft[box[0] < sx ? 'add' : 'delete'](id);  // it stays on its side while that is free
      taken.push(box);
      const colour = this.colour[URGENT.includes(state) ? 'bad' : 'ink'];
      this.sprite(`name ${colour} ${name}`, (box[0] + box[2]) / 2, sy, [width / 2 + 3, 12], (onto) => onto.text(name, 0, 0, colour, { size: 13, align: 'center', base: 'middle', halo: 4 }));
    }
  }

  width(name) {
    if (this.widths.size > MOST_WIDTHS) this.widths.clear();
    if (this.isLeft.size > MOST_WIDTHS) this.isLeft.clear();
    this.pen.font = FONT;
    if (!this.widths.has(name)) this.widths.set(name, this.pen.measureText(name).width);
    return this.widths.get(name);
  }
}

// Each sign beside those before it whose spot is less than a sign away, around that spot.
function fanned(wearers) {
  const spots = [];
  return wearers.map((wearer) => {
    const [sx, sy] = wearer.at, spot = spots.find(([x, y]) => Math.hypot(x - sx, y - sy) < SIGN_PX) ?? spots[spots.push([sx, sy, 0]) - 1], k = spot[2]++, far = FAN_PX * Math.ceil(k / FAN), turn = 2 * Math.PI * k / FAN;
    return { ...wearer, spot: wearer.at, at: [spot[0] + far * Math.cos(turn), spot[1] - far * Math.sin(turn)] };
  });
}

// Whether two boxes [left, top, right, bottom, wearer] of different wearers cover each other.
const cover = (a, b) => a[0] < b[2] && a[2] > b[0] && a[1] < b[3] && a[3] > b[1] && a[4] !== b[4];
