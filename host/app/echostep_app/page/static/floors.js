// SPDX-License-Identifier: MIT
// Floors of the plan as buttons; on a phone more than three are a list. Each with what the role notes beside its name.

import { tr } from './language.js';
import { put } from './text.js';

const MOST_BUTTONS = 3;
const $ = (id) => document.getElementById(id);

export class Floors {
  // `onFloor(level)`: null for all storeys; `hasAll`: they can be chosen
  constructor(onFloor, hasAll) {
    Object.assign(this, { onFloor, hasAll, levels: [] });
    $('floor').onchange = () => onFloor($('floor').value === 'all' ? null : Number($('floor').value));
  }

  plan(levels) {
    this.levels = levels;
    $('floors').hidden = $('floor').hidden = levels.length < 2;
    $('floors').classList.toggle('many', levels.length > MOST_BUTTONS);
    const all = this.hasAll ? [null] : [];
    $('floor').replaceChildren(...all.map(() => new Option(tr('All'), 'all')), ...levels.map(({ name }, level) => new Option(name, level)).reverse());
    $('floors').replaceChildren(...[...levels.keys(), ...all].map((level) => {
      const button = document.createElement('button');
      button.type = 'button';
      button.append(...['span', 'b', 'i'].map((tag) => document.createElement(tag)));  // a name may be cut off, a number may not; a bar
      button.onclick = () => this.onFloor(level);
      if (level === null) Object.assign(button, { id: 'all-floors', textContent: tr('All') });
      return button;
    }));
  }

  // `shown`: the level, or null for all; `note(level)`: `count` behind the name, `option` in the list, `urgent`, `share` of a bar, in words too.
  show(shown, note) {
    $('floor').value = shown ?? 'all';
    $('all-floors')?.setAttribute('aria-pressed', String(shown === null));
    this.levels.forEach(({ name }, level) => {
      const { count = '', option = count, urgent = false, share = 0, words } = note(level), button = $('floors').children[level], [text, number, bar] = button.children;
      const listed = [...$('floor').options].find(({ value }) => value === String(level));
      put(text, name);
      put(number, count);
      bar.style.width = `${100 * share}%`;
      if (listed.text !== name + option) listed.text = name + option;
      button.classList.toggle('urgent', urgent);
      button.setAttribute('aria-pressed', String(level === shown));
      if (words) button.setAttribute('aria-label', `${name}, ${tr(words)}`);
    });
  }
}
