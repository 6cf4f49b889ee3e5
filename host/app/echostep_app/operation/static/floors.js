// SPDX-License-Identifier: MIT
// Floors of the plan: for each a button with the number of wearers on it, and a sign when one of them needs help; on a phone more than three are a list. The last one shows all storeys.

import { tr } from '../static/language.js';
import { put } from '../static/text.js';

const MOST_BUTTONS = 3;
const URGENT = ['mayday', 'asked', 'lost', 'stale'];
const $ = (id) => document.getElementById(id);

export class Floors {
  // `onFloor(level)`: null for all storeys
  constructor(onFloor) {
    this.onFloor = onFloor;
    $('floor').onchange = () => onFloor($('floor').value === 'all' ? null : Number($('floor').value));
  }

  plan(levels) {
    this.levels = levels;
    $('floors').hidden = $('floor').hidden = levels.length < 2;
    $('floors').classList.toggle('many', levels.length > MOST_BUTTONS);
    $('floor').replaceChildren(new Option(tr('All'), 'all'), ...levels.map(({ name }, level) => new Option(name, level)).reverse());
    $('floors').replaceChildren(...[...levels.keys(), null].map((level) => {
      const button = document.createElement('button');
      button.type = 'button';
      button.append(document.createElement('span'), document.createElement('b'));  // a name may be cut off, a number may not
      button.onclick = () => this.onFloor(level);
      if (level === null) Object.assign(button, { id: 'all-floors', textContent: tr('All') });
      return button;
    }));
  }

  show(shown, rows) {
    if (!this.levels) return;
    $('floor').value = shown ?? 'all';
    $('all-floors').setAttribute('aria-pressed', String(shown === null));
    this.levels.forEach(({ name }, level) => {
      const here = rows.filter((row) => row.level === level), urgent = here.some(({ state }) => URGENT.includes(state));
      const count = `${here.length ? `: ${here.length}` : ''}${urgent ? ' !' : ''}`, button = $('floors').children[level];
      const option = [...$('floor').options].find(({ value }) => Number(value) === level);
      [name, count].forEach((text, k) => put(button.children[k], text));
      if (option.text !== name + count) option.text = name + count;
      button.classList.toggle('urgent', urgent);
      button.setAttribute('aria-pressed', String(level === shown));
    });
  }
}
