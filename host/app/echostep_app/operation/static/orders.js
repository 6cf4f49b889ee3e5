// SPDX-License-Identifier: MIT
// Orders to the wearers: everybody out, by a button that is held, and who has understood; a note in words to the chosen wearer.

import { onHeld } from '../static/held.js';
import { minutes } from '../static/language.js';
import { say } from './text.js';

const MOST_NAMES = 6;
const $ = (id) => document.getElementById(id);

export class Orders {
  // `signed(act)`: calls `act` with the commander's name; `send(kind, fields)`: a request to the server; `chosen()`: number of a wearer
  constructor(signed, send, chosen, onHint) {
    onHeld($('out'), () => signed((by) => send('order', { by })), () => onHint('Hold Everybody out for a second.'));
    $('everybody-end').onclick = () => signed((by) => send('order', { by, ended: true }));
    $('note-form').onsubmit = (e) => {
      e.preventDefault();
      const text = $('note').value.trim();
      if (text && signed((by) => send('order', { by, to: chosen(), text }))) $('note').value = '';
    };
  }

  show(order, unix_s) {
    if ($('everybody').hidden !== !order) $('everybody').hidden = !order;
    if (!order) return;
    const { by, understood, of, missing } = order, more = missing.length - MOST_NAMES, names = missing.slice(0, MOST_NAMES).join(', ');
    const waiting = missing.length ? `. not understood yet: ${names}${more > 0 ? `, and ${more} more` : ''}` : '';
    say($('everybody-text'), `Everybody out, ordered by ${by} ${minutes(unix_s - order.unix_s)} ago: understood by ${understood} of ${of}${waiting}`);
  }
}
