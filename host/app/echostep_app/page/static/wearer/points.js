// SPDX-License-Identifier: MIT
// The surveyed points of an acceptance walk: what to do at the next one, and the buttons that tap it, another one, or take the newest tap back.

import { tr } from '../language.js';

const $ = (id) => document.getElementById(id);

export class Points {
  // `send`: of the link, (kind, fields). Each press carries the number of the visit that the page showed, so that a second press of a slow button is none.
  constructor(send) {
    this.send = send;
    $('at-point').onclick = () => this.press('at_point');
    $('no-tap').onclick = () => this.press('no_tap');
    $('other-point').onchange = () => {
      const name = $('other-point').value;
      $('other-point').value = '';
      if (name) this.press('at_point', { name });
    };
  }

  press(kind, fields = {}) {
    $('at-point').disabled = $('no-tap').disabled = true;
    this.send(kind, { number: this.number, ...fields });
  }

  show(points) {
    $('points').hidden = !points;
    if (!points) return;
    const { number, name, text, later, undo } = points;
    this.number = number;
    this.undo = undo;
    $('asked').textContent = tr(text);
    $('at-point').hidden = !name;
    if (name) $('at-point').textContent = tr(`At point ${name}`);
    $('other-point').hidden = later.length < 2;
    $('other-point').replaceChildren(new Option(tr('Other…'), ''), ...later.filter((one) => one !== name).map((one) => new Option(one, one)));
    this.ready();
  }

  // After an answer, also a refusal.
  ready() {
    $('at-point').disabled = false;
    $('no-tap').disabled = !this.undo;
  }
}
