// SPDX-License-Identifier: MIT
// All storeys over each other, the lowest one below, seen obliquely, with the wearers on each. A tap chooses a wearer, or leads to a storey.

import { boxOf, linesOf } from '../plan.js';
import { View } from '../view.js';

const FLAT = 0.4, DEEP = 0.8;  // of a storey's depth is seen: at least, and where there is room
const MARGIN_PX = 24, GAP_PX = 20, FONT = '600 12px system-ui, sans-serif';

// One storey around a point of the screen.
class Storey extends View {
  matrix() {
    const [a, b, c, d, e, f] = super.matrix(), [sx, sy] = this.middle;
    return [a, this.flat * b, c, this.flat * d, e - this.width / 2 + sx, this.flat * (f - this.height / 2) + sy];
  }
}

export class Storeys {
  constructor() { this.clear(); }

  clear() { Object.assign(this, { on: false, floors: [], shown: [], stamp: '' }); }

  // `lines(level)`: of the server, or null.
  async open(levels, lines) {
    const answers = await Promise.all(levels.map((_, level) => lines(level)));
    if (answers.includes(null)) return;
    const rows = answers.map(linesOf), boxes = rows.map((one) => boxOf(one, []));
    this.box = [0, 1, 2, 3].map((side) => Math[side < 2 ? 'min' : 'max'](...boxes.map((box) => box[side])));
    this.floors = levels.map(({ name, height_m }, level) => ({ name, height_m, level, path: pathOf(rows[level]) })).sort((a, b) => a.height_m - b.height_m);
    Object.assign(this, { on: true, stamp: '', shown: [] });
  }

  // The storeys in the free part of the map.
  arrange({ free: [l, t, r, b], turn, width, height }) {
    const [x0, y0, x1, y1] = this.box, c = Math.abs(Math.cos(turn)), s = Math.abs(Math.sin(turn)), [w, h] = [Math.max(x1 - x0, 1), Math.max(y1 - y0, 1)], band = (b - t) / this.floors.length;
    const scale = Math.max(Math.min((r - l - 2 * MARGIN_PX) / (c * w + s * h), (band - GAP_PX) / FLAT / (s * w + c * h)), 0.1), deep = scale * (s * w + c * h), flat = Math.min(Math.max((band - GAP_PX) / deep, FLAT), DEEP);
    this.floors.forEach((floor, k) => {
      floor.view = Object.assign(new Storey(), { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale, turn, width, height, flat, middle: [(l + r) / 2, b - band * (k + 0.5)] });
      floor.edge = [l + 4, Math.min(b - band * k - 4, floor.view.middle[1] + flat * deep / 2 + GAP_PX - 4)];
    });
  }

  // `rows`: of all wearers with a place, the most urgent first.
  paint(painter, view, rows, chosen) {
    const { pen, colour } = painter, stamp = [view.free, view.turn, view.width, view.height].join();
    if (stamp !== this.stamp) this.arrange(view);
    this.stamp = stamp;
    painter.begin(view);
    for (const { name, path, view: storey, edge } of this.floors) {
      const seen = new Path2D();
      seen.addPath(path, new DOMMatrix(storey.matrix()));
      Object.assign(pen, { strokeStyle: colour.faint, lineWidth: 1, font: FONT, textAlign: 'left', textBaseline: 'alphabetic', fillStyle: colour.ink });
      pen.stroke(seen);
      pen.fillText(name, ...edge);
    }
    const storeys = new Map(this.floors.map((floor) => [floor.level, floor.view]));
    const shown = rows.map(({ place, ...row }) => ({ ...row, place: { ...place, heading: NaN, radius: NaN, protection: NaN }, at: storeys.get(place.level).toScreen(place.x, place.y) }));
    this.shown = painter.wearers(view, shown, chosen);
  }

  // The wearer nearest to a pixel, within `reach`, and the storey there.
  at([sx, sy], reach) {
    const far = ({ at: [x, y] }) => Math.hypot(x - sx, y - sy), near = this.shown.filter((row) => far(row) < reach).sort((a, b) => far(a) - far(b))[0];
    return { id: near?.id, level: this.floors.findLast(({ edge }) => sy < edge[1] + 4)?.level ?? this.floors[0].level };
  }
}

function pathOf(lines) {
  const path = new Path2D();
  for (const rows of Object.values(lines)) for (let k = 0; k < rows.length; k += 4) { path.moveTo(rows[k], rows[k + 1]); path.lineTo(rows[k + 2], rows[k + 3]); }
  return path;
}
