// Fingers, mouse and keys on the map: pan, zoom, rotate; tap; in a mode that takes a place, tap = place and drag = heading.

const SLOP_PX = 10;
const PAN_PX = 60;

export class Gestures {
  // `deed`: takes() says whether a drag gives a pose; tapped(place), posing(place, heading), posed(place, heading), moved(), key(name) -> whether it was used
  constructor(map, view, deed) {
    Object.assign(this, { map, view, deed, held: new Map(), begun: null });
    map.addEventListener('pointerdown', (e) => this.down(e));
    map.addEventListener('pointermove', (e) => this.move(e));
    map.addEventListener('pointerup', (e) => this.up(e));
    map.addEventListener('pointercancel', (e) => this.drop(e));
    map.addEventListener('wheel', (e) => this.wheel(e), { passive: false });
    map.addEventListener('contextmenu', (e) => e.preventDefault());
    map.addEventListener('keydown', (e) => this.key(e));
  }

  at(e) {
    const box = this.map.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  down(e) {
    this.map.setPointerCapture(e.pointerId);
    this.held.set(e.pointerId, this.at(e));
    const turning = e.button === 2 || e.shiftKey;
    this.begun = this.held.size === 1 ? { at: this.at(e), far: false, turning, place: this.view.toMap(...this.at(e)) } : null;
    if (this.begun && !turning && this.deed.takes()) this.deed.posing(this.begun.place, null);
    if (this.held.size === 2) this.deed.posing(null, null);
  }

  move(e) {
    const before = this.held.get(e.pointerId);
    if (!before) return;
    const now = this.at(e);
    if (this.held.size === 2) {
      const [other] = [...this.held].filter(([id]) => id !== e.pointerId).map(([, at]) => at);
      this.pinch(before, now, other);
    } else if (this.begun) this.drag(before, now);
    this.held.set(e.pointerId, now);
  }

  pinch(before, now, other) {
    const u = [before[0] - other[0], before[1] - other[1]], v = [now[0] - other[0], now[1] - other[1]];
    const factor = Math.hypot(...v) / Math.max(Math.hypot(...u), 1);
    this.view.grip(other, other, factor, Math.atan2(u[1], u[0]) - Math.atan2(v[1], v[0]));
    this.deed.moved();
  }

  drag(before, now) {
    const { begun, view } = this, away = [now[0] - begun.at[0], now[1] - begun.at[1]];
    begun.far ||= Math.hypot(...away) > SLOP_PX;
    if (!begun.far) return;
    if (begun.turning) {
      const middle = [view.width / 2, view.height / 2], angle = (p) => Math.atan2(p[1] - middle[1], p[0] - middle[0]);
      view.grip(middle, middle, 1, angle(before) - angle(now));
      this.deed.moved();
    } else if (this.deed.takes()) {
      this.deed.posing(begun.place, this.heading(away));
    } else {
      view.pan(now[0] - before[0], now[1] - before[1]);
      this.deed.moved();
    }
  }

  heading([dx, dy]) { return Math.atan2(-dy, dx) - this.view.turn; }

  up(e) {
    const { begun } = this, now = this.at(e);
    this.drop(e);
    if (!begun || begun.turning) return;
    if (this.deed.takes()) this.deed.posed(begun.place, begun.far ? this.heading([now[0] - begun.at[0], now[1] - begun.at[1]]) : null);
    else if (!begun.far) this.deed.tapped(begun.place, begun.at);
  }

  drop(e) {
    this.held.delete(e.pointerId);
    this.begun = null;
  }

  wheel(e) {
    e.preventDefault();
    const at = this.at(e), step = e.deltaY * (e.deltaMode ? 20 : 1);
    if (e.shiftKey) this.view.grip(at, at, 1, step * 0.002);
    else this.view.grip(at, at, Math.exp(-step * 0.0015));
    this.deed.moved();
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
      this.deed.moved();
    } else if (!this.deed.key(e.key)) return;
    e.preventDefault();
  }
}
