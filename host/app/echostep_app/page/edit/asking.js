// SPDX-License-Identifier: MIT
// The panel of questions: shows one after the other, and gives the answers to the sheet. In: sheet, view, tools, desk. Owns the question that is shown.

import { tr } from '../static/language.js';
import { accept, put, reject } from './questions.js';
import { WORDS } from './words.js';

const byId = (id) => document.getElementById(id);
const NEAR = 30; // pixels a metre at least, when a question is shown

export class Asking {
  constructor(sheet, view, tools, desk) {
    Object.assign(this, { sheet, view, tools, desk, shown: null });
    for (const [id, answer] of Object.entries({ yes: () => this.accept(), move: () => this.place(), no: () => this.reject(), next: () => this.next() })) byId(`answer-${id}`).onclick = answer;
  }

  // All open questions: [level, question] pairs.
  get open() { return this.sheet.tree.levels.flatMap((level, k) => (level.questions ?? []).map((question) => [k, question])); }

  get index() { return this.open.findIndex(([, question]) => question === this.shown); }

  // The question in the panel: the shown one, or the first where that was answered or undone.
  get current() { return this.index < 0 ? this.open[0]?.[1] ?? null : this.shown; }

  // Show a question, on its level; without one: the first.
  show(question, goes = true) {
    const found = this.open.find(([, other]) => other === question) ?? this.open[0];
    this.shown = found?.[1] ?? null;
    if (found && goes) {
      this.sheet.k = found[0];
      this.view.scale = Math.max(this.view.scale, NEAR);
      this.view.centre(...this.shown.at);
    }
    this.desk.changed();
  }

  next(by = 1) {
    const { open } = this;
    if (open.length) this.show(open[(this.index + by + open.length) % open.length][1]);
  }

  answer(level, words) {
    const { open, index } = this, following = open[index + 1]?.[1];
    this.tools.choose('select');
    this.sheet.setLevel(level, words);
    if (open.length === 1) this.desk.say(WORDS.lastAnswer(words));
    this.show(following, open.length > 1);
  }

  accept() { if (this.here()) this.answer(accept(this.sheet.level, this.shown), WORDS.answered[this.shown.proposed ? 'added' : 'kept']); }

  reject() { if (this.here()) this.answer(reject(this.sheet.level, this.shown), WORDS.answered[this.shown.proposed ? 'dropped' : 'deleted']); }

  // The next click on the sheet says where the element belongs.
  place() {
    if (!this.here() || this.shown.about === 'wall') return;
    this.tools.choose('place');
    this.desk.say(this.shown.about === 'door' ? WORDS.doorHere : WORDS.roomHere);
    this.desk.changed();
  }

  placed(p) {
    const level = this.here() && put(this.sheet.level, this.shown, p);
    if (level) this.answer(level, WORDS.answered.moved);
    else this.desk.say(WORDS.noRoomForDoor);
  }

  // Whether there is a question; goes to its level.
  here() {
    this.shown = this.current;
    const found = this.open.find(([, question]) => question === this.shown);
    if (found) this.sheet.k = found[0];
    return Boolean(found);
  }

  // Show the state of the questions: after any change, undo included.
  paint() {
    const { open, current } = this;
    byId('questions').hidden = !open.length;
    byId('asked').textContent = current ? tr(WORDS.question(open.findIndex(([, question]) => question === current) + 1, open.length, current.text)) : '';
    byId('answer-move').disabled = current?.about === 'wall';
    byId('answer-yes').textContent = tr(current?.proposed ? WORDS.add : WORDS.keep);
    byId('answer-no').textContent = tr(current?.proposed ? WORDS.drop : WORDS.remove);
  }
}
