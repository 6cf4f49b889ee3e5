// SPDX-License-Identifier: MIT
// Speech: speaks the newest sentence of the guidance when switched on, and alarms always, these with a tone and vibration where the device has them.
// What a browser has not begun to speak is written on the page with the reason. A screen reader gets each sentence of the guidance in any case.

import { recall, remember } from '../storage.js';
import { Bell } from '../bell.js';
import { inUnits } from '../tools/units.js';
import { language, tr } from '../language.js';

const BEGINS_MS = 2500;  // after which a sentence that has not begun is reported as not spoken; assumed
const CUT_OFF = ['canceled', 'interrupted'];  // errors of a sentence that a newer one replaced [Web Speech API]

export class Speech {
  // `invitation`: a button that is shown until the first tap; `trouble`: element for what was not spoken.
  constructor(button, region, invitation, trouble) {
    Object.assign(this, { button, region, trouble, bell: new Bell(invitation), last: null, alarmed: '', errand: '' });
    button.hidden = !window.speechSynthesis;
    button.onclick = () => this.set(!this.on, true);
    invitation.onclick = () => this.say('This page can speak now.');
    this.set(recall('speech') === 'on', false);
  }

  invite(isLive) {
    this.bell.invite(isLive, window.speechSynthesis ? 'This page cannot speak before it is tapped: tap here' : 'This browser cannot speak: tap here for a tone at alarms');
  }

  set(on, chosen) {
    this.on = on && !this.button.hidden;
    this.button.setAttribute('aria-pressed', String(this.on));
    if (!chosen) return;
    remember('speech', on ? 'on' : 'off');
    if (!on) window.speechSynthesis.cancel();
    else if (this.last) this.say(this.last.text);
  }

  // Take the guidance of a frame; the same sentence of the same time is not spoken again. `isHeard`: the order to leave speaks it.
  update(guidance, isHeard = false) {
    const now = guidance?.spoken ? { text: guidance.spoken, at_s: guidance.spoken_s, own: guidance.own } : null, { last } = this;
    if (now?.text === last?.text && now?.at_s === last?.at_s && now?.own === last?.own) return;
    this.last = now;
    this.region.textContent = tr(inUnits(now?.text ?? ''));
    if (this.on && !isHeard) this.say(now?.text);
  }

  // The wearer's alarm is spoken whether speech is switched on or not; the same one again when its `times` changes.
  alarm(alarm) {
    const now = alarm ? `${alarm.kind} ${alarm.times}` : '';
    if (now === this.alarmed) return;
    this.alarmed = now;
    if (!alarm) return this.fail('');
    this.say(alarm.spoken);
    if (alarm.kind !== 'over') this.bell.tone();
    this.bell.vibrate();
  }

  // Who sends the wearer to one in distress is spoken once, whether speech is switched on or not.
  sent(errand) {
    if (errand === this.errand) return;
    this.errand = errand;
    if (!errand) return;
    this.say(`${errand}.`);
    this.bell.ring();
  }

  // A call for help that has not gone out, or a commander's order, whether speech is switched on or not.
  unsent(text) {
    this.say(text);
    this.bell.ring();
  }

  say(text) {
    clearTimeout(this.late);
    if (!window.speechSynthesis) return text && this.fail('this browser cannot speak');
    window.speechSynthesis.cancel();
    if (!text) return;
    const sentence = this.sentence = new SpeechSynthesisUtterance(tr(inUnits(text)));  // kept in a field: browsers drop a sentence without a reference
    sentence.lang = language;
    sentence.onstart = () => { clearTimeout(this.late); this.fail(''); };
    sentence.onerror = ({ error }) => { if (!CUT_OFF.includes(error)) this.fail(error === 'not-allowed' ? 'the browser forbids it before the first tap' : `the browser says ${error}`); };
    this.late = setTimeout(() => this.fail('the browser has not begun'), BEGINS_MS);
    window.speechSynthesis.speak(sentence);
  }

  fail(reason) {
    clearTimeout(this.late);
    const text = reason && tr(`Not spoken: ${reason}. Tap the page, and look at its sound.`);
    if (this.trouble.textContent !== text) this.trouble.textContent = text;
    this.trouble.hidden = !reason;
  }
}
