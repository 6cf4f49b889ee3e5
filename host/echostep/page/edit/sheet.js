// SPDX-License-Identifier: MIT
// The sheet: the plan and the picture's position, with undo and redo. Owns the history; every change makes a new tree.

import { settled } from './questions.js';

const MOST_KEPT = 300; // changes that can be undone

export class Sheet {
  constructor(tree) { Object.assign(this, { tree, picture: null, k: 0, past: [], future: [], saved: tree }); }

  get level() { return this.tree.levels[this.k]; }
  get unsaved() { return this.tree !== this.saved; }

  change(tree, picture = this.picture) {
    this.past.push([this.tree, this.picture]);
    if (this.past.length > MOST_KEPT) this.past.shift();
    [this.tree, this.picture, this.future] = [tree, picture, []];
  }

  setLevel(level) { this.change({ ...this.tree, levels: this.tree.levels.with(this.k, settled(level)) }); }

  undo() { this.go(this.past, this.future); }
  redo() { this.go(this.future, this.past); }

  go(from, to) {
    if (!from.length) return;
    to.push([this.tree, this.picture]);
    [this.tree, this.picture] = from.pop();
    this.k = Math.min(this.k, this.tree.levels.length - 1);
  }
}
