// SPDX-License-Identifier: MIT
// Mouse and fingers on the sheet. `actions`: down(position, event), move(position), up(position, whether it was a tap, event), cancel(), moved().

const SLOP_PX = 6; // a movement below this is a tap

export class Pointer {
  constructor(map, view, actions) {
    Object.assign(this, { map, view, actions, fingers: new Map(), begun: null });
    map.addEventListener('pointerdown', (e) => this.down(e));
    map.addEventListener('pointermove', (e) => this.move(e));
    map.addEventListener('pointerup', (e) => this.up(e));
    map.addEventListener('pointercancel', (e) => { this.drop(e); actions.cancel(); });
    map.addEventListener('contextmenu', (e) => e.preventDefault());
    const keep = (e) => e.cancelable && e.preventDefault();
    map.addEventListener('touchmove', keep, { passive: false }); // else a quick stroke goes on as a scroll, which swallows the next tap on a button
    map.addEventListener('touchend', keep); // else a dialog that a tap opens is clicked by the same tap
    map.addEventListener('wheel', (e) => {
      e.preventDefault();
      view.grip(this.pixel(e), this.pixel(e), Math.exp(-e.deltaY * (e.deltaMode ? 20 : 1) * 0.0015));
      actions.moved();
    }, { passive: false });
  }

  pixel(e) {
    const box = this.map.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  down(e) {
    const pixel = this.pixel(e);
    this.map.setPointerCapture(e.pointerId);
    this.map.focus({ preventScroll: true });
    this.fingers.set(e.pointerId, pixel);
    if (this.fingers.size > 1) {
      this.begun = null;
      this.actions.cancel();
    } else {
      this.begun = { pixel, far: false, pans: e.button !== 0 };
      if (!this.begun.pans) this.actions.down(this.view.toMap(...pixel), e);
    }
  }

  move(e) {
    const now = this.pixel(e), before = this.fingers.get(e.pointerId), { begun, view } = this;
    if (!before) { this.actions.move(view.toMap(...now)); return; }
    if (this.fingers.size === 2) {
      const [other] = [...this.fingers].filter(([id]) => id !== e.pointerId).map(([, pixel]) => pixel);
      const reach = (p) => Math.max(Math.hypot(p[0] - other[0], p[1] - other[1]), 1);
      view.grip([(before[0] + other[0]) / 2, (before[1] + other[1]) / 2], [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2], reach(now) / reach(before));
      this.actions.moved();
    } else if (begun) {
      begun.far ||= Math.hypot(now[0] - begun.pixel[0], now[1] - begun.pixel[1]) > SLOP_PX;
      if (begun.far && !begun.pans) this.actions.move(view.toMap(...now));
      else if (begun.far) { view.pan(now[0] - before[0], now[1] - before[1]); this.actions.moved(); }
    }
    this.fingers.set(e.pointerId, now);
  }

  up(e) {
    const { begun } = this;
    this.drop(e);
    if (begun && !begun.pans) this.actions.up(this.view.toMap(...this.pixel(e)), !begun.far, e);
  }

  drop(e) {
    this.fingers.delete(e.pointerId);
    this.begun = null;
  }
}
