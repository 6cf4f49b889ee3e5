// SPDX-License-Identifier: MIT
// Requests that may not be lost. Each has an identity and is kept, over a reload too, until the server has answered; after each new connection it is sent
// again, and the server carries it out once. What came of it is written into #outbox: sending, sent, not sent and why.

import { tr } from './language.js';
import { remember } from './storage.js';

const LABELS = {
  call: 'Help!', check_in: 'I am here', undo: 'Undo', met: 'I met a teammate', understood: 'Understood', order: 'Order', go_to: 'Go here', go_out: 'Way out', strike: 'No way', go_nowhere: 'End of the guidance',
  acknowledge: 'Acknowledge', send: 'Send', mark: 'Mark', unmark: 'Remove', crew: 'Crew', crew_does: 'Crew', log: 'Note',
};
const FRESH_S = { check_in: 5, undo: 5, met: 5 };  // what is said of this moment is wrong later; assumed
const STORED_S = 600;  // what an earlier page left behind is sent for so long; assumed
const TOO_LATE = 'not sent: too late by now, do it again';
const SLOW_S = 1, SHOWN_MS = 6000, REFUSED_MS = 20000, REMIND_S = 10, MOST_NEWS = 2;
const $ = (id) => document.getElementById(id);

export class Outbox {
  // `transmit(request)`: sends it if there is a connection; `onUnsent(text)`: a call for help has not gone out, each REMIND_S; `serverNow_s()`: or null
  constructor(transmit, onUnsent, serverNow_s) {
    Object.assign(this, { transmit, onUnsent, serverNow_s, prefix: `request ${location.pathname} `, run: null, kept: [], news: [], waiting: 0 });
    this.kept = stored(this.prefix);
    for (const request of this.kept) if (age_s(request) >= STORED_S) this.drop(request, TOO_LATE);
    setInterval(() => this.tick(), 1000 * SLOW_S);
    window.addEventListener('storage', ({ key, newValue }) => {  // of another tab of this page
      const kept = this.kept.filter(({ request }) => key !== this.prefix + request);
      this.kept = newValue && key.startsWith(this.prefix) ? [...kept, ...whole(newValue)] : kept;
      this.show();
    });
  }

  static keeps(kind) { return kind in LABELS; }

  put(kind, fields) {
    const request = { ...fields, kind, request: crypto.getRandomValues(new Uint32Array(4)).join('-'), run: this.run, at_ms: Date.now(), mark_ms: performance.now(), reminded: 0 };
    const now_s = this.serverNow_s();
    if (kind in FRESH_S && now_s !== null) request.until_s = now_s + FRESH_S[kind];  // it may lie in the wire
    this.kept.push(request);
    remember(this.prefix + request.request, JSON.stringify(request));
    this.transmit(request);
    if (kind === 'call') this.show();
  }

  // A new connection. Numbers of wearers and places mean nothing in another run; a call for help does.
  greet(run) {
    this.run = run;
    for (const request of [...this.kept]) {
      if (request.kind !== 'call' && request.run && request.run !== run) this.drop(request, 'not sent: the program has been started anew');
      else if (this.isFresh(request)) this.transmit(request);
    }
  }

  answered({ request: identity, reason }) {
    const request = this.kept.find(({ request: own }) => own === identity);
    if (!request) return;
    const isCall = request.kind === 'call', isNews = reason ? isCall : !isCall && age_s(request) > SLOW_S;  // of a call that arrived the alarm says how far it came
    this.drop(request, isNews ? (reason ? `not sent: ${reason}` : 'sent') : '');  // other refusals are the page's hint
  }

  isFresh(request) {
    const fresh = age_s(request) < (FRESH_S[request.kind] ?? Infinity);
    if (!fresh) this.drop(request, TOO_LATE);
    return fresh;
  }

  drop(request, news) {
    this.kept = this.kept.filter((one) => one !== request);
    remember(this.prefix + request.request, null);
    if (news) this.news.push({ text: `${label(request)}: ${news}`, ends: performance.now() + (news === 'sent' ? SHOWN_MS : REFUSED_MS) });
    this.show();
  }

  tick() {
    for (const request of [...this.kept]) this.isFresh(request);
    const call = this.kept.find(({ kind, reminded, ...request }) => kind === 'call' && age_s(request) - reminded >= REMIND_S);
    if (call) {
      call.reminded = age_s(call);
      this.onUnsent(`Not sent yet: ${label(call)}`);
    }
    if (this.kept.length || this.news.length) this.show();
  }

  // Requests that the server has, and the broker has not yet.
  wait(waiting) {
    if (waiting === this.waiting) return;
    this.waiting = waiting;
    this.show();
  }

  show() {
    const waiting = this.kept.filter((request) => request.kind === 'call' || age_s(request) > SLOW_S).map((request) => `${label(request)}: sending for ${Math.round(age_s(request))} s`);
    this.news = this.news.filter(({ ends }) => ends > performance.now()).slice(-MOST_NEWS);
    if (this.waiting) waiting.push(`Requests that wait for the broker: ${this.waiting}`);
    const text = [...waiting, ...this.news.map(({ text: news }) => news)].map(tr).join('. ');
    if ($('outbox').textContent !== text) $('outbox').textContent = text;
    $('outbox').hidden = !text;
  }
}

const label = ({ kind, help }) => (kind === 'call' && !help ? 'I am all right' : LABELS[kind]);
const age_s = ({ at_ms, mark_ms }) => Math.max(Date.now() - at_ms, performance.now() - mark_ms) / 1000;  // as in pulse.js

function stored(prefix) {
  try {
    const keys = Object.keys(localStorage).filter((key) => key.startsWith(prefix));
    return keys.flatMap((key) => whole(localStorage[key])).sort((a, b) => a.at_ms - b.at_ms);
  } catch { return []; }
}

// A damaged request is none, and hides no other one.
function whole(text) {
  try {
    const request = { ...JSON.parse(text), mark_ms: performance.now() };
    return request.kind in LABELS && request.request && request.at_ms > 0 ? [request] : [];
  } catch { return []; }
}
