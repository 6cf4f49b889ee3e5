// SPDX-License-Identifier: MIT
// What a commander can do at a place of the map: set a mark, or remove the one that is there; and the commander's name, with which marks and acknowledgements are signed.

import { recall, remember } from '../static/storage.js';
import { markWords } from '../static/marks.js';
import { tr } from '../static/language.js';

const KINDS = ['cleared', 'hazard', 'meeting'];
const $ = (id) => document.getElementById(id);

export class Sheet {
  constructor(send, onHint) {
    Object.assign(this, { send, onHint, at: null, mark: null });
    $('me').value = recall('commander') ?? '';
    $('me').onchange = () => remember('commander', $('me').value);
    for (const kind of KINDS) $(`mark-${kind}`).onclick = () => this.signed((by) => this.send('mark', { mark: kind, ...this.at, by })) && this.close();
    $('mark-remove').onclick = () => { this.send('unmark', { id: this.mark.id }); this.close(); };
    $('sheet-close').onclick = () => this.close();
  }

  // Call `act` with the commander's name; without one it is asked for.
  signed(act) {
    const by = $('me').value.trim().slice(0, 32);
    if (!by) {
      this.onHint('Enter your name first: marks and acknowledgements are signed.');
      $('me').focus();
      return false;
    }
    act(by);
    return true;
  }

  open(at, mark, pixel, size) {
    Object.assign(this, { at, mark });
    $('sheet-text').textContent = tr(mark ? `${markWords(mark.mark)}, set by ${mark.by}` : 'Mark this place');
    for (const kind of KINDS) $(`mark-${kind}`).hidden = Boolean(mark);
    $('mark-remove').hidden = !mark;
    $('sheet').hidden = false;
    const { offsetWidth, offsetHeight } = $('sheet');
    $('sheet').style.left = `${Math.min(Math.max(pixel[0] - offsetWidth / 2, 4), Math.max(size[0] - offsetWidth - 4, 4))}px`;
    $('sheet').style.top = `${Math.min(pixel[1] + 16, Math.max(size[1] - offsetHeight - 4, 4))}px`;
  }

  close() { $('sheet').hidden = true; }
}
