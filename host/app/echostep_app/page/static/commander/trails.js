// SPDX-License-Identifier: MIT
// Trails of the last minutes on two canvases: one is shown, gets the new points, and moves with the view; the other one is painted anew for the newest
// view, a slice with each frame, and then takes its place. So no frame takes long, however many points there are.

import { TRAIL } from './wire.js';

const KEPT_S = 180;  // a point that is older is dropped
const AGAIN_MS = 5000;  // between two paintings of one view: trails end at most this much late; assumed
const SLICE = 1500;  // points painted with a frame: about 2 ms
const FAR_M = 15;  // a longer gap between two points is not drawn: the wearer was lost in between
const WIDTH_PX = 1.5;

export class Trails {
  constructor(...canvases) {
    this.sheets = canvases.map((canvas) => ({ canvas, pen: canvas.getContext('2d'), matrix: null, stamp: '' }));
    Object.assign(this, { of: new Map(), now_s: 0, level: null, colour: '', stamp: '', painted: -Infinity, left: null });
  }

  clear() {
    this.of.clear();
    this.level = null;  // all is painted anew, at once
  }

  // `now_s`: time of the frame, which is not the clock's in a recorded operation
  add(rows, now_s) {
    this.now_s = now_s;
    const grown = new Map();  // by wearer, the number of points that were there already
    for (let k = 0; k < rows.length; k += TRAIL) {
      const id = rows[k];
      if (!this.of.has(id)) this.of.set(id, []);
      const points = this.of.get(id);
      if (!grown.has(id)) grown.set(id, points.length);
      points.push({ x: rows[k + 1], y: rows[k + 2], level: rows[k + 3], at: now_s - rows[k + 4] });
    }
    if (grown.size) for (const sheet of this.sheets) if (sheet.matrix) this.stroke(sheet, [...grown].map(([id, from]) => this.of.get(id).slice(Math.max(from - 1, 0))));
  }

  paint(view, level, colour) {
    const stamp = `${view.stamp} ${window.devicePixelRatio}`, isOther = level !== this.level || colour !== this.colour;
    if (isOther) Object.assign(this, { level, colour, left: null });
    if (!this.left && (isOther || stamp !== this.stamp || performance.now() - this.painted > AGAIN_MS)) this.begin(view, stamp);
    if (this.left) this.go(isOther ? Infinity : SLICE);
    const [shown] = this.sheets;
    shown.canvas.style.transform = shown.stamp === stamp ? '' : `${new DOMMatrix(view.matrix()).multiply(new DOMMatrix(shown.matrix).inverse())}`;
  }

  // Whether another frame is needed until all is painted for the newest view.
  get isBehind() { return this.left !== null; }

  // Begin to paint the hidden sheet anew for a view.
  begin(view, stamp) {
    const sheet = this.sheets[1], { canvas, pen } = sheet, sharp = window.devicePixelRatio || 1;
    [canvas.width, canvas.height] = [Math.round(view.width * sharp), Math.round(view.height * sharp)];  // this clears it
    Object.assign(canvas.style, { width: `${view.width}px`, height: `${view.height}px` });
    Object.assign(sheet, { matrix: view.matrix(), stamp });
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    pen.transform(...sheet.matrix);
    Object.assign(pen, { lineJoin: 'round', strokeStyle: this.colour, lineWidth: WIDTH_PX / view.scale });
    Object.assign(this, { stamp, painted: performance.now(), left: [...this.of.keys()] });
  }

  // Paint about so many points more; when all are painted the sheets change places.
  go(count) {
    const lines = [];
    for (let n = 0; n < count && this.left.length;) {
      const id = this.left.pop(), points = this.of.get(id) ?? [], old = points.findIndex(({ at }) => at >= this.now_s - KEPT_S);
      points.splice(0, old < 0 ? points.length : old);
      if (!points.length) this.of.delete(id);
      n += points.length;
      lines.push(points);
    }
    this.stroke(this.sheets[1], lines);
    if (this.left.length) return;
    this.left = null;
    this.sheets.reverse();
    this.sheets.forEach(({ canvas }, k) => { canvas.style.visibility = k ? 'hidden' : 'visible'; });
  }

  // One stroke through the points of some wearers that are on this level.
  stroke({ pen }, lines) {
    pen.beginPath();
    for (const points of lines) trace(pen, points, this.level, (x, y) => [x, y]);
    pen.stroke();
  }

  // The points of one wearer.
  points(id) { return this.of.get(id) ?? []; }
}

// Add a line through the points on a level to a path; `at` gives the place of a point on the canvas.
export function trace(pen, points, level, at) {
  let last = null;
  for (const point of points) {
    const seen = point.level === level, joined = last && Math.hypot(point.x - last.x, point.y - last.y) < FAR_M;
    if (seen) pen[joined ? 'lineTo' : 'moveTo'](...at(point.x, point.y));
    last = seen ? point : null;
  }
}
