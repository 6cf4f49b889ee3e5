// SPDX-License-Identifier: MIT
// What a commander can do at a place of the map: set a mark, or remove the one that is there; and the commander's name, with which marks and acknowledgements are signed.

import { recall, remember } from '../storage.js';
import { markWords } from '../marks.js';
import { said } from '../text.js';

const KINDS = ['cleared', 'hazard', 'blocked', 'meeting'];
const $ = (id) => document.getElementById(id);

export class Sheet {
  // `words(x, y)`: a place on the Earth in words, or nothing; `measure(position, level)`: the first place of a distance
  constructor(send, onHint, { words, measure }) {
    Object.assign(this, { send, onHint, words, at: null, mark: null });
    $('measure').onclick = () => { this.close(); measure([this.at.x_m, this.at.y_m], this.at.level); };
    $('me').value = recall('commander') ?? '';
    $('me').onchange = () => remember('commander', $('me').value);
    for (const kind of KINDS) $(`mark-${kind}`).onclick = () => { this.signed((by) => this.send('mark', { mark: kind, ...this.at, by })); this.close(); };
    $('mark-remove').onclick = () => { this.send('unmark', { id: this.mark.id }); this.close(); };
    $('sheet-close').onclick = () => this.close();
  }

  // Call `act` with the commander's name, which is asked for afterwards: nothing waits for it.
  signed(act) {
    const by = $('me').value.trim().slice(0, 32);
    act(by || 'commander');
    if (!by) this.onHint('Signed "commander": enter your name.');
  }

  open(at, mark, pixel, size) {
    Object.assign(this, { at, mark });
    const place = `x ${at.x_m.toFixed(1)}, y ${at.y_m.toFixed(1)} m`;
    $('sheet-text').textContent = [mark ? `${markWords(mark.mark)}, set by ${mark.by}` : 'Mark this place', place, this.words(at.x_m, at.y_m)].filter(Boolean).map(said).join(' · ');
    for (const kind of KINDS) $(`mark-${kind}`).hidden = Boolean(mark);
    $('mark-remove').hidden = !mark;
    $('sheet').hidden = false;
    const { offsetWidth, offsetHeight } = $('sheet');
    $('sheet').style.left = `${Math.min(Math.max(pixel[0] - offsetWidth / 2, 4), Math.max(size[0] - offsetWidth - 4, 4))}px`;
    $('sheet').style.top = `${Math.min(pixel[1] + 16, Math.max(size[1] - offsetHeight - 4, 4))}px`;
  }

  close() { $('sheet').hidden = true; }
}
