// SPDX-License-Identifier: MIT
// The sheet: the plan, with undo and redo, and the size of the picture. Owns the history; every change makes a new tree and says in a sentence what it did.

import { settled } from './questions.js';
import { WORDS } from './words.js';

const MOST_KEPT = 300; // changes that can be undone
const FIRST_WIDTH_M = 20; // of a picture without a scale

export class Sheet {
  constructor(tree, say) { Object.assign(this, { tree, say, picture: null, k: 0, past: [], future: [], saved: tree }); }

  get level() { return this.tree.levels[this.k]; }
  get unsaved() { return this.tree !== this.saved; }

  // Metres a pixel and the lower left corner of the picture.
  get lies() { return this.tree.picture ?? [FIRST_WIDTH_M / this.picture.width, 0, 0]; }

  change(tree, words) {
    this.past.push({ tree: this.tree, words });
    if (this.past.length > MOST_KEPT) this.past.shift();
    Object.assign(this, { tree, future: [] });
    this.say(words);
  }

  setLevel(level, words) { this.change({ ...this.tree, levels: this.tree.levels.with(this.k, settled(level)) }, words); }

  undo() { this.go(this.past, this.future, WORDS.undone); }
  redo() { this.go(this.future, this.past, WORDS.redone); }

  go(from, to, told) {
    if (!from.length) return;
    const { tree, words } = from.pop();
    to.push({ tree: this.tree, words });
    Object.assign(this, { tree, k: Math.min(this.k, tree.levels.length - 1) });
    this.say(told(words));
  }
}
