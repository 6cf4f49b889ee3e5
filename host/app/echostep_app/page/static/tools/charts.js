// SPDX-License-Identifier: MIT
// Charts under the map: ranges, rates and heading over time, with what happened as ticks. In a replay of the whole walk, a tap seeks; live, of the last
// minute. The values under the pointer or finger are written; the wheel zooms about it, a double click shows all again.

import { minutes, tr } from '../language.js';
import { inUnits } from './units.js';

const LIVE_S = 60;  // shown of a live run
const POLL_MS = 1000;
const COLUMNS = ['left', 'right', 'foot', 'pings', 'heading'];
const CHARTS = [
  { title: 'range, m', series: [['left', 'left', 'left'], ['right', 'right', 'right']], dots: true },
  { title: 'rate, /s', series: [['foot', 'here', 'foot'], ['pings', 'goal', 'pings']] },
  { title: 'heading from north, °', series: [['heading', 'ink', 'heading']], dots: true },
];
const LEFT_PX = 34, RIGHT_PX = 6, TOP_PX = 15, AXIS_PX = 14, TICK_PX = 70, NEAR_PX = 12;
const STEPS_S = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600], SHORTEST_S = 2;

export class Charts {
  // `onSeek(t_s)`: the chart was tapped, in a replay
  constructor(canvas, colours, onSeek) {
    Object.assign(this, { canvas, colours, onSeek, pen: canvas.getContext('2d'), on: false, rows: [], events: [], play: null, zoomed: null, pointed: null, reading: false, onEvents: () => {}, isWanted: () => false });
    canvas.onclick = ({ offsetX }) => { if (this.play) onSeek(this.time(offsetX)); };
    canvas.onpointermove = canvas.onpointerdown = ({ offsetX }) => { this.pointed = offsetX; this.paint(); };
    canvas.onpointerleave = () => { this.pointed = null; this.paint(); };
    canvas.ondblclick = () => { this.zoomed = null; this.paint(); };
    canvas.addEventListener('wheel', (e) => this.zoom(e), { passive: false });
    setInterval(() => this.read(), POLL_MS);
  }

  clear() {
    Object.assign(this, { rows: [], events: [], play: null, zoomed: null, run: (this.run ?? 0) + 1 });
    this.onEvents(this.events);
  }

  // Read the rows that are new, where they are shown: in charts, in a replay's time bar, or in a list (`isWanted`).
  async read() {
    if (document.hidden || this.reading || !(this.on || this.play || this.isWanted())) return;
    this.reading = true;
    const { run } = this, answer = await fetch(new URL(`over-time/${this.rows.length}`, document.baseURI)).catch(() => null);
    const bytes = answer?.ok ? await answer.arrayBuffer() : null;
    this.reading = false;
    if (!bytes || run !== this.run) return;
    const length = new DataView(bytes).getUint32(0, true), { begin, rows, columns, events } = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
    if (begin !== this.rows.length) return this.clear();  // another run answers
    const numbers = new Float32Array(bytes, 4 + length, rows * columns);
    for (let k = 0; k < rows; k++) this.rows.push(numbers.subarray(columns * k, columns * (k + 1)));
    if (rows || events.length !== this.events.length) this.onEvents(this.events = events);  // ticks move while a replay grows
    if (rows) this.paint();
  }

  frame(play) {
    this.play = play;
    if (this.on && play?.t_s !== this.shown) this.paint();
  }

  // By the wheel, about the time under the pointer; live, the end stays now.
  zoom(e) {
    e.preventDefault();
    const [first, last] = this.whole, [begin, end] = this.span, long = Math.min(Math.max((end - begin) * Math.exp(0.0015 * e.deltaY), SHORTEST_S), last - first);
    const at = this.time(e.offsetX), from = Math.min(Math.max(at - (at - begin) * long / (end - begin), first), last - long);
    this.zoomed = long < last - first ? { from: this.play ? from : null, long } : null;
    this.paint();
  }

  get span() {
    const { zoomed } = this, [first, last] = this.whole, from = zoomed?.from ?? last - (zoomed?.long ?? LIVE_S);
    return zoomed || !this.play ? [from, from + (zoomed?.long ?? LIVE_S)] : [first, last];
  }

  // All that can be shown.
  get whole() {
    const end = this.rows.at(-1)?.[0] ?? 1;
    return this.play ? [this.play.begin_s, Math.max(this.play.end_s, this.play.begin_s + 1)] : [Math.min(this.rows[0]?.[0] ?? 0, end - LIVE_S), end];
  }

  time(px) {
    const [begin, end] = this.span;
    return Math.min(Math.max(begin + (end - begin) * (px - LEFT_PX) / (this.canvas.clientWidth - LEFT_PX - RIGHT_PX), begin), end);
  }

