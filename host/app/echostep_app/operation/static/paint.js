// SPDX-License-Identifier: MIT
// Paints the wearers on a canvas: a sign by state, an arrow along the heading, the circle of the protection radius (dashed) or of the 95 % radius (dotted), the name.

import { paintMarks } from '../static/marks.js';
import { Sprites } from './sprites.js';
import { trace } from './trails.js';

const COLOURS = ['trail', 'here', 'halo', 'bad', 'fair', 'good', 'ink', 'faint', 'goal', 'expected'];
const OF_STATE = { mayday: 'bad', asked: 'bad', lost: 'bad', stale: 'bad', uncertain: 'fair', waiting: 'faint', tracking: 'good', ended: 'faint' };
const URGENT = ['mayday', 'asked', 'lost', 'stale'];
const WIDEST_M = 60;  // radius that is still drawn
const WIDEST_SPRITE_PX = 80;  // radius of a circle that is kept as a picture
const SIGN_PX = 8, ARROW_PX = SIGN_PX + 9, MAYDAY_PX = SIGN_PX + 19;
const HEADINGS = 72;  // directions in which an arrow is drawn
const FONT = '600 13px system-ui, sans-serif';
const MOST_WIDTHS = 1024;  // names whose width is kept

export class Painter {
  constructor(canvas) {
    Object.assign(this, { canvas, pen: canvas.getContext('2d'), widths: new Map(), isLeft: new Set(), sprites: new Sprites() });
    this.recolour();
  }

  recolour() {
    const style = getComputedStyle(document.documentElement);
    this.colour = Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
    this.sprites.clear();
  }

  // `wearers`: rows of the list with their `place`, the most urgent first; `trail`: points of the chosen one.
  paint(view, wearers, chosen, trail, marks, level) {
    this.begin(view);
    this.trail(view, trail, level);
    paintMarks(this.pen, view, marks, level, this.colour);
    this.wearers(view, wearers.map((wearer) => ({ ...wearer, at: view.toScreen(wearer.place.x, wearer.place.y) })), chosen);
  }

  begin(view) {
    const sharp = window.devicePixelRatio || 1, { canvas, pen } = this, width = Math.round(view.width * sharp), height = Math.round(view.height * sharp);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.clearRect(0, 0, view.width, view.height);
    pen.lineJoin = pen.lineCap = 'round';
    pen.imageSmoothingEnabled = false;
  }

  // `at`: their pixels.
  wearers(view, wearers, chosen) {
    const shown = wearers.filter(({ at: [sx, sy] }) => sx > -200 && sy > -200 && sx < view.width + 200 && sy < view.height + 200);
    for (const wearer of [...shown].reverse()) this.wearer(view, wearer, wearer.id === chosen);
    this.names(view, shown, chosen);
  }

  trail(view, points, level) {
    const { pen } = this;
    pen.beginPath();
    trace(pen, points, level, (x, y) => view.toScreen(x, y));
    [pen.strokeStyle, pen.lineWidth] = [this.colour.trail, 3];
    pen.stroke();
  }

  wearer(view, { state, place, at: [sx, sy] }, isChosen) {
    const { pen } = this, name = OF_STATE[state] ?? 'faint', safe = Number.isFinite(place.protection), radius = safe ? place.protection : place.radius;
    if (state !== 'ended' && radius < WIDEST_M && radius * view.scale > SIGN_PX) this.around(sx, sy, Math.round(radius * view.scale), name, safe);
    if (state === 'mayday') for (const more of [12, 17]) circle(pen, sx, sy, SIGN_PX + more, this.colour.bad, 2.5);
    if (isChosen) circle(pen, sx, sy, SIGN_PX + 9, this.colour.ink, 2.5);
    const heading = Number.isFinite(place.heading) ? Math.round((-place.heading - view.turn) / (2 * Math.PI) * HEADINGS) : null;
    this.sprites.draw(pen, `sign ${state} ${heading === null ? '' : (heading % HEADINGS + HEADINGS) % HEADINGS}`, sx, sy, [ARROW_PX + 3, ARROW_PX + 3], (onto) => {
      if (heading !== null) this.arrow(onto, 2 * Math.PI * heading / HEADINGS, this.colour[name]);
      this.sign(onto, state, this.colour[name]);
    });
  }

  // The circle of a radius: dashed when it is a protection radius, else dotted.
  around(sx, sy, radius, name, safe) {
    const paint = (onto, x, y) => circle(onto, x, y, radius, this.colour[name], 1.5, safe ? [6, 5] : [2, 5]);
    if (radius > WIDEST_SPRITE_PX) paint(this.pen, sx, sy);
    else this.sprites.draw(this.pen, `circle ${name} ${safe} ${radius}`, sx, sy, [radius + 2, radius + 2], (onto) => paint(onto, 0, 0));
  }

  arrow(pen, angle, colour) {
    pen.beginPath();
    for (const [turn, far] of [[0, ARROW_PX], [0.62, SIGN_PX], [-0.62, SIGN_PX]]) pen.lineTo(far * Math.cos(angle + turn), far * Math.sin(angle + turn));
    pen.closePath();
    [pen.fillStyle, pen.strokeStyle, pen.lineWidth] = [colour, this.colour.halo, 2];
    pen.stroke();
    pen.fill();
  }

  // Triangle: mayday; hollow: asked after a fall. Filled: tracking. Half: uncertain. Cross: lost. Hollow: silent. Square: ended.
  sign(pen, state, colour) {
    pen.beginPath();
    if (state === 'ended') pen.rect(-6, -6, 12, 12);
    else if (['mayday', 'asked'].includes(state)) for (const [x, y] of [[0, -14], [13, 9], [-13, 9], [0, -14]]) pen.lineTo(x, y);
    else pen.arc(0, 0, SIGN_PX, 0, 2 * Math.PI);
    pen.fillStyle = ['tracking', 'mayday'].includes(state) ? colour : this.colour.halo;
    pen.strokeStyle = this.colour.halo;
    pen.lineWidth = 5;
    pen.stroke();
    pen.fill();
    pen.strokeStyle = colour;
    pen.lineWidth = 2.5;
    pen.stroke();
    pen.fillStyle = colour;
    pen.beginPath();
    if (state === 'uncertain') { pen.arc(0, 0, SIGN_PX, -Math.PI / 2, Math.PI / 2); pen.fill(); }
    if (state === 'lost') for (const s of [-1, 1]) { pen.moveTo(-4, -4 * s); pen.lineTo(4, 4 * s); pen.stroke(); }
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
      this.sprites.draw(this.pen, `name ${colour} ${name}`, (box[0] + box[2]) / 2, sy, [width / 2 + 3, 12], (pen) => {
        Object.assign(pen, { font: FONT, textBaseline: 'middle', textAlign: 'center', lineWidth: 4, strokeStyle: this.colour.halo, fillStyle: colour });
        pen.strokeText(name, 0, 0);
        pen.fillText(name, 0, 0);
      });
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

// Whether two boxes [left, top, right, bottom, wearer] of different wearers cover each other.
const cover = (a, b) => a[0] < b[2] && a[2] > b[0] && a[1] < b[3] && a[3] > b[1] && a[4] !== b[4];

function circle(pen, sx, sy, radius, colour, width, dash = []) {
  pen.beginPath();
  pen.arc(sx, sy, radius, 0, 2 * Math.PI);
  pen.setLineDash(dash);
  [pen.strokeStyle, pen.lineWidth] = [colour, width];
  pen.stroke();
  pen.setLineDash([]);
}
