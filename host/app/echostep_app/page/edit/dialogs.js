// SPDX-License-Identifier: MIT
// The editor's dialogs. In: a question. Out: a promise of the answer, null when it was cancelled. `map`: has the focus afterwards.

import { tr } from './language.js';
import { WORDS } from './words.js';

const byId = (id) => document.getElementById(id);
let waiting = null; // the dialog whose answer has not arrived: a closed one tells it in an event, later

// Shows a dialog until its form is sent with an answer that is not undefined, or until it is cancelled.
function shown(dialog, answer) {
  dialog.showModal();
  waiting = dialog;
  return new Promise((resolve) => {
    let given = null;
    const end = (value) => { given = value; dialog.close(); };
    dialog.querySelector('form').onsubmit = (e) => { e.preventDefault(); const value = answer(); if (value !== undefined) end(value); };
    dialog.querySelector('[type="button"]').onclick = () => end(null);
    dialog.onclose = () => { waiting = null; byId('map').focus(); resolve(given); }; // not before: this event would close the next question
  });
}

export const isOpen = () => waiting !== null;

// `refusal(text)`: why a text is no answer; empty where it is one.
export function ask(question, answer, refusal = () => '') {
  byId('question').textContent = tr(question);
  byId('answer').value = answer;
  byId('ask-wrong').textContent = '';
  const done = shown(byId('ask'), () => {
    const text = byId('answer').value, reason = refusal(text);
    byId('ask-wrong').textContent = tr(reason);
    return reason ? undefined : text;
  });
  byId('answer').select();
  return done;
}

// Name and levels of a connector; `names`: of all levels.
export function askConnector(kind, names, { name, levels }) {
  byId('ways-title').textContent = tr(WORDS.connectorTitle(kind));
  byId('ways-name').value = name;
  byId('ways-few').textContent = '';
  byId('ways-levels').replaceChildren(...names.map((text, k) => {
    const label = document.createElement('label'), box = Object.assign(document.createElement('input'), { type: 'checkbox', value: k, checked: levels.includes(k) });
    label.append(box, text);
    return label;
  }));
  return shown(byId('ways'), () => {
    const chosen = [...byId('ways-levels').querySelectorAll('input')].filter((box) => box.checked).map((box) => Number(box.value));
    if (chosen.length > 1) return { name: byId('ways-name').value.trim(), levels: chosen };
    byId('ways-few').textContent = tr(WORDS.twoLevels);
    return undefined;
  });
}
