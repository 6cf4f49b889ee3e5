// SPDX-License-Identifier: MIT
// Speech: speaks the newest sentence of the guidance when switched on, and alarms always, these with a tone and vibration where the device has them.
// What a browser has not begun to speak is written on the page with the reason. A screen reader gets each sentence of the guidance in any case.

const BEGINS_MS = 2500;  // after which a sentence that has not begun is reported as not spoken; assumed
const CUT_OFF = ['canceled', 'interrupted'];  // errors of a sentence that a newer one replaced [Web Speech API]
const TONE_HZ = 880, TONE_S = 0.25, TONES = 3;  // of an alarm; assumed
const active = () => navigator.userActivation?.hasBeenActive ?? false;  // browsers forbid sound and vibration before the first tap or key

export class Speech {
  // `invitation`: a button that is shown until the first tap; `trouble`: element for what was not spoken.
  constructor(button, region, invitation, trouble) {
    Object.assign(this, { button, region, invitation, trouble, last: null, alarmed: '', tapped: active() });
    button.hidden = !window.speechSynthesis;
    button.onclick = () => this.set(!this.on, true);
    invitation.onclick = () => this.say('This page can speak now.');
    for (const kind of ['pointerup', 'keyup']) window.addEventListener(kind, () => this.wake(), true);
    this.set(stored() === 'on', false);
  }

  // A live page invites to the first tap; a replay has no alarms.
  invite(isLive) {
    this.isLive = isLive;
    this.invitation.textContent = window.speechSynthesis ? 'This page cannot speak before it is tapped: tap here' : 'This browser cannot speak: tap here for a tone at alarms';
    this.invitation.hidden = !isLive || this.tapped;
  }

  wake() {
    this.tapped = true;
    this.invitation.hidden = true;
    if (this.isLive && !this.audio && window.AudioContext) this.audio = new AudioContext();
    this.audio?.resume().catch(() => {});
  }

  set(on, chosen) {
    this.on = on && !this.button.hidden;
    this.button.setAttribute('aria-pressed', String(this.on));
    if (!chosen) return;
    try { localStorage.setItem('speech', on ? 'on' : 'off'); } catch { /* private browsing */ }
    if (!on) window.speechSynthesis.cancel();
    else if (this.last) this.say(this.last.text);
  }

  // Take the guidance of a frame; the same sentence of the same time is not spoken again.
  update(guidance) {
    const now = guidance?.spoken ? { text: guidance.spoken, at_s: guidance.spoken_s, own: guidance.own } : null, { last } = this;
    if (now?.text === last?.text && now?.at_s === last?.at_s && now?.own === last?.own) return;
    this.last = now;
    this.region.textContent = now?.text ?? '';
    if (this.on) this.say(now?.text);
  }

  // The wearer's alarm is spoken whether speech is switched on or not; the same one again when its `times` changes.
  alarm(alarm) {
    const now = alarm ? `${alarm.kind} ${alarm.times}` : '';
    if (now === this.alarmed) return;
    this.alarmed = now;
    if (!alarm) return this.fail('');
    this.say(alarm.spoken);
    if (alarm.kind !== 'over') this.tone();
    if (active()) navigator.vibrate?.([400, 200, 400]);
  }

  say(text) {
    clearTimeout(this.late);
    if (!window.speechSynthesis) return text && this.fail('this browser cannot speak');
    window.speechSynthesis.cancel();
    if (!text) return;
    const sentence = this.sentence = new SpeechSynthesisUtterance(text);  // kept in a field: browsers drop a sentence without a reference
    sentence.lang = 'en';
    sentence.onstart = () => { clearTimeout(this.late); this.fail(''); };
    sentence.onerror = ({ error }) => { if (!CUT_OFF.includes(error)) this.fail(error === 'not-allowed' ? 'the browser forbids it before the first tap' : `the browser says ${error}`); };
    this.late = setTimeout(() => this.fail('the browser has not begun'), BEGINS_MS);
    window.speechSynthesis.speak(sentence);
  }

  // Tones of an alarm, where the browser lets them sound.
  tone() {
    if (this.audio?.state !== 'running') return;
    for (let k = 0; k < TONES; k++) {
      const tone = this.audio.createOscillator(), at_s = this.audio.currentTime + 2 * k * TONE_S;
      tone.frequency.value = TONE_HZ;
      tone.connect(this.audio.destination);
      tone.start(at_s);
      tone.stop(at_s + TONE_S);
    }
  }

  fail(reason) {
    clearTimeout(this.late);
    const text = reason && `Not spoken: ${reason}. Tap the page, and look at its sound.`;
    if (this.trouble.textContent !== text) this.trouble.textContent = text;
    this.trouble.hidden = !reason;
  }
}

function stored() {
  try { return localStorage.getItem('speech'); } catch { return null; }
}
