// SPDX-License-Identifier: MIT
// A position that is being entered: its ghost on the map, what it would do in words, its confirmation; and the undoing of the last one.

import { inUnits } from '../tools/units.js';
import { tr } from '../language.js';

const $ = (id) => document.getElementById(id);
const FINGER_PX = 20;  // standard deviation of a tap on the screen
const LEAST_SD_M = 0.3;  // of a check-in

export class Taps {
  // `desk`: send(kind, fields), changed(), globe() -> of the plan or null, keptHeading() -> radians or null, mayCheckIn() -> whether the run takes positions
  constructor(view, desk) {
    Object.assign(this, { view, desk, ghost: null, asked: 0 });
    $('sheet-here').onclick = () => this.confirm();
    $('sheet-close').onclick = () => this.drop();
    $('undo-button').onclick = () => {
      desk.send('undo', { undo: this.offer.undo });
      $('undo').hidden = true;
    };
  }

  // While a finger is on the map: only the ghost.
  aim(position, heading_rad) {
    $('sheet').hidden = true;
    this.ghost = position && { x_m: position[0], y_m: position[1], heading_rad, kept_rad: null, sd_m: this.sd };
    this.desk.changed();
  }

  // The finger is off: ask the server what it would do.
  put([x_m, y_m], heading_rad, level) {
    this.ghost = { x_m, y_m, heading_rad, kept_rad: this.desk.keptHeading(), sd_m: this.sd, level };
    $('sheet-here').hidden = !this.desk.mayCheckIn();
    $('sheet-here').disabled = true;
    this.said = '';
    this.say();
    if (this.desk.mayCheckIn()) {
      this.asked++;
      this.desk.send('consider', this.fields);
    }
    this.showSheet();
    this.desk.changed();
  }

  // What it would do, and where on the Earth it is.
  say() {
    const { x_m, y_m } = this.ghost;
    $('sheet-text').textContent = [tr(inUnits(this.said)), this.desk.globe()?.words(x_m, y_m)].filter(Boolean).join(' ');
  }

  get sd() { return Math.max(LEAST_SD_M, FINGER_PX / this.view.scale); }
  get fields() {
    const { x_m, y_m, heading_rad, sd_m, level } = this.ghost;
    return { x_m, y_m, heading_rad, sd_m, level };
  }

  considered({ x_m, y_m, level, possible, text }) {
    this.asked = Math.max(this.asked - 1, 0);
    if (this.asked || this.ghost?.level !== level) return;  // an answer to an older question
    Object.assign(this.ghost, { x_m, y_m });
    this.said = text;
    this.say();
    $('sheet-here').disabled = !possible;
    this.showSheet();
    this.desk.changed();
  }

  // Beside the ghost, on the screen.
  showSheet() {
    const sheet = $('sheet'), [sx, sy] = this.view.toScreen(this.ghost.x_m, this.ghost.y_m), below = sy + 54;
    sheet.hidden = false;
    const top = below + sheet.offsetHeight < this.view.height ? below : Math.max(sy - 54 - sheet.offsetHeight, 4);
    sheet.style.left = `${Math.min(Math.max(sx - sheet.offsetWidth / 2, 4), Math.max(this.view.width - sheet.offsetWidth - 4, 4))}px`;
    sheet.style.top = `${Math.min(top, Math.max(this.view.height - sheet.offsetHeight - 4, 4))}px`;
  }

  moved() {
    if (!$('sheet').hidden) this.showSheet();
  }

  confirm() {
    if (this.ghost && !$('sheet-here').disabled) this.desk.send('check_in', this.fields);
    this.drop();
  }

  drop() {
    $('sheet').hidden = true;
    this.ghost = null;
    this.desk.changed();
  }

  // After a new connection an answer may be lost: ask again.
  reconnected() {
    this.asked = 0;
    if (this.ghost?.level !== undefined) this.put([this.ghost.x_m, this.ghost.y_m], this.ghost.heading_rad, this.ghost.level);
  }

  // The offer of a frame to undo the newest check-in, whichever page made it.
  undoable(offer) {
    const isNew = offer && (offer.undo !== this.offer?.undo || offer.contradicted !== this.offer?.contradicted);
    if (isNew) {
      $('undo-text').textContent = tr(offer.contradicted ? 'The echoes do not fit the position that was set by hand.' : 'The position was set by hand.');
      $('undo').dataset.contradicted = String(offer.contradicted);
      $('undo').hidden = false;
    }
    this.offer = offer;
    if (offer) $('undo-left').textContent = `${Math.ceil(offer.left_s)} s`;
    else $('undo').hidden = true;
  }
}
