// SPDX-License-Identifier: MIT
// The wearer's part of the page: where the wearer is and may be, echoes, guidance, speech, alarm, positions that are entered, charts.

import { onHeld } from '../held.js';
import { LIVE, LIVE_KEYS } from '../legend.js';
import { Charts } from '../tools/charts.js';
import { Drops } from '../tools/drop.js';
import { readLink } from '../tools/hash.js';
import { Layers } from '../tools/layers.js';
import { Tools } from '../tools/tools.js';
import { WearerPainter } from './layers.js';
import { Orders } from './orders.js';
import { Panel } from './panel.js';
import { Speech } from './speech.js';
import { Taps } from './taps.js';
import { extend, parseFrame } from './wire.js';

const BESIDE = 0.1;  // share of the free part, where only what lies over the map hides some of the plan
const HINTS = { here: 'Stand still. Tap where you are, drag in the direction you face.', go: 'Tap where you want to go.', measure: 'Tap two places.' };
const TITLES = { follow: 'F', here: 'H', goal: 'G', 'tools-button': 'T', 'tool-measure': 'D', 'tool-charts': 'C' };
const $ = (id) => document.getElementById(id);

export class Wearer {
  // `page`: of main.js. Modes: null, 'here' (a tap gives the wearer's position, a drag the heading too), 'go' (a tap gives the destination), 'measure'.
  constructor(page) {
    const { send, hint, seek, view, planView, scene } = page;
    Object.assign(scene, { cloud: null, drawing: null, trail: { points: new Float32Array(3072), count: 0 }, tapped: null, layers: new Layers() });
    Object.assign(this, { page, parse: parseFrame, legend: LIVE, keyNames: LIVE_KEYS, titles: TITLES, mode: null, follows: true, turned: 0, arrived: false, invited: false, broken: false, metNumber: 0 });
    this.linked = readLink(location.hash);
    this.moment = this.linked?.t_s ?? null;
    this.painter = new WearerPainter($('canvas'));
    this.panel = new Panel(page);
    this.taps = new Taps(view, {
      send, changed: () => { scene.tapped = this.taps.ghost; page.ask(); }, mayCheckIn: () => !$('here').hidden, globe: () => page.globe,
      keptHeading: () => (this.estimate?.heading_known ? this.estimate.heading_rad : null),
    });
    this.speech = new Speech($('speech'), $('sentence'), $('invitation'), $('unspoken'));
    this.orders = new Orders(send, (text) => this.speech.unsent(text));
    this.drops = new Drops(hint);
    this.charts = new Charts($('charts'), () => this.painter.colour, seek);
    this.tools = new Tools({ view, scene, planView, layers: scene.layers, charts: this.charts, hint, seek, enter: (mode) => this.enter(mode), changed: () => view.changed(), plan: () => page.plan, globe: () => page.globe, takesFiles: () => this.drops.takes });
    this.shown = { charts: this.charts };
    this.wire();
  }

  wire() {
    const { page, charts } = this, { send, hint } = page;
    const turn = (by) => { this.turned += by; page.ask(); };
    this.keys = {
      t: () => this.tools.open(), c: () => this.tools.setCharts(!charts.on), d: () => this.enter('measure', true), f: () => this.toggleFollow(),
      h: () => !$('here').hidden && this.enter('here', true), g: () => this.enter('go', true), Escape: () => this.enter(null),
      Enter: () => this.take(), ',': () => turn(Math.PI / 12), '.': () => turn(-Math.PI / 12),
    };
    $('here').onclick = (e) => this.enter(this.mode === 'here' ? null : 'here', e.detail === 0);
    $('follow').onclick = () => this.toggleFollow();
    onHeld($('help'), () => send('call', { help: true }), () => hint('Hold Help! for a second.', 4000));
    $('fine').onclick = () => send('call', { help: false });
    $('end-guidance').onclick = () => send('go_nowhere');
    $('met').onchange = () => {
      if ($('met').value) send('met', { name: $('met').value });
      $('met').value = '';
    };
    $('way-out').onclick = () => this.goalChosen('exit');
    $('goal').onchange = () => this.goalChosen($('goal').value);
    const tapped = (kind) => () => {
      const { x_m, y_m, level } = this.taps.ghost;
      this.taps.drop();
      send(kind, { x_m, y_m, level });
    };
    $('sheet-go').onclick = tapped('go_to');
    $('sheet-strike').onclick = tapped('strike');
  }

