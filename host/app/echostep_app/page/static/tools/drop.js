// SPDX-License-Identifier: MIT
// Files that are dropped onto the page, or chosen with its button: sent to the server one by one; what came of each is written in words.

import { tr } from '../language.js';

const $ = (id) => document.getElementById(id);
const ELSEWHERE = 'This page shows a run; a recording plays on the page of: echostep page';

export class Drops {
  // `hint(text)`: shows a sentence for a while
  constructor(hint) {
    Object.assign(this, { hint, takes: false, waits: true, answer: '' });
    window.addEventListener('dragover', (e) => e.preventDefault());  // else the browser leaves this page for the file
    window.addEventListener('drop', (e) => { e.preventDefault(); this.take([...e.dataTransfer.files]); });
    $('drop-open').onclick = () => $('drop-file').click();
    $('drop-file').onchange = () => { this.take([...$('drop-file').files]); $('drop-file').value = ''; };
    $('drop-without').onclick = () => this.send('without-plan', null);
  }

  // `takes`: this page plays files; `waits`: it does not play one yet.
  show(takes, waits) {
    Object.assign(this, { takes, waits });
    $('drop').hidden = !takes || !waits;
    if (!waits && this.answer) this.say(this.answer, false);  // it came before the recording began to play
  }

  async take(files) {
    if (!files.length) return;
    if (!this.takes) return this.hint(ELSEWHERE, 8000);
    for (const file of files.sort((a, b) => isRecording(a) - isRecording(b))) await this.send(`file?name=${encodeURIComponent(file.name)}`, file);  // plans first
  }

  async send(path, body) {
    this.say(body ? `reading ${body.name} …` : '', false);
    const answer = await fetch(new URL(path, document.baseURI), { method: 'POST', body }).catch(() => null);
    const text = answer ? await answer.text() : `${body?.name ?? 'It'} did not arrive: is it larger than 1 GiB, or has echostep page ended?`;
    this.answer = this.waits ? text : '';
    this.say(text, !answer?.ok);
    $('drop-without').hidden = !answer?.ok || !text.includes('drop its plan');
  }

  say(text, isWrong) {
    $('drop-text').textContent = tr(text);
    $('drop-text').dataset.wrong = String(isWrong);
    $('drop-text').hidden = !text;
    if (this.waits || !text) return;
    this.hint(text, 8000);
    this.answer = '';
  }
}

const isRecording = ({ name }) => name.endsWith('.mcap');
