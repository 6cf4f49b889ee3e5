// SPDX-License-Identifier: MIT
// Text around the map: status, position, stream rates, beacons, guidance; and the text for screen readers.

import { drawnText } from './drawing.js';
import { marksText } from '../marks.js';
import { tr } from '../language.js';
import { said, say, tell } from '../text.js';

const SPOKEN_MS = 8000;  // shortest time between two positions for a screen reader
const FASTEST_RAD_S = Math.PI;  // of the guidance arrow's turn
const LEAST_RAD = 0.01;  // the arrow ignores smaller changes
const $ = (id) => document.getElementById(id);

export class Panel {
  // `status(name, words)`: shows it
  constructor({ status }) {
    this.status = status;
    this.spoken = { at: -Infinity, status: '', text: '' };
    this.turn = 0;  // angle of the arrow in radians, not wrapped, so that the transition takes the short way
  }

  hello({ title, plan }) {
    this.plan = plan;
    this.shownGoal = null;
    document.title = title;
    $('goal').replaceChildren(new Option(tr('Go to…'), ''), new Option(tr('Way out'), 'exit'), new Option(tr('a place on the map'), 'map'),
      ...plan.levels.flatMap(({ rooms, name }, level) => rooms.map((room, k) => new Option(plan.levels.length > 1 ? `${room.name} (${name})` : room.name, `${level} ${k}`))));
  }

  frame({ told: estimate, words: said, gait, streams, guidance, goal, beams, beacons, play, ended, alarm, errand }) {
    const status = ended ? 'ended' : estimate?.status ?? 'waiting', words = ended ? `ended: ${ended}${play ? '. ▶ plays it again' : ''}` : said;
    this.status(status, words);
    say($('place'), estimate ? positionText(estimate, this.plan.levels) : '');
    say($('echoes'), estimate ? echoText(beams, estimate.placed) : '');
    say($('health'), streams ? rateText(streams) : 'no bytes yet');
    tell($('places'), estimate?.places ?? '');
    tell($('gait'), gait);
    tell($('wrong'), streams?.wrong ?? '');
    tell($('beacons'), beaconText(beacons));
    tell($('errand'), errand);
    this.alarm(alarm);
    this.guidance(guidance);
    this.goal(goal);
    this.announce(`${status} ${streams?.wrong ?? ''}`, [words, estimate?.where, streams?.wrong].filter(Boolean).join('. '));
  }

  // The marks that commanders have set; a screen reader says them when they change.
  marks(marks) { tell($('marks'), marksText(marks, this.plan.levels)); }

  drawing(drawing) { tell($('drawn'), drawnText(drawing)); }

  // The teammates who can be met: a list that is there only when there are any.
  team(names) {
    $('met').hidden = !names.length;
    $('met').replaceChildren(new Option(tr('I met…'), ''), ...names.map((name) => new Option(name, name)));
  }

  alarm(alarm) {
    $('alarm').hidden = !alarm;
    if (!alarm) return;
    $('alarm').dataset.kind = alarm.kind;
    $('fine').hidden = alarm.kind === 'over';
    say($('alarm-text'), alarm.text);
  }

  // The arrow is relative to the heading: up is straight ahead.
  guidance(guidance) {
    $('guidance').hidden = !guidance;
    if (!guidance) return;
    const { kind, text, arrow_rad, left_m, own } = guidance;
    $('guidance').dataset.kind = kind;
    $('turn').dataset.sign = arrow_rad !== null ? 'arrow' : { arrived: 'there', looking: 'look' }[kind] ?? 'halt';
    const by = arrow_rad === null ? 0 : Math.atan2(Math.sin(-arrow_rad - this.turn), Math.cos(-arrow_rad - this.turn));
    if (Math.abs(by) > LEAST_RAD) {
      this.turn += by;
      $('arrow').style.transition = `transform ${0.2 + Math.abs(by) / FASTEST_RAD_S}s ease-out`;
      $('arrow').style.transform = `rotate(${this.turn}rad)`;
    }
    say($('cue'), text);
    say($('left'), left_m === null ? '' : `${left_m < 0.95 ? left_m.toFixed(1) : left_m.toFixed(0)} m to go`);
    $('end-guidance').hidden = !own;
  }

  // The list of places shows the destination of the run, whichever page chose it.
  goal(goal) {
    const text = JSON.stringify(goal);
    if (text === this.shownGoal) return;
    this.shownGoal = text;
    $('goal').value = goal ? this.optionOf(goal) : '';
  }

  optionOf(goal) {
    if (goal === 'exit') return goal;
    const { x_m, y_m, level } = goal;
    const room = this.plan.levels[level].rooms.findIndex(({ at_m: [x, y] }) => x === x_m && y === y_m);
    return room < 0 ? 'map' : `${level} ${room}`;
  }

  // Text for screen readers: at once when the status has changed, else not more often than every SPOKEN_MS.
  announce(status, text) {
    const now = performance.now(), { spoken } = this;
    if (text === spoken.text || (status === spoken.status && now - spoken.at < SPOKEN_MS)) return;
    this.spoken = { at: now, status, text };
    $('live').textContent = said(text);
  }
}

function positionText(estimate, levels) {
  if (!estimate.placed) return 'no position';
  const floor = levels.length > 1 ? levels[estimate.level].name : '';
  const safe = estimate.protection_m === null ? '' : `within ${length(estimate.protection_m)}`;
  return [[estimate.where, floor].filter(Boolean).join(', '), `x ${estimate.x_m.toFixed(1)}, y ${estimate.y_m.toFixed(1)} m`, safe, estimate.heading].filter(Boolean).join(' · ');
}

// What the plan predicts is that of a place: without one only the measured range.
function echoText(lines, placed) {
  const ranges = ({ measured_m, expected_m }) => `${length(measured_m)}${placed ? `, plan ${length(expected_m)}` : ''}`;
  const texts = lines.map((line) => `${line.ranger ? 'right' : 'left'} ${ranges(line)}`);
  return texts.length ? texts.join(' · ') : 'no echoes';
}

// How many beacons are heard, and the numbers of those that are silent or moved.
function beaconText(beacons) {
  const of = (state) => beacons.filter((beacon) => beacon.state === state).map(({ number }) => number).join(', ');
  const own = beacons.filter(({ by }) => !by), names = [...new Set(beacons.map(({ by }) => by).filter(Boolean))].join(', ');
  const heard = own.length && `beacons: ${own.filter((beacon) => beacon.heard).length} of ${own.length} heard`;
  return [heard, names && `beacons of ${names}: ${beacons.length - own.length}`, of('silent') && `silent: ${of('silent')}`, of('moved') && `moved: ${of('moved')}`].filter(Boolean).join(' · ');
}

const length = (metres) => (metres === null ? 'none' : `${metres.toFixed(2)} m`);

function rateText({ foot, mtx_hz, pings_hz, lost, rejected, late_pings, synchronised }) {
  const rate = (value, unit) => (value === null ? '…' : `${Math.round(value)}${unit}`);
  const late = late_pings ? ` · ${late_pings} late` : '';
  return `${foot} ${rate(mtx_hz, ' Hz')}${pings_hz === null ? '' : ` · pings ${rate(pings_hz, '/s')}`} · drops ${lost}${late} · bad ${rejected}${foot !== 'MTx' ? '' : synchronised ? ' · SyncOut' : ' · no SyncOut'}`;
}
