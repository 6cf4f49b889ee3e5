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

  paint(painter, view, level) {
    if (level !== this.level || !this.points.length) return;
    const { colour } = painter, pixels = this.points.map((point) => view.toScreen(...point)), last = pixels.at(-1);
    for (const [stroke, width] of [[colour.halo, 6], [colour.goal, 2.5]]) {
      painter.line(pixels, stroke, width);
      for (const at of pixels) painter.circle(at, 5, stroke, width);
    }
    painter.text(tr(this.text), (pixels[0][0] + last[0]) / 2, (pixels[0][1] + last[1]) / 2 - 10, colour.ink, { size: 14, align: 'center', weight: 700, halo: 4 });
  }
}
