// SPDX-License-Identifier: MIT
// The editor's dialog. In: a question. Out: a promise of the answer, null when it was cancelled. `map`: has the focus afterwards.

import { tr } from './language.js';

const byId = (id) => document.getElementById(id);
let waiting = false; // for an answer: a closed dialog tells it in an event, later

export const isOpen = () => waiting;

export function ask(question, answer) {
  const dialog = byId('ask');
  byId('question').textContent = tr(question);
  byId('answer').value = answer;
  dialog.showModal();
  byId('answer').select();
  waiting = true;
  return new Promise((resolve) => {
    let given = null;
    const end = (value) => { given = value; dialog.close(); };
    dialog.querySelector('form').onsubmit = (e) => { e.preventDefault(); end(byId('answer').value); };
    byId('no').onclick = () => end(null);
    dialog.onclose = () => { waiting = false; byId('map').focus(); resolve(given); }; // not before: this event would close the next question
  });
}
