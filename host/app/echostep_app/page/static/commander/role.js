// SPDX-License-Identifier: MIT
// The commander's part of the page: the wearers on the map and in a list, alarms, orders, marks, crews.

import { COMMAND, COMMAND_KEYS } from '../legend.js';
import { say, tell } from '../text.js';
import { Alarm } from './alarm.js';
import { Crews } from './crews.js';
import { CALLS, List, URGENT } from './list.js';
import { Orders } from './orders.js';
import { Sheet } from './sheet.js';
import { Storeys } from './storeys.js';
import { Trails } from './trails.js';
import { TeamPainter } from './wearers.js';
import { parseFrame, placesOf } from './wire.js';

const TAP_PX = 28;  // a wearer within this distance of a tap is chosen
const $ = (id) => document.getElementById(id);

export class Commander {
  // `page`: of main.js
  constructor(page) {
    const { send, hint, scene, view } = page;
    Object.assign(scene, { places: new Map(), rows: [], chosen: null });
    Object.assign(this, { page, parse: parseFrame, hasAllFloors: true, takesHidden: true, legend: COMMAND, keyNames: COMMAND_KEYS, titles: { 'crews-button': 'P' }, found: false });
    this.painter = new TeamPainter($('canvas'));
    this.trails = new Trails($('trails'), $('trails-next'));
    this.storeys = new Storeys();
    this.sheet = new Sheet(send, hint, { words: (x, y) => page.globe?.words(x, y), measure: page.measured });
    const signed = (act) => this.sheet.signed(act);
    this.list = new List((id) => this.choose(id), (id) => signed((by) => send('send', { id, to: scene.chosen, by })));
    this.alarm = new Alarm(view, {
      show: (place) => this.goTo(place), open: (id) => this.list.choose(id), level: () => page.wantedLevel, showLevel: (level) => this.floorChosen(level), floor: (level) => page.plan.levels[level].name,
    });
    this.crews = new Crews(signed, send);
    this.orders = new Orders(signed, send, () => scene.chosen, hint);
    this.shown = { storeys: this.storeys };
    this.keys = { m: () => this.markMiddle(), p: () => $('crews-button').click(), v: () => $('all-floors').click(), Escape: () => { this.sheet.close(); this.list.choose(null); } };
    $('acknowledge').onclick = () => signed((by) => send('acknowledge', { id: scene.chosen, by }));
  }

  get isStacked() { return this.storeys.on; }

  hello({ title }) {
    const { page } = this;
    this.trails.clear();
    this.alarm.begin(title, page.isLive);
    if (page.scene.chosen !== null) page.send('choose', { id: page.scene.chosen });
  }

  startAnew() {
    this.found = false;
    this.storeys.clear();
    this.stacked();
  }

  fitWhole() { this.page.view.fit(this.page.planView.box); }

  async floorChosen(level) {
    const { page } = this;
    if (level === null) await this.storeys.open(page.plan.levels, page.lines);
    else this.storeys.on = false;
    this.stacked();
    if (level !== null && level !== page.wantedLevel) page.showLevel(level);
  }

  stacked() {
    $('map').classList.toggle('stacked', this.storeys.on);
    this.page.showFloors();
    this.page.view.changed();
  }

  // The number of wearers on a floor, and a sign when one of them needs help.
  floorNote(level) {
    const here = this.page.scene.rows.filter((row) => row.level === level), urgent = here.some(({ state }) => URGENT.includes(state));
    return { count: `${here.length ? `: ${here.length}` : ''}${urgent ? ' !' : ''}`, urgent };
  }

  // Without news no row is heard now, and the radii are of then.
  aged(isNew) {
    const { page } = this, { scene, link } = page, { pulse, isOpen } = link;
    if (scene.frame && isNew) this.list.show(scene.isOld ? scene.rows.map(then) : scene.rows, page.isReplay);
    if (!pulse.isSilent && isOpen) return scene.frame && this.status(scene.frame);
    page.status('broken', scene.isOld ? `no news for ${pulse.ago}` : 'this page is not connected');
  }

