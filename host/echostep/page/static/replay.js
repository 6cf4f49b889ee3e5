// The time bar of a replay: play and pause, step, seek, speed.

const $ = (id) => document.getElementById(id);

export class Replay {
  // `send(kind, fields)`: sends a request to the server
  constructor(send) {
    this.holding = false;
    this.playing = true;
    $('play').onclick = () => send('play', { playing: !this.playing });
    $('back').onclick = () => send('skip', { by: -1 });
    $('on').onclick = () => send('skip', { by: 1 });
    $('times').onchange = () => send('speed', { times: Number($('times').value) });
    $('time').oninput = () => { this.holding = true; send('seek', { t_s: Number($('time').value) }); };
    $('time').onchange = () => { this.holding = false; };
  }

  show(replay) { $('replay').hidden = !replay; }

  frame(play) {
    if (!play) return;
    const { t_s, begin_s, end_s, playing } = play, bar = $('time');
    this.playing = playing;
    [bar.min, bar.max] = [begin_s, end_s];
    if (!this.holding) bar.value = t_s;
    const text = `${minutes(t_s - begin_s)} / ${minutes(end_s - begin_s)}`;
    $('clock').textContent = text;
    bar.setAttribute('aria-valuetext', text);
    $('play').textContent = playing ? '❚❚' : '▶';
    $('play').setAttribute('aria-label', playing ? 'Pause' : 'Play');
  }
}

const minutes = (s) => `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, '0')}`;
