// SPDX-License-Identifier: MIT
// Trails of the last minutes, on a canvas of their own that is painted anew when the view has changed, and at most once a second otherwise.

import { TRAIL } from './wire.js';

const KEPT_S = 180;  // a point that is older is dropped
const AGAIN_MS = 1000;
const FAR_M = 15;  // a longer gap between two points is not drawn: the wearer was lost in between

export class Trails {
  constructor(canvas) {
    Object.assign(this, { canvas, pen: canvas.getContext('2d'), of: new Map(), painted: -Infinity, stamp: -1, now_s: 0 });
  }

  clear() { this.of.clear(); this.painted = -Infinity; }

  // `now_s`: time of the frame, which is not that of the clock while the past is shown
  add(rows, now_s) {
    this.now_s = now_s;
    for (let k = 0; k < rows.length; k += TRAIL) {
      const [id, x, y, level, age] = rows.subarray(k, k + TRAIL);
      if (!this.of.has(id)) this.of.set(id, []);
      this.of.get(id).push({ x, y, level, at: now_s - age });
    }
  }

  paint(view, level, colour, chosen) {
    const now = performance.now(), stamp = `${view.stamp} ${level} ${chosen} ${colour.trail}`;
    if (stamp === this.stamp && now - this.painted < AGAIN_MS) return;
    Object.assign(this, { stamp, painted: now });
    const sharp = window.devicePixelRatio || 1, { canvas, pen } = this, width = Math.round(view.width * sharp), height = Math.round(view.height * sharp);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.clearRect(0, 0, view.width, view.height);
    pen.lineJoin = 'round';
    for (const [id, points] of this.of) {
      while (points.length && points[0].at < this.now_s - KEPT_S) points.shift();
      if (points.length) this.line(view, points, level, colour.trail, id === chosen);
      else this.of.delete(id);
    }
  }

  line(view, points, level, colour, bold) {
    const { pen } = this;
    let last = null;
    pen.beginPath();
    for (const point of points) {
      const seen = point.level === level, joined = last && Math.hypot(point.x - last.x, point.y - last.y) < FAR_M;
      if (seen) pen[joined ? 'lineTo' : 'moveTo'](...view.toScreen(point.x, point.y));
      last = seen ? point : null;
    }
    pen.globalAlpha = bold ? 1 : 0.55;
    pen.strokeStyle = colour;
    pen.lineWidth = bold ? 3 : 1.5;
    pen.stroke();
    pen.globalAlpha = 1;
  }
}
