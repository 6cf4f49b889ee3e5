// SPDX-License-Identifier: MIT
// The straight distance between two taps; a third tap begins anew.

import { tr } from '../language.js';
import { inUnits } from './units.js';

export class Measure {
  constructor() { Object.assign(this, { points: [], level: 0 }); }

  add(position, level) {
    if (this.points.length === 2 || level !== this.level) this.points = [];
    this.level = level;
    this.points.push(position);
  }

  clear() { this.points = []; }

  get text() {
    const [from, to] = this.points;
    return to ? inUnits(`${Math.hypot(to[0] - from[0], to[1] - from[1]).toFixed(2)} m`) : '';
  }

  paint(pen, view, level, colour) {
    if (level !== this.level || !this.points.length) return;
    const pixels = this.points.map((point) => view.toScreen(...point)), last = pixels.at(-1);
    for (const [stroke, width] of [[colour.halo, 6], [colour.goal, 2.5]]) {
      pen.beginPath();
      pixels.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      for (const [x, y] of pixels) { pen.moveTo(x + 5, y); pen.arc(x, y, 5, 0, 2 * Math.PI); }
      Object.assign(pen, { strokeStyle: stroke, lineWidth: width });
      pen.stroke();
    }
    Object.assign(pen, { font: '700 14px system-ui, sans-serif', textAlign: 'center', lineWidth: 4, strokeStyle: colour.halo, fillStyle: colour.ink });
    const [x, y] = [(pixels[0][0] + last[0]) / 2, (pixels[0][1] + last[1]) / 2 - 10];
    const text = tr(this.text);
    pen.strokeText(text, x, y);
    pen.fillText(text, x, y);
    pen.textAlign = 'left';
  }
}
