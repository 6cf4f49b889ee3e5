// SPDX-License-Identifier: MIT
// The time bar of a replay: play and pause, step, seek, speed.

import { minutes, tr } from '../language.js';

const $ = (id) => document.getElementById(id);

export class Replay {
  // `send(kind, fields)`: sends a request to the server
  constructor(send) {
    Object.assign(this, { send, holding: false, playing: true, last: null });
    $('play').onclick = () => send('play', { playing: !this.playing });
    $('back').onclick = () => send('skip', { by: -1 });
    $('on').onclick = () => send('skip', { by: 1 });
    $('times').onchange = () => send('speed', { times: Number($('times').value) });
    $('time').oninput = () => { this.holding = true; send('seek', { t_s: Number($('time').value) }); };
    $('time').onchange = () => { this.holding = false; };
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

  // `ended`: this is the end of the walk, from which Play begins anew.
  frame(play, ended) {
    if (!play) return;
    this.last = play;
    const { t_s, begin_s, end_s } = play, playing = play.playing && !ended, bar = $('time');
    this.playing = playing;
    [bar.min, bar.max] = [begin_s, end_s];
    if (!this.holding) bar.value = t_s;
    const text = `${minutes(t_s - begin_s)} / ${minutes(end_s - begin_s)}`;
    $('clock').textContent = text;
    bar.setAttribute('aria-valuetext', text);
    $('play').textContent = playing ? '❚❚' : '▶';
    $('play').title = tr(playing ? 'Pause' : 'Play');
    $('play').setAttribute('aria-label', $('play').title);
  }
}