  frame(received) {
    const { page, trails } = this, { scene, link } = page, { list, unix_s, details, distress } = received;
    scene.places = placesOf(received.places);
    if (!received.trail_from) trails.clear();
    trails.add(received.trail, unix_s);
    if (list) this.rows(list);
    this.orders.show(received.order, unix_s);
    this.orders.log(received.log);
    link.outbox.wait(received.waiting);
    this.crews.show(received.crews, unix_s, page.isReplay);
    this.list.details(details, distress);
  }

  // The page begins on the floor of the most urgent wearer.
  rows(rows) {
    const { page } = this, { scene } = page;
    scene.rows = rows;
    this.list.show(rows, page.isReplay);
    page.showFloors();
    const first = rows.find(({ level }) => level !== null);
    if (first && !this.found && first.level !== page.wantedLevel) page.showLevel(first.level);
    this.found ||= Boolean(first);
    if (!page.isReplay) this.alarm.update(rows, scene.places);
  }

  status({ summary, refused, connected, fault }) {
    this.page.status(connected ? 'tracking' : 'broken', connected ? 'connected' : 'no broker: the last known state');
    say($('summary'), (this.page.isReplay ? 'recorded: ' : '') + summary);
    tell($('refused'), [fault, refused && `rejected: ${refused}`].filter(Boolean).join('; '));
  }

  choose(id) {
    const { scene, send, ask } = this.page, place = scene.places.get(id);
    scene.chosen = id;
    ask();
    send('choose', { id });
    if (place) this.goTo(place);
  }

  // The floor and the place of a wearer come into view.
  goTo({ x, y, level }) {
    this.floorChosen(level);
    this.page.view.keep(x, y);
  }

  // The list and the details are sent anew, also while nothing happens in them.
  inOtherUnit() {
    this.list.again();
    this.page.send('choose', { id: this.page.scene.chosen });
    this.page.view.changed();
  }

  follow() { this.alarm.keep(this.page.scene.places); }

  paint() {
    const { page, painter, storeys, trails } = this, { scene, view } = page;
    const here = scene.rows.filter(({ id }) => scene.places.has(id) && (storeys.on || scene.places.get(id).level === scene.level)).map((row) => {
      const place = scene.places.get(row.id);
      return scene.isOld ? { ...then(row), place: { ...place, heading: NaN, radius: NaN, protection: NaN } } : { ...row, place };
    });
    if (storeys.on) storeys.paint(painter, view, here, scene.chosen);
    else {
      page.planView.names(view, here.map(({ place }) => view.toScreen(place.x, place.y)));
      trails.paint(view, scene.level, painter.colour.trail);
      painter.paint(view, here, trails.points(scene.chosen), scene);
    }
    if (trails.isBehind) page.ask();
  }

  moved() {
    this.sheet.close();
    this.alarm.isLeft = true;
  }

  tapped(position, pixel) {
    const { storeys } = this, { scene, measured } = this.page;
    if (storeys.on) {
      if (!storeys.stamp) return;  // not painted yet
      const { id, level } = storeys.at(pixel, TAP_PX);
      return id === undefined ? this.floorChosen(level) : this.list.choose(id);
    }
    if (scene.measure.points.length === 1) return measured(position);
    const near = this.nearest(this.painter.shown ?? [], pixel, ({ at }) => at);
    if (near) this.list.choose(near.id);
    else this.open(position, pixel);
  }

  // The nearest within reach of a pixel; `at`: theirs.
  nearest(all, [sx, sy], at) {
    const far = (one) => { const [x, y] = at(one); return Math.hypot(x - sx, y - sy); };
    return all.filter((one) => far(one) < TAP_PX).sort((a, b) => far(a) - far(b))[0];
  }

  // What can be done at a place: with the mark that is there, or a new one.
  open([x_m, y_m], pixel) {
    const { scene, view } = this.page, mark = this.nearest(scene.marks.filter(({ level }) => level === scene.level), pixel, ({ x_m, y_m }) => view.toScreen(x_m, y_m));
    this.sheet.open({ x_m, y_m, level: scene.level }, mark, pixel, [view.width, view.height]);
  }

  markMiddle() {
    const { view } = this.page, middle = [view.width / 2, view.height / 2];
    if (this.storeys.on) return;
    this.open(view.toMap(...middle), middle);
    $('mark-cleared').focus();
  }
}

// A row while nothing is heard.
const then = (row) => ({ ...row, state: CALLS.includes(row.state) ? row.state : 'stale', words: row.words.replace(/(, )?heard now$/, '') });
