// SPDX-License-Identifier: MIT
// The list of wearers and the details of one, in words; and the text for screen readers when a wearer needs help.

import { put } from './text.js';

export const SIGNS = { mayday: '▲', lost: '✕', stale: '◌', uncertain: '◐', waiting: '○', tracking: '●', ended: '■' };
const URGENT = ['mayday', 'lost', 'stale'];
const $ = (id) => document.getElementById(id);

export class List {
  constructor(onChoose) {
    Object.assign(this, { onChoose, items: new Map(), rows: [], states: new Map(), chosen: null });
    $('close').onclick = () => this.choose(null);
  }

  // Rows in order of urgency; elements stay, so that focus and scrolling stay. What happened in the past is not announced.
  show(rows, isPast) {
    this.rows = rows;
    const known = new Set(rows.map(({ id }) => id)), focused = document.activeElement, teams = new Set(rows.map(({ team }) => team)).size;
    for (const [id, item] of this.items) if (!known.has(id)) { item.li.remove(); this.items.delete(id); }
    rows.forEach((row, k) => {
      const item = this.items.get(row.id) ?? this.make(row.id), at = $('list').children[k];
      if (at !== item.li) $('list').insertBefore(item.li, at ?? null);
      item.button.dataset.state = row.state;
      item.button.dataset.open = row.open_alarm;
      put(item.sign, SIGNS[row.state] ?? '!');
      put(item.name, teams > 1 ? `${row.name} (${row.team})` : row.name);
      put(item.said, row.words);
      put(item.note, row.notes.join('; '));
    });
    if (focused?.isConnected && document.activeElement !== focused) focused.focus({ preventScroll: true });
    this.announce(rows, isPast);
    if (this.chosen !== null && !known.has(this.chosen)) this.choose(null);
  }

  make(id) {
    const li = document.createElement('li'), button = document.createElement('button'), parts = ['sign', 'name', 'said', 'note'].map((name) => {
      const part = document.createElement('span');
      part.className = name;
      return part;
    });
    const [sign, name, said, note] = parts;
    sign.setAttribute('aria-hidden', 'true');
    button.type = 'button';
    button.append(...parts);
    button.onclick = () => this.choose(id);
    li.append(button);
    const item = { li, button, sign, name, said, note };
    this.items.set(id, item);
    return item;
  }

  choose(id) {
    const before = this.chosen;
    this.chosen = id;
    $('list').hidden = id !== null;
    $('details').hidden = id === null;
    this.shownDetails = null;
    this.head();
    $('facts').replaceChildren();
    $('history').replaceChildren();
    if (id !== null) $('close').focus();
    else this.items.get(before)?.button.focus();
    this.onChoose(id);
  }

  head() {
    const row = this.rows.find(({ id }) => id === this.chosen);
    put($('who'), row ? `${SIGNS[row.state] ?? '!'} ${row.name} (${row.team})` : '');
    put($('said'), row?.words ?? '');
    $('acknowledge').hidden = !row?.open_alarm;
  }

  details(details) {
    if (!details || details.id !== this.chosen) return;
    this.head();
    const text = JSON.stringify(details);
    if (text === this.shownDetails) return;
    this.shownDetails = text;
    $('facts').replaceChildren(...details.facts.flatMap(({ name, value }) => [['dt', name], ['dd', value]].map(([tag, of]) => {
      const element = document.createElement(tag);
      element.textContent = of;
      return element;
    })));
    $('history').replaceChildren(...details.history.map(({ unix_s, text: what }) => {
      const item = document.createElement('li');
      item.textContent = `${new Date(1000 * unix_s).toLocaleTimeString('en-GB')} ${what}`;
      return item;
    }));
  }

  // A wearer who has become lost or silent is said once, others are not.
  announce(rows, isPast) {
    const said = rows.filter(({ id, state }) => URGENT.includes(state) && this.states.get(id) !== state).map(({ name, words }) => `${name}: ${words}`);
    if (isPast) return;
    this.states = new Map(rows.map(({ id, state }) => [id, state]));
    if (said.length) put($('live'), said.slice(0, 3).join('. '));
  }
}
