// SPDX-License-Identifier: MIT
// The layers of a wearer's map: particles, trail, beacons, echo lines, position with its ellipse, heading, route, a pose that is being entered.

import { tr } from '../language.js';
import { paintMarks } from '../marks.js';
import { Painter } from '../paint.js';
import { paintDrawing } from './drawing.js';

const GRADES = 4;  // shades of the particles' weight
const PARTICLE_PX = 2.5;
const WIDEST_M = 30;  // protection radius that is still drawn
const SD_95 = 2.45;  // half axis of a 95 % circle, in standard deviations per axis

export class WearerPainter extends Painter {
  // `scene.layers` says what is drawn.
  paint(view, scene) {
    const shows = (layer) => scene.layers.shows(layer);
    this.begin(view);
    if (scene.drawing) paintDrawing(this.pen, view, scene.drawing, this.colour);
    if (scene.cloud && shows('cloud')) this.particles(view, scene.cloud, scene.level);
    if (shows('trail')) this.trail(view, scene.trail, scene.level, scene.drawing?.trail_count ?? 0);
    if (shows('marks')) paintMarks(this, view, scene.marks, scene.level);
    const { told: estimate, guidance, goal } = scene.frame ?? {}, path = guidance && estimate?.placed && estimate.level === scene.level ? guidance.path : [];
    if (path.length > 1) this.line(path.map(([x, y]) => view.toScreen(x, y)), this.colour.goal, 3, [8, 7]);
    if (goal?.level === scene.level) this.flag(view, [goal.x_m, goal.y_m]);
    else if (path.length && (goal === 'exit' || !guidance.own)) this.flag(view, path.at(-1));
    if (shows('beacons')) this.beacons(view, (scene.frame?.beacons ?? []).filter((beacon) => beacon.level === scene.level));
    if (estimate?.placed && estimate.level === scene.level) {  // without a place nothing is drawn that looks like one
      if (!scene.isOld) {  // of then only the place
        if (shows('echoes')) for (const line of scene.frame.beams) this.echoLine(view, line);
        this.protection(view, estimate);
        this.ellipse(view, estimate);
      }
      this.wearer(view, estimate);
    }
    for (const place of estimate?.hypotheses ?? []) if (place.level === scene.level) this.hypothesis(view, place);
    const truth = scene.frame?.truth;
    if (truth && truth.level === scene.level) this.truth(view, truth);
    if (scene.tapped) this.pose(view, scene.tapped);
    scene.measure.paint(this, view, scene.level);
  }

  // The true position of a simulation: a diamond with its name.
  truth(view, { x_m, y_m }) {
    const [sx, sy] = view.toScreen(x_m, y_m), diamond = [[sx, sy - 9], [sx + 9, sy], [sx, sy + 9], [sx - 9, sy], [sx, sy - 9]];
    this.line(diamond, this.colour.halo, 5);
    this.line(diamond, this.colour.good, 2.5);
    this.text(tr('truth'), sx + 12, sy - 8, this.colour.good);
  }

  particles(view, { count, x0_m, y0_m, step_m, x, y, weight, level }, shownLevel) {
    const [a, b, c, d, e, f] = view.matrix(), { pen } = this, half = PARTICLE_PX / 2;
    pen.fillStyle = this.colour.cloud;
    const e0 = a * x0_m + c * y0_m + e - half, f0 = b * x0_m + d * y0_m + f - half;
    const [as, bs, cs, ds] = [a * step_m, b * step_m, c * step_m, d * step_m];
    for (let grade = 0; grade < GRADES; grade++) {
      pen.globalAlpha = 0.12 + (0.5 * grade) / (GRADES - 1);
      for (let k = 0; k < count; k++) {
        if (weight[k] >> 6 !== grade || level[k] !== shownLevel) continue;
        const sx = as * x[k] + cs * y[k] + e0, sy = bs * x[k] + ds * y[k] + f0;
        if (sx > -4 && sy > -4 && sx < view.width && sy < view.height) pen.fillRect(sx, sy, PARTICLE_PX, PARTICLE_PX);
      }
    }
    pen.globalAlpha = 1;
  }

  // From the point `first` on: the path before it is in the drawing. A point with NaN coordinates breaks the line: there was a check-in.
  trail(view, { points, count }, shownLevel, first) {
    const [a, b, c, d, e, f] = view.matrix(), { pen } = this;
    pen.beginPath();
    let drawing = false;
    for (let k = 3 * Math.max(first - 1, 0); k < 3 * count; k += 3) {
      const x = points[k], y = points[k + 1], visible = points[k + 2] === shownLevel && !Number.isNaN(x);
      if (visible) pen[drawing ? 'lineTo' : 'moveTo'](a * x + c * y + e, b * x + d * y + f);
      drawing = visible;
    }
    this.stroke(this.colour.trail, 2);
  }

  // Measured range: a line with a bar across its end. Range expected from the plan: a dotted line with a ring at its end.
  echoLine(view, { ranger, x_m, y_m, axis_rad, measured_m, expected_m }) {
    const pixelAt = (range_m) => view.toScreen(x_m + range_m * Math.cos(axis_rad), y_m + range_m * Math.sin(axis_rad));
    const colour = ranger ? this.colour.right : this.colour.left, from = pixelAt(0);
    if (expected_m !== null) {
      const end = pixelAt(expected_m);
      this.line([from, end], this.colour.expected, 1.5, [2, 5]);
      this.circle(end, 6, this.colour.expected, 1.5);
    }
    if (measured_m === null) return this.line([from, pixelAt(0.6)], colour, 2.5, [1, 6]);
    const end = pixelAt(measured_m), ux = end[0] - from[0], uy = end[1] - from[1];
    const length = Math.hypot(ux, uy) || 1, bx = (-uy / length) * 7, by = (ux / length) * 7;
    this.line([from, end], colour, 2.5);
    this.line([[end[0] - bx, end[1] - by], [end[0] + bx, end[1] + by]], colour, 3.5);
  }

