// SPDX-License-Identifier: MIT
// How old is what a page shows? The server sends a beat each second, with the age of the run's last sign of life. After SILENT_S without one the page says
// so: the program's name and the time of what is shown; what is of then is dimmed and dated ("12 s ago: ", style.css), what needs the server is off.

import { tr } from './language.js';

const SILENT_S = 3;
const TICK_MS = 500;
const NEEDS_SERVER = ['', ' button', ' select', ' input'].map((control) => `[data-needs-server]${control}`).join();
const $ = (id) => document.getElementById(id);
const clocks = () => [performance.now(), Date.now()];  // the first may stand still while a computer sleeps, the second may be set

export class Pulse {
  // `onAge()`: the age has changed while there is silence, or the silence is over; `isLive()`: what is shown is the present
  constructor(onAge, isLive) {
    Object.assign(this, { onAge, isLive, program: 'echostep', off: [], isSilent: false, behind_s: 0, server_s: null, heard: 0, beat: clocks(), ticked: Date.now() });
    setInterval(() => this.tick(), TICK_MS);
    document.addEventListener('visibilitychange', () => this.tick());
  }

  // `server_s`: of the server's clock; null if it is not told.
  hear(behind_s, server_s) {
    Object.assign(this, { beat: clocks(), behind_s, server_s, heard: this.heard + 1 });
    if (this.isSilent) this.judge();
  }

  get since_s() { return Math.max(...clocks().map((now, k) => now - this.beat[k])) / 1000; }
  get age_s() { return this.behind_s + this.since_s; }
  get now_s() { return this.server_s === null ? null : this.server_s + this.since_s; }  // of the server
  get ago() { return this.age_s < 120 ? `${Math.floor(this.age_s)} s` : `${Math.floor(this.age_s / 60)} min`; }

  // After a pause of the browser itself the beats that wait come first. In the background each tick is late.
  tick() {
    const paused = Date.now() - this.ticked > 3 * TICK_MS;
    if (!paused || this.paused) this.judge();
    Object.assign(this, { ticked: Date.now(), paused });
  }

  judge() {
    const was = this.isSilent;
    this.isSilent = this.age_s >= SILENT_S;
    if (this.isSilent) this.say();
    else if (was) this.end();
    if (this.isSilent || was) this.onAge();
  }

  say() {
    const at = new Date(this.beat[1] - 1000 * this.behind_s).toLocaleTimeString('en-GB'), isLive = this.isLive();
    document.body.dataset.silent = isLive ? 'present' : 'past';
    document.body.style.setProperty('--ago', JSON.stringify(`${tr(`${this.ago} ago`)}: `));
    $('silence').hidden = false;
    const text = tr(`No answer from ${this.program} since ${at}. Is it running, and in reach?`);
    if ($('silence').textContent !== text) $('silence').textContent = text;
    for (const control of document.querySelectorAll(NEEDS_SERVER)) {
      if (control.disabled !== false) continue;  // it is off for another reason, or no control
      this.off.push([control, control.title]);
      Object.assign(control, { disabled: true, title: tr('Off while the program does not answer') });
    }
  }

  end() {
    delete document.body.dataset.silent;
    $('silence').hidden = true;
    for (const [control, title] of this.off.splice(0)) Object.assign(control, { disabled: false, title });
  }
}
