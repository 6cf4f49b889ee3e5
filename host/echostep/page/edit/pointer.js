// Mouse and fingers on the sheet: `deed` has down(place) -> whether it holds something, move(place), up(place, whether it was a click), cancel(), moved().

const SLOP_PX = 6;

export class Pointer {
  constructor(map, view, deed) {
    Object.assign(this, { map, view, deed, fingers: new Map(), begun: null });
    map.addEventListener('pointerdown', (e) => this.down(e));
    map.addEventListener('pointermove', (e) => this.move(e));
    map.addEventListener('pointerup', (e) => this.up(e));
    map.addEventListener('pointercancel', (e) => { this.drop(e); deed.cancel(); });
    map.addEventListener('contextmenu', (e) => e.preventDefault());
    map.addEventListener('wheel', (e) => {
      e.preventDefault();
      view.grip(this.at(e), this.at(e), Math.exp(-e.deltaY * (e.deltaMode ? 20 : 1) * 0.0015));
      deed.moved();
    }, { passive: false });
  }

  at(e) {
    const box = this.map.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  down(e) {
    const at = this.at(e), place = this.view.toMap(...at);
    this.map.setPointerCapture(e.pointerId);
    this.fingers.set(e.pointerId, at);
    if (this.fingers.size > 1) {
      this.begun = null;
      this.deed.cancel();
    } else this.begun = { at, far: false, holds: e.button === 0 && this.deed.down(place), pans: e.button !== 0 };
  }

  move(e) {
    const now = this.at(e), before = this.fingers.get(e.pointerId), { begun, view } = this;
    if (!before) { this.deed.move(view.toMap(...now)); return; }
    if (this.fingers.size === 2) {
      const [other] = [...this.fingers].filter(([id]) => id !== e.pointerId).map(([, at]) => at);
      const reach = (p) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
      view.grip([(before[0] + other[0]) / 2, (before[1] + other[1]) / 2], [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2], reach(now) / reach(before));
      this.deed.moved();
    } else if (begun) {
      begun.far ||= Math.hypot(now[0] - begun.at[0], now[1] - begun.at[1]) > SLOP_PX;
      if (begun.far && begun.holds) this.deed.move(view.toMap(...now));
      else if (begun.far) { view.pan(now[0] - before[0], now[1] - before[1]); this.deed.moved(); }
    }
    this.fingers.set(e.pointerId, now);
  }

  up(e) {
    const { begun } = this;
    this.drop(e);
    if (begun && !begun.pans && (begun.holds || !begun.far)) this.deed.up(this.view.toMap(...this.at(e)), !begun.far);
  }

  drop(e) {
    this.fingers.delete(e.pointerId);
    this.begun = null;
  }
}
