// SPDX-License-Identifier: MIT
// The time bar over the whole operation: go back, hold, play, return to now. While the past is shown, what calls for help now is said beside it.

import { minutes, tr } from '../static/language.js';
import { clock, put } from './text.js';

const $ = (id) => document.getElementById(id);
const SKIP_S = 10;
const ANSWER_MS = 2000, NEAR_S = 1;  // a place that was asked for is shown until the server is there, or for so long

export class TimeBar {
  // `send(kind, fields)`: sends a request to the server
  constructor(send) {
    Object.assign(this, { send, holding: false, last: null, asked: null });
    $('play').onclick = () => send('play', { playing: !this.last?.playing });
    $('back').onclick = () => this.skip(-SKIP_S);
    $('on').onclick = () => this.skip(SKIP_S);
    $('now').onclick = () => { this.asked = null; send('now'); $('time').focus(); };
    $('times').onchange = () => send('speed', { times: Number($('times').value) });
    $('time').oninput = () => { this.holding = true; this.seek(Number($('time').value)); };
    $('time').onchange = () => { this.holding = false; };
  }

  skip(by) { if (this.last) this.seek(Math.min(Math.max(this.last.t_s + by, 0), this.last.end_s)); }

  seek(t_s) {
    this.asked = { t_s, until: performance.now() + ANSWER_MS };
    this.send('seek', { t_s });
  }

  // Whether the server has not yet gone to the place that was asked for: keys pressed meanwhile go on from there.
  isOnItsWay(t_s) {
    if (this.asked && (Math.abs(t_s - this.asked.t_s) < NEAR_S || performance.now() > this.asked.until)) this.asked = null;
    return this.asked !== null;
  }

  get isPast() { return Boolean(this.last && !this.last.now); }

  // After a new connection the server has forgotten where this page was.
  again() {
    const { last } = this;
    if (!last || last.now) return;
    this.send('speed', { times: last.times });
    this.send('seek', { t_s: last.t_s });
    this.send('play', { playing: last.playing });
  }

  // `isOld`: no longer now, but the newest that is known.
  show(time, unix_s, isOld) {
    if ($('bar-of-time').hidden !== !time) $('bar-of-time').hidden = !time;
    this.last = time;
    if (!time) return;
    const { t_s, end_s, playing, times, now, live, open_alarms } = time, bar = $('time');
    bar.max = end_s;
    if (!this.holding && !this.isOnItsWay(t_s)) bar.value = t_s;
    const day = clock(unix_s), behind = live ? `${minutes(end_s - t_s)} ago` : `${minutes(t_s)} / ${minutes(end_s)}`;
    const text = isOld ? day : tr(now ? `${day}, now` : `${day}, ${behind}`);
    put($('clock'), text);
    bar.setAttribute('aria-valuetext', text);
    put($('play'), playing ? '❚❚' : '▶');
    $('play').setAttribute('aria-label', tr(playing ? 'Hold' : 'Play'));
    $('on').disabled = now;
    $('now').hidden = !live;
    $('now').disabled = now;
    put($('now'), tr(!now && open_alarms ? `Now: ▲ ${open_alarms}` : 'Now'));
    $('now').classList.toggle('urgent', !now && open_alarms > 0);
    $('now').setAttribute('aria-label', tr(!now && open_alarms ? `Return to now: open maydays: ${open_alarms}` : 'Return to now'));
    if (document.activeElement !== $('times')) $('times').value = String(times);
    $('times').disabled = now;
    document.body.dataset.past = String(!now && live);
  }
}
