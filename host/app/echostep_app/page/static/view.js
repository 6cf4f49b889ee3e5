// SPDX-License-Identifier: MIT
// The view: the part of the map on the screen. Converts map metres (x east, y north) to CSS pixels and back.

export class View {
  constructor() {
    Object.assign(this, { x: 0, y: 0, scale: 20, turn: 0, north: Math.PI / 2, width: 1, height: 1, stamp: 0, onChanged: () => {} });
  }

  changed() {
    this.stamp++;
    this.onChanged();
  }

  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
    this.changed();
  }

  // Map metres to CSS pixels as [a b c d e f], the form of SVG and canvas.
  matrix() {
    const c = this.scale * Math.cos(this.turn), s = this.scale * Math.sin(this.turn);
    return [c, -s, -s, -c, this.width / 2 - c * this.x + s * this.y, this.height / 2 + s * this.x + c * this.y];
  }

  toScreen(x, y) {
    const [a, b, c, d, e, f] = this.matrix();
    return [a * x + c * y + e, b * x + d * y + f];
  }

  toMap(sx, sy) {
    const u = (sx - this.width / 2) / this.scale, v = (this.height / 2 - sy) / this.scale;
    const c = Math.cos(this.turn), s = Math.sin(this.turn);
    return [this.x + c * u + s * v, this.y - s * u + c * v];
  }

  // Change scale and turn, and move so that the map's point at the pixel `from` is then at the pixel `to`.
  grip(from, to, factor = 1, turned = 0) {
    const [mx, my] = this.toMap(...from);
    this.scale = Math.min(Math.max(this.scale * factor, 0.02), 2000);
    this.turn = Math.atan2(Math.sin(this.turn + turned), Math.cos(this.turn + turned));
    const [nx, ny] = this.toMap(...to);
    this.x += mx - nx;
    this.y += my - ny;
    this.changed();
  }

  zoom(factor) {
    const middle = [this.width / 2, this.height / 2];
    this.grip(middle, middle, factor);
  }

  rotate(by) {
    const middle = [this.width / 2, this.height / 2];
    this.grip(middle, middle, 1, by);
  }

  // How far north is from up, in radians counter-clockwise on the screen; `north` is its direction on the map.
  get tilt() { return this.north + this.turn - Math.PI / 2; }

  northUp() { this.rotate(-this.tilt); }

  pan(dx, dy) { this.grip([0, 0], [dx, dy]); }

  fit([x0, y0, x1, y1]) {
    const c = Math.abs(Math.cos(this.turn)), s = Math.abs(Math.sin(this.turn)), w = x1 - x0, h = y1 - y0;
    const margin = 16;
    this.scale = Math.min((this.width - 2 * margin) / Math.max(c * w + s * h, 1), (this.height - 2 * margin) / Math.max(s * w + c * h, 1));
    this.scale = Math.min(Math.max(this.scale, 0.02), 80);
    [this.x, this.y] = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.changed();
  }

  centre(x, y) {
    [this.x, this.y] = [x, y];
    this.changed();
  }

  shows([x0, y0, x1, y1]) {
    return [[x0, y0], [x1, y0], [x0, y1], [x1, y1]].every(([x, y]) => {
      const [sx, sy] = this.toScreen(x, y);
      return sx >= 0 && sy >= 0 && sx <= this.width && sy <= this.height;
    });
  }

  // Pan so that a map point is in the inner part of the screen.
  keep(x, y) {
    const [sx, sy] = this.toScreen(x, y), mx = 0.3 * this.width, my = 0.3 * this.height;
    const dx = Math.min(this.width - mx - sx, 0) + Math.max(mx - sx, 0), dy = Math.min(this.height - my - sy, 0) + Math.max(my - sy, 0);
    if (dx || dy) this.pan(dx, dy);
  }
}
