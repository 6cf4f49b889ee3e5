// SPDX-License-Identifier: MIT
// The view: the part of the map on the screen. Converts map metres (x east, y north) to CSS pixels and back. What lies over the map leaves a free part of it.

const ABOUT_M = 15, MUCH_NEARER = 1.25;  // of the wearer in the first view; than the whole floor, if it is to be shown; assumed
const SIGN_PX = 24;
const BESIDE_PX = 40, ABOVE_PX = 16;  // margins of a plan: its exits' signs reach so far beyond it (AUSGANG); assumed
const LEAST_FREE = 0.05;  // share of the map; less is as good as nothing

export class View {
  constructor() {
    Object.assign(this, { x: 0, y: 0, scale: 20, turn: 0, north: Math.PI / 2, width: 1, height: 1, stamp: 0, over: [], onChanged: () => {} });
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

  // What lies over the map. Messages that would take too much of it are scrolled, by keys too.
  layOver(messages, ...others) {
    this.over = [messages, ...others];
    new ResizeObserver(() => { messages.tabIndex = messages.scrollHeight > messages.clientHeight ? 0 : -1; }).observe(messages);
  }

  // The largest part of the map, in pixels [left, top, right, bottom], that no element of `over` covers.
  get free() {
    let free = this.all;
    const map = this.over[0]?.parentElement.getBoundingClientRect(), area = ([l, t, r, b]) => Math.max(r - l, 0) * Math.max(b - t, 0);
    for (const element of this.over) {
      const box = element.getBoundingClientRect(), [l, t, r, b] = free;
      const [left, top, right, bottom] = [box.left - map.left, box.top - map.top, box.right - map.left, box.bottom - map.top];
      if (!box.width || !box.height || left >= r || right <= l || top >= b || bottom <= t) continue;
      free = [[l, bottom, r, b], [l, t, r, top], [right, t, r, b], [l, t, left, b]].reduce((best, one) => (area(one) > area(best) ? one : best));
    }
    return area(free) > LEAST_FREE * this.width * this.height ? free : this.all;
  }

  // A box of the map fills the free part.
  fit([x0, y0, x1, y1]) {
    const [l, t, r, b] = this.free, c = Math.abs(Math.cos(this.turn)), s = Math.abs(Math.sin(this.turn)), w = x1 - x0, h = y1 - y0;
    this.scale = Math.min((r - l - 2 * BESIDE_PX) / Math.max(c * w + s * h, 1), (b - t - 2 * ABOVE_PX) / Math.max(s * w + c * h, 1));
    this.scale = Math.min(Math.max(this.scale, 0.02), 80);
    this.centre((x0 + x1) / 2, (y0 + y1) / 2);
  }

  // The first view: the whole `box`, or what is about the place where that is much less.
  approach(x, y, box) {
    const [l, t, r, b] = this.free, scale = Math.sqrt((r - l) * (b - t)) / (2 * ABOUT_M);
    this.fit(box);
    if (scale < MUCH_NEARER * this.scale) return;
    this.scale = scale;
    this.centre(x, y);
  }

  centre(x, y) {
    const [l, t, r, b] = this.free;
    [this.x, this.y] = [x, y];
    this.pan((l + r - this.width) / 2, (t + b - this.height) / 2);
  }

  get all() { return [0, 0, this.width, this.height]; }

  // Whether a box of the map is within a part of the screen.
  shows([x0, y0, x1, y1], [l, t, r, b] = this.free) {
    return [[x0, y0], [x1, y0], [x0, y1], [x1, y1]].every(([x, y]) => {
      const [sx, sy] = this.toScreen(x, y);
      return sx >= l && sy >= t && sx <= r && sy <= b;
    });
  }

  // Pan so that a map point is in the free part, a `share` of it and a sign's size away from its edges.
  keep(x, y, share = 0.3) {
    const [l, t, r, b] = this.free, [sx, sy] = this.toScreen(x, y), [mx, my] = [r - l, b - t].map((size) => Math.max(share * size, Math.min(SIGN_PX, size / 2)));
    const dx = Math.min(r - mx - sx, 0) + Math.max(l + mx - sx, 0), dy = Math.min(b - my - sy, 0) + Math.max(t + my - sy, 0);
    if (dx || dy) this.pan(dx, dy);
  }
}
