// SPDX-License-Identifier: MIT
// Orders to the wearers: everybody out, by a button that is held, and who has understood; a note in words to the chosen wearer, or to the log.

import { onHeld } from '../held.js';
import { minutes } from '../language.js';
import { clock, say } from '../text.js';

const MOST_NAMES = 6;
const $ = (id) => document.getElementById(id);

export class Orders {
  // `signed(act)`: calls `act` with the commander's name; `send(kind, fields)`: a request to the server; `chosen()`: number of a wearer
  constructor(signed, send, chosen, onHint) {
    onHeld($('out'), () => signed((by) => send('order', { by })), () => onHint('Hold Everybody out for a second.'));
    $('everybody-end').onclick = () => signed((by) => send('order', { by, ended: true }));
    const written = (name, act) => {
      $(`${name}-form`).onsubmit = (e) => {
        e.preventDefault();
        const [field] = e.target.elements, text = field.value.trim();
        if (text) signed((by) => { act({ by, text }); field.value = ''; });
      };
    };
    written('note', (fields) => send('order', { ...fields, to: chosen() }));
    written('log', (fields) => send('log', fields));
  }

  // Notes as they were written: they are in no catalogue.
  log(notes) {
    if (notes) $('log-list').replaceChildren(...notes.map(({ unix_s, text }) => Object.assign(document.createElement('li'), { textContent: `${clock(unix_s)} ${text}` })));
  }

  show(order, unix_s) {
    if ($('everybody').hidden !== !order) $('everybody').hidden = !order;
    if (!order) return;
    const { by, understood, of, missing } = order, more = missing.length - MOST_NAMES, names = missing.slice(0, MOST_NAMES).join(', ');
    const waiting = missing.length ? `. not understood yet: ${names}${more > 0 ? `, and ${more} more` : ''}` : '';
    say($('everybody-text'), `Everybody out, ordered by ${by} ${minutes(unix_s - order.unix_s)} ago: understood by ${understood} of ${of}${waiting}`);
  }
}