  get estimate() { return this.page.scene.frame?.told; }
  get level() { return this.linked?.level; }

  startAnew() {
    this.page.scene.cloud = null;
    this.arrived = false;
    this.taps.drop();
  }

  hello(message) {
    const { page, panel } = this, { isLive, scene } = page;
    scene.trail.count = 0;
    scene.drawing = null;
    Object.assign(this, { invited: false, broken: false });
    panel.hello(message);
    $('here').hidden = $('sheet-here').hidden = $('help').hidden = !isLive;
    this.drops.show(message.takes_files, !message.replay);
    if (!isLive) panel.team([]);
    this.speech.invite(isLive);
    this.taps.reconnected();
    this.charts.clear();
  }

  // The view of the link by which the page was opened; its moment comes when the replay has got so far.
  shownAll() {
    if (!this.linked) return;
    const { x, y, scale, turn } = this.linked, { view } = this.page;
    this.setFollows(false);
    Object.assign(view, { x, y, scale, turn });
    view.changed();
    this.linked = null;
  }

  fitted() {
    this.fittedScale = this.page.view.scale;
    this.arrive();
  }

  // The first estimate in a view that is still as it was fitted.
  arrive() {
    const { view, planView, isFitted } = this.page, { estimate } = this;
    if (this.arrived || !isFitted || !estimate?.placed) return;
    this.arrived = true;
    if (view.scale === this.fittedScale && !this.linked) view.approach(estimate.x_m, estimate.y_m, planView.box);
  }

  failed(ended) { this.broken = Boolean(ended); }  // by the error that ended the run
  considered(answer) { this.taps.considered(answer); }
  unsent(text) { this.speech.unsent(text); }
  recoloured() { this.charts.paint(); }

  inOtherUnit() {
    if (this.page.scene.frame) this.panel.frame(this.page.scene.frame);
    this.page.view.changed();
  }

  // Without news there is no way to go, and no claim.
  aged() {
    const { page } = this, { scene, link } = page, { pulse, isOpen } = link;
    if (scene.isOld && scene.frame?.guidance) {
      const text = 'Stop. There is nothing from the tracker.', stopped = { ...scene.frame.guidance, kind: 'stop', text, arrow_rad: null, left_m: null, spoken: text, spoken_s: null };
      this.panel.guidance(stopped);
      this.speech.update(stopped);
    }
    if (this.broken) page.status('ended', 'ended by an error');
    else if (scene.isOld) page.status('lost', `no position for ${pulse.ago}`);
    else if (!isOpen) page.status('waiting', 'not connected');
  }

  frame(received) {
    const { page, panel, speech } = this, { scene } = page, { cloud, drawing, team, met, marks, play, alarm, words } = received;
    if (cloud) scene.cloud = cloud;
    if (drawing) panel.drawing(scene.drawing = drawing.path.length ? drawing : null);
    if (team) panel.team(team);
    if (met && met.number !== this.metNumber) {
      this.metNumber = met.number;
      page.hint(met.text, 8000);
    }
    if (marks) panel.marks(marks);
    extend(scene.trail, received.trail);
    speech.alarm(play ? null : alarm);
    const leaves = !play && received.goal === 'exit';
    if (leaves && !this.leaves) speech.set(true);
    this.leaves = leaves;
    if (!alarm) speech.update(received.guidance, this.orders.isUrgent);
    if (!play && !alarm) speech.sent(received.errand);
    this.orders.show(play ? [] : received.orders, leaves ? received.guidance : null);
    panel.frame(received);
    this.taps.undoable(received.undo);
    page.showFloors();
    this.charts.frame(play);
    if (this.moment !== null && play?.end_s >= this.moment) {
      page.send('play', { playing: false });
      page.seek(this.moment);
      this.moment = null;
    }
    if (!this.estimate && !this.invited && words.startsWith('tap')) {
      this.invited = true;
      this.enter('here');
    }
  }

  floorNote(level) {
    const share = this.estimate?.levels?.[level] ?? 0, percent = Math.round(100 * share);
    return { option: percent ? ` ${percent} %` : '', share, words: `${percent} % likely` };
  }

