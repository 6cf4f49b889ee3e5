// SPDX-License-Identifier: MIT
// Fingers, mouse and keys on the map: pan, zoom, rotate, tap. In a mode that takes a position: a tap gives the position, a drag also the heading.

const SLOP_PX = 10;  // a movement below this is a tap
const TEXTS = ['INPUT', 'SELECT'], TAKES = { '?': ['INPUT'], c: TEXTS, t: TEXTS, ' ': ['INPUT', 'SELECT', 'BUTTON', 'SUMMARY'] };  // controls that take these keys themselves
const PAN_PX = 60;  // per arrow key

export class Gestures {
  // `actions`: takesPose() -> whether a drag gives a pose; tapped(position), posing(position, heading), posed(position, heading), moved(), key(name) -> whether it was used
  constructor(map, view, actions) {
    Object.assign(this, { map, view, actions, pointers: new Map(), begun: null });
    map.addEventListener('pointerdown', (e) => this.down(e));
    map.addEventListener('pointermove', (e) => this.move(e));
    map.addEventListener('pointerup', (e) => this.up(e));
    map.addEventListener('pointercancel', (e) => this.drop(e));
    map.addEventListener('touchmove', (e) => e.cancelable && e.preventDefault(), { passive: false });  // else a quick stroke goes on as a scroll, which swallows the next tap on a button
    map.addEventListener('wheel', (e) => this.wheel(e), { passive: false });
    map.addEventListener('contextmenu', (e) => e.preventDefault());
    map.addEventListener('keydown', (e) => this.key(e));
    document.addEventListener('keydown', (e) => this.anywhere(e));
  }

  pixel(e) {
    const box = this.map.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  down(e) {
    this.map.setPointerCapture(e.pointerId);
    this.pointers.set(e.pointerId, this.pixel(e));
    const turning = e.button === 2 || e.shiftKey;
    this.begun = this.pointers.size === 1 ? { pixel: this.pixel(e), far: false, turning, position: this.view.toMap(...this.pixel(e)) } : null;
    if (this.begun && !turning && this.actions.takesPose()) this.actions.posing(this.begun.position, null);
    if (this.pointers.size === 2) this.actions.posing(null, null);
  }

  move(e) {
    const before = this.pointers.get(e.pointerId);
    if (!before) return;
    const now = this.pixel(e);
    if (this.pointers.size === 2) {
      const [other] = [...this.pointers].filter(([id]) => id !== e.pointerId).map(([, pixel]) => pixel);
      this.pinch(before, now, other);
    } else if (this.begun) this.drag(before, now);
    this.pointers.set(e.pointerId, now);
  }

  pinch(before, now, other) {
    const u = [before[0] - other[0], before[1] - other[1]], v = [now[0] - other[0], now[1] - other[1]];
    const factor = Math.hypot(...v) / Math.max(Math.hypot(...u), 1);
    this.view.grip(other, other, factor, Math.atan2(u[1], u[0]) - Math.atan2(v[1], v[0]));
    this.actions.moved();
  }

  drag(before, now) {
    const { begun, view } = this, away = [now[0] - begun.pixel[0], now[1] - begun.pixel[1]];
    begun.far ||= Math.hypot(...away) > SLOP_PX;
    if (!begun.far) return;
    if (begun.turning) {
      const middle = [view.width / 2, view.height / 2], angle = (p) => Math.atan2(p[1] - middle[1], p[0] - middle[0]);
      view.grip(middle, middle, 1, angle(before) - angle(now));
      this.actions.moved();
    } else if (this.actions.takesPose()) {
      this.actions.posing(begun.position, this.heading(away));
    } else {
      view.pan(now[0] - before[0], now[1] - before[1]);
      this.actions.moved();
    }
  }

  heading([dx, dy]) { return Math.atan2(-dy, dx) - this.view.turn; }

  up(e) {
    const { begun } = this, now = this.pixel(e);
    this.drop(e);
    if (!begun || begun.turning) return;
    if (this.actions.takesPose()) this.actions.posed(begun.position, begun.far ? this.heading([now[0] - begun.pixel[0], now[1] - begun.pixel[1]]) : null);
    else if (!begun.far) this.actions.tapped(begun.position, begun.pixel);
  }

  drop(e) {
    this.pointers.delete(e.pointerId);
    this.begun = null;
  }

  wheel(e) {
    e.preventDefault();
    const pixel = this.pixel(e), step = e.deltaY * (e.deltaMode ? 20 : 1);
    if (e.shiftKey) this.view.grip(pixel, pixel, 1, step * 0.002);
    else this.view.grip(pixel, pixel, Math.exp(-step * 0.0015));
    this.actions.moved();
  }

  // ?, C, T and Space act wherever the focus is, but for what takes them itself.
  anywhere(e) {
    const { tagName, type } = e.target, takes = TAKES[e.key]?.includes(tagName) && type !== 'range';
    if (e.key in TAKES && !takes && !e.defaultPrevented && !document.querySelector('dialog[open]')) this.key(e);
  }

  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const { view } = this;
    const moves = {
      ArrowLeft: () => view.pan(PAN_PX, 0), ArrowRight: () => view.pan(-PAN_PX, 0), ArrowUp: () => view.pan(0, PAN_PX), ArrowDown: () => view.pan(0, -PAN_PX),
      '[': () => view.rotate(Math.PI / 12), ']': () => view.rotate(-Math.PI / 12),
      '+': () => view.zoom(1.25), '=': () => view.zoom(1.25), '-': () => view.zoom(0.8),
    };
    if (moves[e.key]) {
      moves[e.key]();
      this.actions.moved();
    } else if (!this.actions.key(e.key)) return;
    e.preventDefault();
  }
}
