// SPDX-License-Identifier: MIT
// Crews and their accountability check (PAR): who is inside, since when, when it last answered, how much of the planned air is left. What is due is said.

import { dialogOf } from '../dialog.js';
import { minutes, tr } from '../language.js';
import { put, say } from '../text.js';

const CHECK_SHARE = 1 / 3;  // of the planned air until a check is due: the crew is reminded of its pressures after one and after two thirds [FwDV 7, 7.4]
const ORDER = ['over', 'due', 'inside', 'ready', 'out'];
const SIGNS = { over: '▲', due: '△', inside: '●', ready: '○', out: '■' };
const DOES = { enter: 'Enters', check: 'Answered', leave: 'Is out' };
const $ = (id) => document.getElementById(id);
const HTML = `<div tabindex="0" role="group" aria-label="Crews inside, and accountability check">
  <p id="crew-sum"></p>
  <ul id="crew-list"></ul>
  <form id="crew-new"><h3>New crew</h3>
    <label>Name <input id="crew-name" maxlength="32" required></label>
    <label>Members <input id="crew-members" maxlength="260" placeholder="Anna, Bo"></label>
    <label>Planned air, min <input id="crew-air" type="number" min="1" max="600" value="30" required></label>
    <button>Add</button></form>
</div>`;

export class Crews {
  // `signed(act)`: calls `act` with the commander's name; `send(kind, fields)`: a request to the server
  constructor(signed, send) {
    Object.assign(this, { signed, send, crews: [], items: new Map(), dialog: dialogOf('crews', 'Crews', HTML), said: '' });
    $('crews-button').onclick = () => this.dialog.showModal();
    $('crew-new').onsubmit = (e) => { e.preventDefault(); this.add(); };
  }

  act(kind, fields) { this.signed((by) => this.send(kind, { ...fields, by })); }

  add() {
    const members = $('crew-members').value.split(',').map((name) => name.trim().slice(0, 32)).filter(Boolean).slice(0, 8);
    this.act('crew', { name: $('crew-name').value.trim(), members, air_min: Number($('crew-air').value) });
    $('crew-name').value = $('crew-members').value = '';
  }

  // `unix_s`: of the frame, which is not the clock's in a recorded operation.
  show(crews, unix_s, isRecorded) {
    if (crews) this.crews = crews;
    const shown = this.crews.map((crew) => ({ ...crew, ...stateOf(crew, unix_s) })).sort((a, b) => ORDER.indexOf(a.state) - ORDER.indexOf(b.state));
    const known = new Set(shown.map(({ id }) => id));
    for (const [id, item] of this.items) if (!known.has(id)) { item.remove(); this.items.delete(id); }
    shown.forEach((crew, k) => {
      const item = this.items.get(crew.id) ?? this.make(crew.id);
      if ($('crew-list').children[k] !== item) $('crew-list').insertBefore(item, $('crew-list').children[k] ?? null);
      item.dataset.state = crew.state;
      [`${SIGNS[crew.state]} ${crew.name}`, tr(crew.words), crew.members.join(', ')].forEach((text, j) => put(item.children[j], text));
      const inside = ['over', 'due', 'inside'].includes(crew.state);
      [...item.lastChild.children].forEach((button) => { button.hidden = (button.dataset.does === 'enter') === inside; });
    });
    this.sum(shown, isRecorded);
  }

  sum(shown, isRecorded) {
    const urgent = shown.filter(({ state }) => ['over', 'due'].includes(state)), inside = shown.filter(({ state }) => !['ready', 'out'].includes(state)).length;
    say($('crew-sum'), shown.length ? `${inside} inside${urgent.length ? `, ${urgent.length} to be asked now` : ''}` : 'No crew yet.');
    put($('crews-button'), `${tr('Crews')}${inside ? ` ${inside}` : ''}${urgent.length ? ' !' : ''}`);
    $('crews-button').classList.toggle('urgent', urgent.length > 0);
    const text = isRecorded ? '' : urgent.slice(0, 3).map(({ name, state }) => `${name}: ${state === 'over' ? 'planned air is over' : 'check due'}`).join('. ');
    say($('crew-due'), text);
    if ($('crew-due').hidden !== !text) $('crew-due').hidden = !text;
  }

  make(id) {
    const item = document.createElement('li'), row = document.createElement('p');
    item.append(...['b', 'span', 'small'].map((tag) => document.createElement(tag)), row);
    row.className = 'row';
    row.append(...Object.entries(DOES).map(([does, text]) => {
      const button = document.createElement('button');
      Object.assign(button, { type: 'button', textContent: does === 'check' ? `✓ ${tr(text)}` : tr(text), onclick: () => this.act('crew_does', { id, does }) });
      button.dataset.does = does;
      return button;
    }));
    this.items.set(id, item);
    return item;
  }
}

// State of a crew at a time, and its times in words.
function stateOf({ entered_s, checked_s, left_s, air_min }, unix_s) {
  if (entered_s === null) return { state: 'ready', words: `ready, air for ${air_min} min` };
  if (left_s !== null) return { state: 'out', words: `out after ${minutes(left_s - entered_s)}` };
  const left = 60 * air_min - (unix_s - entered_s), since = unix_s - (checked_s ?? entered_s);
  const state = left <= 0 ? 'over' : since >= CHECK_SHARE * 60 * air_min ? 'due' : 'inside';
  const air = left <= 0 ? `planned air over for ${minutes(-left)}` : `planned air ${minutes(left)} left`;
  return { state, words: `inside ${minutes(unix_s - entered_s)}, ${checked_s > entered_s ? `answered ${minutes(since)} ago` : 'not asked yet'}, ${air}${state === 'due' ? ': ask now' : ''}` };
}