  floorChosen(level) {
    this.setFollows(false);
    this.page.showLevel(level);
  }

  follow() {
    const { page, estimate } = this, { view, planView, scene } = page;
    if (this.takesPose() && !$('cross').hidden) this.taps.aim(this.middle, this.heading);
    if (!estimate || !this.follows || this.mode || this.taps.ghost) return;
    this.arrive();
    if (estimate.placed && !view.shows(planView.box)) view.keep(estimate.x_m, estimate.y_m, view.shows(planView.box, view.all) ? BESIDE : undefined);
    if (estimate.level !== scene.level && estimate.level !== page.wantedLevel) page.showLevel(estimate.level);
  }

  paint() {
    const { page, estimate } = this, { view, planView, scene } = page;
    $('rooms').toggleAttribute('hidden', !scene.layers.shows('names'));
    const signs = [...(estimate?.placed ? [estimate] : []), ...(estimate?.hypotheses ?? [])].filter(({ level }) => level === scene.level);
    planView.names(view, signs.map(({ x_m, y_m }) => view.toScreen(x_m, y_m)));
    this.painter.paint(view, scene);
  }

  get middle() {
    const { view } = this.page;
    return view.toMap(view.width / 2, view.height / 2);
  }

  get heading() { return this.mode === 'here' ? this.turned : null; }

  enter(next, byKey = false) {
    const { page } = this, { scene } = page;
    this.mode = next;
    this.taps.drop();
    $('here').setAttribute('aria-pressed', String(next === 'here'));
    $('map').classList.toggle('takes', next !== null);
    $('cross').hidden = !(next && byKey);
    $('goal').value = next === 'go' ? 'map' : scene.frame?.goal ? this.panel.optionOf(scene.frame.goal) : '';
    page.hint(HINTS[next] ?? '', 0);
    if (next === 'measure') scene.measure.clear();
    page.view.changed();
  }

  // What the cross is on.
  take() {
    if (this.mode === 'measure') this.page.measured(this.middle);
    else if (this.mode) this.posed(this.middle, this.heading);
  }

  takesPose() { return this.mode === 'here' || this.mode === 'go'; }

  posing(position, heading_rad) { this.taps.aim(position, heading_rad); }

  posed(position, heading_rad) {
    const before = this.mode, { level } = this.page.scene;
    this.enter(null);
    if (before === 'go') return this.go(position, level);
    this.taps.put(position, heading_rad, level);
    $('sheet-here').focus({ preventScroll: true });
  }

  tapped(position) {
    if (this.mode === 'measure') this.page.measured(position);
    else this.taps.put(position, null, this.page.scene.level);
  }

  moved() {
    this.setFollows(false);
    this.taps.moved();
  }

  go([x_m, y_m], level) { this.page.send('go_to', { x_m, y_m, level }); }

  goalChosen(value) {
    if (value === 'map') return this.enter('go', true);
    this.enter(null);
    if (!value) return this.page.send('go_nowhere');
    if (value === 'exit') return this.page.send('go_out');
    const [level, room] = value.split(' ').map(Number);
    $('goal').value = value;
    return this.go(this.page.plan.levels[level].rooms[room].at_m, level);
  }

  setFollows(on) {
    this.follows = on;
    this.page.ask();
    $('follow').setAttribute('aria-pressed', String(on));
  }

  // The whole plan, and the whole track and drawing where these lead out of it.
  fitWhole() {
    this.setFollows(false);
    const { view, planView, scene } = this.page, { points, count } = scene.trail, walls = scene.drawing?.walls ?? [];
    const box = planView.isEmpty && scene.drawing ? [Infinity, Infinity, -Infinity, -Infinity] : [...planView.box];
    const add = (x, y) => { if (Number.isNaN(x)) return; box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y); box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y); };
    for (let k = 0; k < count; k++) add(points[3 * k], points[3 * k + 1]);
    for (let k = 0; k < walls.length; k += 5) { add(walls[k], walls[k + 1]); add(walls[k + 2], walls[k + 3]); }
    view.fit(box);
  }

  toggleFollow() {
    const { estimate } = this, { view, planView } = this.page;
    this.setFollows(!this.follows);
    if (this.follows && estimate && !view.shows(planView.box)) view.centre(estimate.x_m, estimate.y_m);
  }
}