  // Beacons that are heard are drawn on top; a number that would cover another is left out.
  beacons(view, shown) {
    const taken = [], order = [...shown].sort((a, b) => a.heard - b.heard);
    for (const beacon of order) this.beacon(view, beacon);
    for (const { number, x_m, y_m, state, by } of order.reverse()) {
      const [sx, sy] = view.toScreen(x_m, y_m);
      if (taken.some(([tx, ty]) => Math.abs(tx - sx) < 18 && Math.abs(ty - sy) < 14)) continue;
      taken.push([sx, sy]);
      this.text(by ? `${number} ${by}` : number, sx, sy + 18, state === 'well' ? this.colour.beacon : this.colour.bad, { align: 'center' });
    }
  }

  // A triangle in the circle of its spread; on its tip: placed by a teammate. Filled: well; with waves while it is heard. Hollow: moved (with a dotted
  // tail) or silent (crossed out).
  beacon(view, { x_m, y_m, radius95_m, state, heard, by }) {
    const { pen } = this, tip = by ? -1 : 1, [sx, sy] = view.toScreen(x_m, y_m), colour = state === 'well' ? this.colour.beacon : this.colour.bad;
    if (radius95_m * view.scale > 9) {  // a smaller circle is covered by the triangle
      this.ring([sx, sy], radius95_m * view.scale);
      this.tint(colour, 1.5, [2, 4], 0.12);
    }
    this.path([[sx, sy - 7 * tip], [sx + 6.5, sy + 4 * tip], [sx - 6.5, sy + 4 * tip]]);
    pen.closePath();
    this.stroke(this.colour.halo, 4);
    pen.fillStyle = colour;
    if (state === 'well') pen.fill();
    this.stroke(colour, 2);
    if (state === 'silent') this.line([[sx - 8, sy + 8], [sx + 8, sy - 9]], colour, 2);
    if (state === 'moved') this.line([[sx - 20, sy + 5], [sx - 11, sy + 5]], colour, 2, [2, 4]);
    for (const side of heard ? [0, Math.PI] : []) {
      pen.beginPath();
      pen.arc(sx, sy - 1, 12, side - 0.6, side + 0.6);
      this.stroke(colour, 2);
    }
  }

  ellipse(view, { x_m, y_m, major_m, minor_m, angle_rad }) {
    const { pen } = this, [sx, sy] = view.toScreen(x_m, y_m);
    pen.beginPath();
    pen.ellipse(sx, sy, Math.max(major_m * view.scale, 1), Math.max(minor_m * view.scale, 1), -(angle_rad + view.turn), 0, 2 * Math.PI);
    this.tint(this.colour.here, 2);
  }

  // The circle beyond which the error is with a probability of 1 in 1,000.
  protection(view, { x_m, y_m, protection_m }) {
    if (protection_m !== null && protection_m <= WIDEST_M) this.circle(view.toScreen(x_m, y_m), protection_m * view.scale, this.colour.here, 1.5, [6, 6]);
  }

  // A place that fits: a ring with its number, and its probability.
  hypothesis(view, { number, x_m, y_m, probability }) {
    const [sx, sy] = view.toScreen(x_m, y_m);
    this.circle([sx, sy], 11, this.colour.halo, 5);
    this.circle([sx, sy], 11, this.colour.here, 2.5);
    this.text(`${Math.round(100 * probability)} %`, sx + 15, sy + 5, this.colour.ink, { size: 13 });
    this.text(number, sx, sy + 5, this.colour.ink, { size: 13, align: 'center' });
  }

  // An arrow along the heading; a circle when the heading is not known.
  wearer(view, { x_m, y_m, heading_rad, heading_known }) {
    const { pen } = this;
    pen.save();
    pen.translate(...view.toScreen(x_m, y_m));
    pen.rotate(-(heading_rad + view.turn));
    if (heading_known) this.path([[13, 0], [-9, 8], [-4, 0], [-9, -8]]);
    else this.ring([0, 0], 8);
    pen.closePath();
    this.sign(this.colour.here, 0, true);
    pen.restore();
  }

  flag(view, position) {
    const { pen } = this, [sx, sy] = view.toScreen(...position);
    pen.beginPath();
    pen.arc(sx, sy - 16, 8, Math.PI * 0.85, Math.PI * 0.15);
    pen.lineTo(sx, sy);
    pen.closePath();
    pen.fillStyle = this.colour.goal;
    pen.fill();
  }

  // The ghost of a position that is being entered: in the circle that would hold it; a broken arrow is a heading that would stay.
  pose(view, { x_m, y_m, heading_rad, kept_rad = null, sd_m = 0 }) {
    const at = view.toScreen(x_m, y_m);
    this.ring(at, Math.max(SD_95 * sd_m * view.scale, 9));
    this.tint(this.colour.goal, 3);
    if (heading_rad === null && kept_rad === null) return;
    this.heading(at, heading_rad ?? kept_rad, view, heading_rad === null ? [3, 7] : []);
  }

  heading([sx, sy], heading_rad, view, dash) {
    const u = heading_rad + view.turn, tip = [sx + 44 * Math.cos(u), sy - 44 * Math.sin(u)];
    const wing = (w) => [tip[0] - 14 * Math.cos(u + w), tip[1] + 14 * Math.sin(u + w)];
    this.line([[sx, sy], tip], this.colour.goal, 3, dash);
    this.line([wing(0.5), tip, wing(-0.5)], this.colour.goal, 3);
  }
}
