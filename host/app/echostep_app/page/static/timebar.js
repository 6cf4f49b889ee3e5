// SPDX-License-Identifier: MIT
// The time bar of a recorded walk or operation: play and pause, step, seek, speed.

import { minutes, tr } from './language.js';
import { clock, put } from './text.js';

const ANSWER_MS = 2000, NEAR_S = 1;  // a time that was asked for is shown until the server is there, or for so long
const $ = (id) => document.getElementById(id);

export class TimeBar {
  // `send(kind, fields)`: sends a request to the server
  constructor(send) {
    Object.assign(this, { send, holding: false, playing: true, asked: null, last: null });
    $('play').onclick = () => send('play', { playing: !this.playing });
    $('back').onclick = () => this.step(-1);
    $('on').onclick = () => this.step(1);
    $('times').onchange = () => send('speed', { times: Number($('times').value) });
    $('time').oninput = () => { this.holding = true; this.seek(Number($('time').value)); };
    $('time').onchange = () => { this.holding = false; };
  }

  step(steps) {
    this.asked = null;
    this.send('step', { steps });
  }

  seek(t_s) {
    this.asked = { t_s, until: performance.now() + ANSWER_MS };
    this.send('seek', { t_s });
  }

  // Whether the server has not yet gone to the time that was asked for: keys pressed meanwhile go on from there.
  isOnItsWay(t_s) {
    if (this.asked && (Math.abs(t_s - this.asked.t_s) < NEAR_S || performance.now() > this.asked.until)) this.asked = null;
    return this.asked !== null;
  }

  // After a new connection the server has forgotten where this page was.
  show(replay) {
    $('replay').hidden = !replay;
    if (!replay || !this.last) return;
    const { times, playing, t_s } = this.last;
    this.send('speed', { times });
    this.send('play', { playing });
    this.send('seek', { t_s });
  }

  forget() { this.last = null; }

  // `ended`: this is the end of the walk, from which Play begins anew; `unix_s`: the time of day, where it is known.
  frame(play, ended, unix_s) {
    if (!play) return;
    this.last = play;
    const { t_s, begin_s, end_s, times } = play, playing = play.playing && !ended, bar = $('time');
    this.playing = playing;
    [bar.min, bar.max] = [begin_s, end_s];
    if (!this.holding && !this.isOnItsWay(t_s)) bar.value = t_s;
    const text = `${unix_s ? `${clock(unix_s)}, ` : ''}${minutes(t_s - begin_s)} / ${minutes(end_s - begin_s)}`;
    put($('clock'), text);
    bar.setAttribute('aria-valuetext', text);
    put($('play'), playing ? '❚❚' : '▶');
    $('play').title = tr(playing ? 'Pause' : 'Play');
    $('play').setAttribute('aria-label', $('play').title);
    if (document.activeElement !== $('times')) $('times').value = String(times);
  }
}
