// SPDX-License-Identifier: MIT
// A mayday that arrives: it sounds and vibrates, the title blinks and the header is red until it is acknowledged; its floor and place come into view, and
// one tap leads back to what was seen before.

import { Bell } from '../bell.js';
import { say } from '../text.js';

const BLINK_MS = 1000;  // assumed; slower than the 3 flashes a second of WCAG 2.3.1
const $ = (id) => document.getElementById(id);

export class Alarm {
  // `view` of the map; `show(place)`: its floor and place come into view; `open(id)`: the details; `level()`, `showLevel(level)`: of the map; `floor(level)`: its name
  constructor(view, { show, open, level, showLevel, floor }) {
    Object.assign(this, { view, show, open, level, showLevel, floor, bell: new Bell($('invitation')), title: document.title, open_ids: null, count: 0, shown: null, before: null, blink: null, isTurned: false, isLeft: false, named: '' });
    $('mayday-open').onclick = () => this.open(this.shown);
    $('mayday-back').onclick = () => this.back();
  }

  // Rows of the list, the place of each wearer.
  update(rows, places) {
    const open = rows.filter(({ open_alarm }) => open_alarm), first = this.open_ids === null, come = open.filter(({ id }) => !first && !this.open_ids.has(id));
    this.open_ids = new Set(open.map(({ id }) => id));
    if (come.length) this.arrive(come[0], places.get(come[0].id));
    if (this.shown !== null && !this.open_ids.has(this.shown)) this.hide();
    [this.count, this.first] = [open.length, open[0]?.id];
    this.named = open.length ? ` ${open[0].name}` : '';
    this.mark();
  }

  arrive(row, place) {
    this.bell.ring();
    this.before ??= { level: this.level(), x: this.view.x, y: this.view.y, scale: this.view.scale, turn: this.view.turn };
    Object.assign(this, { shown: row.id, isLeft: false });
    say($('mayday-text'), `▲ ${row.name}: mayday, ${place ? this.floor(place.level) : 'place not known'}`);
    $('mayday').hidden = false;
    $('mayday-back').hidden = !place;
    if (place) this.show(place);
  }

  // The place stays in view, whatever comes to lie over the map, until the map is moved.
  keep(places) {
    const place = this.isLeft ? null : places.get(this.shown ?? this.first);
    if (place?.level === this.level()) this.view.keep(place.x, place.y);
  }

  back() {
    const { before } = this;
    this.hide();
    this.isLeft = true;
    if (!before) return;
    const { level, ...seen } = before;
    this.showLevel(level);
    Object.assign(this.view, seen);
    this.view.changed();
  }

  hide() {
    Object.assign(this, { shown: null, before: null });
    $('mayday').hidden = true;
  }

  // The red header, and the title that blinks.
  mark() {
    const on = this.count > 0;
    if (document.body.dataset.alarm !== String(on)) document.body.dataset.alarm = String(on);
    if (on && this.blink === null) this.blink = setInterval(() => this.turn(), BLINK_MS);
    if (on || this.blink === null) return;
    clearInterval(this.blink);
    this.blink = null;
    this.isTurned = true;
    this.turn();
  }

  turn() {
    this.isTurned = !this.isTurned;
    document.title = this.isTurned ? `▲ MAYDAY${this.named}` : this.title;
  }

  begin(title, isLive) {
    this.title = title;
    this.bell.invite(isLive, 'This page cannot sound before it is tapped: tap here');
    if (!this.isTurned) document.title = title;
  }
}
