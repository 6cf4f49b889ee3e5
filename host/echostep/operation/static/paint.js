// SPDX-License-Identifier: MIT
// Paints the wearers on a canvas: a sign by state, an arrow along the heading, the circle of the protection radius (dashed) or of the 95 % radius (dotted), the name.

import { paintMarks } from '../static/marks.js';

const COLOURS = ['trail', 'here', 'halo', 'bad', 'fair', 'good', 'ink', 'faint', 'goal', 'expected'];
const OF_STATE = { mayday: 'bad', lost: 'bad', stale: 'bad', uncertain: 'fair', waiting: 'faint', tracking: 'good', ended: 'faint' };
const WIDEST_M = 60;  // radius that is still drawn
const SIGN_PX = 8;
const FONT = '600 13px system-ui, sans-serif';

export class Painter {
  constructor(canvas) {
    Object.assign(this, { canvas, pen: canvas.getContext('2d'), widths: new Map() });
    this.recolour();
  }

  recolour() {
    const style = getComputedStyle(document.documentElement);
    this.colour = Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  // `wearers`: rows of the list with their `place`, the most urgent first.
  paint(view, wearers, chosen, marks, level) {
    const sharp = window.devicePixelRatio || 1, { canvas, pen } = this, width = Math.round(view.width * sharp), height = Math.round(view.height * sharp);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.clearRect(0, 0, view.width, view.height);
    pen.lineJoin = pen.lineCap = 'round';
    paintMarks(pen, view, marks, level, this.colour);
    const shown = wearers.map((wearer) => ({ ...wearer, at: view.toScreen(wearer.place.x, wearer.place.y) }))
      .filter(({ at: [sx, sy] }) => sx > -200 && sy > -200 && sx < view.width + 200 && sy < view.height + 200);
    for (const wearer of [...shown].reverse()) this.wearer(view, wearer, wearer.id === chosen);
    this.names(shown, chosen);
  }

  wearer(view, { state, place, at: [sx, sy] }, isChosen) {
    const { pen } = this, colour = this.colour[OF_STATE[state] ?? 'faint'], safe = Number.isFinite(place.protection), radius = safe ? place.protection : place.radius;
    if (radius < WIDEST_M && radius * view.scale > SIGN_PX) this.circle(sx, sy, radius * view.scale, colour, 1.5, safe ? [6, 5] : [2, 5]);
    if (state === 'mayday') for (const more of [12, 17]) this.circle(sx, sy, SIGN_PX + more, colour, 2.5, []);
    if (isChosen) this.circle(sx, sy, SIGN_PX + 9, this.colour.ink, 2.5, []);
    if (Number.isFinite(place.heading)) this.arrow(sx, sy, -place.heading - view.turn, colour);
    this.sign(state, sx, sy, colour);
  }

  circle(sx, sy, radius, colour, width, dash) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(sx, sy, radius, 0, 2 * Math.PI);
    pen.setLineDash(dash);
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
    pen.setLineDash([]);
  }

  arrow(sx, sy, angle, colour) {
    const { pen } = this, tip = SIGN_PX + 9;
    pen.beginPath();
    for (const [turn, far] of [[0, tip], [0.62, SIGN_PX], [-0.62, SIGN_PX]]) pen.lineTo(sx + far * Math.cos(angle + turn), sy + far * Math.sin(angle + turn));
    pen.closePath();
    pen.fillStyle = colour;
    pen.strokeStyle = this.colour.halo;
    pen.lineWidth = 2;
    pen.stroke();
    pen.fill();
  }

  // Triangle: mayday. Filled: tracking. Half: uncertain. Cross: lost. Hollow: silent. Square: ended.
  sign(state, sx, sy, colour) {
    const { pen } = this;
    pen.beginPath();
    if (state === 'ended') pen.rect(sx - 6, sy - 6, 12, 12);
    else if (state === 'mayday') for (const [x, y] of [[0, -14], [13, 9], [-13, 9], [0, -14]]) pen.lineTo(sx + x, sy + y);
    else pen.arc(sx, sy, SIGN_PX, 0, 2 * Math.PI);
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
    if (state === 'uncertain') { pen.arc(sx, sy, SIGN_PX, -Math.PI / 2, Math.PI / 2); pen.fill(); }
    if (state === 'lost') for (const s of [-1, 1]) { pen.moveTo(sx - 4, sy - 4 * s); pen.lineTo(sx + 4, sy + 4 * s); pen.stroke(); }
  }

  // Names that do not cover each other, the most urgent first; the chosen one always.
  names(shown, chosen) {
    const { pen } = this, taken = [];
    pen.font = FONT;
    pen.textBaseline = 'middle';
    const first = shown.filter(({ id }) => id === chosen);
    for (const { id, name, state, at: [sx, sy] } of [...first, ...shown.filter((wearer) => wearer.id !== chosen)]) {
      if (!this.widths.has(name)) this.widths.set(name, pen.measureText(name).width);
      const width = this.widths.get(name), left = sx + SIGN_PX + 11, box = [left, sy - 9, left + width, sy + 9];
      if (id !== chosen && taken.some(([x0, y0, x1, y1]) => box[0] < x1 && box[2] > x0 && box[1] < y1 && box[3] > y0)) continue;
      taken.push(box);
      pen.lineWidth = 4;
      pen.strokeStyle = this.colour.halo;
      pen.strokeText(name, left, sy);
      pen.fillStyle = ['mayday', 'lost', 'stale'].includes(state) ? this.colour.bad : this.colour.ink;
      pen.fillText(name, left, sy);
    }
  }
}
