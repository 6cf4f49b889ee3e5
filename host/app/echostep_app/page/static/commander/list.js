// SPDX-License-Identifier: MIT
// The list of wearers and the details of one, in words; and the text for screen readers when a wearer needs help.

import { tr } from '../language.js';
import { clock, put, said, say } from '../text.js';

export const SIGNS = { mayday: '▲', asked: '△', lost: '✕', stale: '◌', uncertain: '◐', waiting: '○', tracking: '●', ended: '■' };
export const CALLS = ['mayday', 'asked'], URGENT = [...CALLS, 'lost', 'stale'];  // calls come above all others, however the list is sorted and whatever is looked for
const MANY = 8;  // more than so many can be sorted and looked through
const ORDERS = { need: () => 0, name: (a, b) => a.name.localeCompare(b.name), floor: (a, b) => (b.level ?? -1) - (a.level ?? -1) };
const $ = (id) => document.getElementById(id);

export class List {
  // `onChoose(id)`, `onSend(id)`: a wearer is chosen; is sent to the chosen one
  constructor(onChoose, onSend) {
    Object.assign(this, { onChoose, onSend, items: new Map(), rows: [], states: new Map(), chosen: null });
    $('close').onclick = () => this.choose(null);
    $('find').oninput = $('sort').onchange = () => this.show(this.rows, this.isRecorded);
  }

  // In the chosen order, those that hold what is looked for; calls for help first.
  sorted(rows) {
    const wanted = $('find').value.trim().toLowerCase(), isCall = ({ state }) => CALLS.includes(state);
    const found = rows.filter((row) => isCall(row) || [row.name, row.team, tr(row.words), ...row.notes.map(tr)].join(' ').toLowerCase().includes(wanted));
    return found.sort((a, b) => isCall(b) - isCall(a) || ORDERS[$('sort').value](a, b));
  }

  // Rows in order of urgency; elements stay, so that focus and scrolling stay. What a recording holds is not announced.
  show(rows, isRecorded) {
    Object.assign(this, { rows, isRecorded });
    const shown = this.sorted(rows), known = new Set(shown.map(({ id }) => id)), focused = document.activeElement, teams = new Set(rows.map(({ team }) => team)).size;
    $('finding').hidden = rows.length <= MANY && !$('find').value;
    for (const [id, item] of this.items) if (!known.has(id)) { item.li.remove(); this.items.delete(id); }
    shown.forEach((row, k) => {
      const item = this.items.get(row.id) ?? this.make(row.id), at = $('list').children[k];
      if (at !== item.li) $('list').insertBefore(item.li, at ?? null);
      item.button.dataset.state = row.state;
      item.button.dataset.open = row.open_alarm;
      put(item.sign, SIGNS[row.state] ?? '!');
      put(item.name, teams > 1 ? `${row.name} (${row.team})` : row.name);
      say(item.said, row.words);
      say(item.note, row.notes.join('; '));
    });
    if (focused?.isConnected && document.activeElement !== focused) focused.focus({ preventScroll: true });
    this.announce(rows, isRecorded);
    if (this.chosen !== null && !rows.some(({ id }) => id === this.chosen)) this.choose(null);
  }

  again() {
    this.shownDetails = this.shownDistress = null;
    this.show(this.rows, this.isRecorded);
  }

  make(id) {
    const li = document.createElement('li');
    li.innerHTML = '<button type="button"><span class="sign" aria-hidden="true"></span><span class="name"></span><span class="said"></span><span class="note"></span></button>';
    const button = li.firstChild, [sign, name, said, note] = button.children, item = { li, button, sign, name, said, note };
    button.onclick = () => this.choose(id);
    this.items.set(id, item);
    return item;
  }

  choose(id) {
    const before = this.chosen;
    this.chosen = id;
    $('list').hidden = $('team').dataset.one = id !== null;
    $('details').hidden = id === null;
    this.shownDetails = null;
    this.head();
    $('all').open = !CALLS.includes(this.rows.find((row) => row.id === id)?.state);
    $('distress').hidden = true;
    $('said').hidden = false;
    $('facts').replaceChildren();
    $('history').replaceChildren();
    if (id !== null) $('close').focus();
    else this.items.get(before)?.button.focus();
    this.onChoose(id);
  }

  head() {
    const row = this.rows.find(({ id }) => id === this.chosen);
    put($('who'), row ? `${SIGNS[row.state] ?? '!'} ${row.name} (${row.team})` : '');
    say($('said'), row?.words ?? '');
    $('acknowledge').hidden = !row?.open_alarm;
  }

  details(details, distress) {
    if (!details || details.id !== this.chosen) return;
    this.head();
    this.distress(distress);
    const text = JSON.stringify(details);
    if (text === this.shownDetails) return;
    this.shownDetails = text;
    $('facts').replaceChildren(...facts(details.facts));
    $('history').replaceChildren(...details.history.map(({ unix_s, text: what }) => {
      const item = document.createElement('li');
      item.textContent = `${clock(unix_s)} ${said(what)}`;
      return item;
    }));
  }

  // What is needed to help: the place, since when, the nearest stairs, and a button for each of the nearest wearers.
  distress(distress) {
    const text = JSON.stringify(distress);
    if ($('distress').hidden === !distress && text === this.shownDistress) return;
    this.shownDistress = text;
    $('distress').hidden = !distress;
    $('said').hidden = Boolean(distress);  // the same in more detail
    if (!distress) return;
    const { place, since, stairs, rescuers } = distress;
    $('needs').replaceChildren(...facts([['place', place], ['since', since], ['stairs', stairs || 'none on this plan'], ['nearest', rescuers.length ? '' : 'nobody with a position on this plan']]
      .filter(([, value]) => value).map(([name, value]) => ({ name, value }))));
    rescuers.forEach(({ id, name, words, sent }, k) => {
      const item = $('rescuers').children[k] ?? $('rescuers').appendChild(rescuer()), button = item.firstChild;
      put(button, `${sent ? '✓ ' : ''}${tr(`Send ${name}${sent ? ' again' : ''}`)}`);
      say(item.lastChild, [words, sent].filter(Boolean).join(', '));
      button.onclick = () => this.onSend(id);
    });
    while ($('rescuers').children.length > rescuers.length) $('rescuers').lastChild.remove();
  }

  // A wearer who has become lost or silent is said once, others are not.
  announce(rows, isRecorded) {
    const said = rows.filter(({ id, state }) => URGENT.includes(state) && this.states.get(id) !== state).map(({ name, words }) => `${name}: ${words}`);
    if (isRecorded) return;
    this.states = new Map(rows.map(({ id, state }) => [id, state]));
    if (said.length) say($('live'), said.slice(0, 3).join('. '));
  }
}

// Terms and descriptions of a list.
function facts(rows) {
  return rows.flatMap(({ name, value }) => [['dt', name], ['dd', value]].map(([tag, of]) => {
    const element = document.createElement(tag);
    element.textContent = said(of);
    return element;
  }));
}

function rescuer() {
  const item = document.createElement('li');
  item.innerHTML = '<button type="button"></button><span></span>';
  return item;
}