  paint() {
    if (!this.on) return;
    const sharp = window.devicePixelRatio || 1, { canvas, pen } = this, { clientWidth: width, clientHeight: height } = canvas;
    [canvas.width, canvas.height] = [Math.round(width * sharp), Math.round(height * sharp)];
    pen.setTransform(sharp, 0, 0, sharp, 0, 0);
    this.shown = this.play?.t_s;
    const [begin, end] = this.span, seen = this.rows.filter(([t]) => t >= begin && t <= end), each = (height - AXIS_PX) / CHARTS.length;
    const x = (t) => LEFT_PX + (width - LEFT_PX - RIGHT_PX) * (t - begin) / (end - begin);
    const near = this.pointed === null || !seen.length ? null : seen.reduce((a, b) => (Math.abs(x(b[0]) - this.pointed) < Math.abs(x(a[0]) - this.pointed) ? b : a));
    this.near = near && Math.abs(x(near[0]) - this.pointed) < NEAR_PX ? near : null;
    CHARTS.forEach((chart, k) => this.chart(chart, seen, x, k * each, each - 3, width - RIGHT_PX));
    this.axis(begin, end, x, height);
    if (this.near) this.rule(x(this.near[0]), height - AXIS_PX, 'ink', [1, 3]);
    for (const { t_s } of this.events) if (t_s >= begin && t_s <= end) this.rule(x(t_s), height, 'bad', [2, 3]);
    if (this.play && this.play.t_s >= begin && this.play.t_s <= end) this.rule(x(this.play.t_s), height, 'ink', []);
    canvas.setAttribute('aria-label', tr(inUnits(this.words(seen))));
  }

  // Times from the beginning of the walk, and that under the pointer.
  axis(begin, end, x, height) {
    const { pen } = this, [first] = this.whole, most = Math.max((x(end) - x(begin)) / TICK_PX, 1), step = STEPS_S.find((one) => (end - begin) / one <= most) ?? 7200;
    const text = (t, of) => { pen.fillText(of, Math.min(Math.max(x(t), LEFT_PX), x(end) - pen.measureText(of).width / 2), height - 3); };
    Object.assign(pen, { font: '11px system-ui, sans-serif', textAlign: 'center', fillStyle: this.colours()[this.near ? 'ink' : 'faint'] });
    if (this.near) return text(this.near[0], `${minutes(this.near[0] - first)}.${Math.floor(10 * ((this.near[0] - first) % 1))}`);
    for (let t = first + step * Math.ceil((begin - first) / step); t <= end; t += step) text(t, minutes(t - first));
  }

  chart({ title, series, dots }, rows, x, top, height, width) {
    const { pen } = this, of = (row, name) => row[1 + COLUMNS.indexOf(name)], values = rows.flatMap((row) => series.map(([name]) => of(row, name))).filter(Number.isFinite);
    const [low, high] = title.startsWith('heading') ? [0, 360] : [0, Math.max(1, ...values)], y = (v) => top + TOP_PX + (height - TOP_PX) * (high - v) / (high - low);
    Object.assign(pen, { font: '11px system-ui, sans-serif', textAlign: 'left', fillStyle: this.colours().faint, strokeStyle: this.colours().line, lineWidth: 1 });
    pen.strokeRect(LEFT_PX, top + TOP_PX, width - LEFT_PX, height - TOP_PX);
    pen.fillText(high.toFixed(high < 10 ? 1 : 0), 2, top + TOP_PX + 9);
    pen.fillText(low.toFixed(0), 2, top + height);
    let at = LEFT_PX;
    const value = (name) => (Number.isFinite(of(this.near ?? [], name)) ? ` ${of(this.near, name).toFixed(title.startsWith('range') ? 2 : 0)}` : '');
    for (const [text, colour] of [[tr(title), 'faint'], ...series.map(([name, paint, text], k) => [`${k ? '▬' : '●'} ${tr(text)}${value(name)}`, paint])]) {
      pen.fillStyle = this.colours()[colour];
      pen.fillText(text, at, top + 11);
      at += pen.measureText(text).width + 12;
    }
    series.forEach(([name, colour], k) => {
      pen.fillStyle = pen.strokeStyle = this.colours()[colour];
      pen.lineWidth = 1.5;
      pen.beginPath();
      for (const row of rows) {
        const value = of(row, name);
        if (!Number.isFinite(value)) continue;
        if (!dots) pen.lineTo(x(row[0]), y(value));
        else if (k) pen.rect(x(row[0]) - 2, y(value) - 1, 4, 2);  // bars and discs: to be told apart without colours
        else { pen.moveTo(x(row[0]) + 1.6, y(value)); pen.arc(x(row[0]), y(value), 1.6, 0, 2 * Math.PI); }
      }
      pen[dots ? 'fill' : 'stroke']();
    });
  }

  rule(at, height, colour, dash) {
    const { pen } = this;
    pen.setLineDash(dash);
    pen.beginPath();
    pen.moveTo(at, 0);
    pen.lineTo(at, height);
    Object.assign(pen, { strokeStyle: this.colours()[colour], lineWidth: 1.2 });
    pen.stroke();
    pen.setLineDash([]);
  }

  // The newest values, for screen readers.
  words(rows) {
    const last = COLUMNS.map((name, k) => [name, rows.findLast((row) => Number.isFinite(row[1 + k]))?.[1 + k]]);
    return `Charts: ${last.filter(([, value]) => value !== undefined).map(([name, value]) => `${name} ${value.toFixed(1)}`).join(', ') || 'nothing yet'}`;
  }
}
