// SPDX-License-Identifier: MIT
// Speech: speaks the newest sentence of the guidance when switched on; a newer sentence replaces an older one. A screen reader gets it in any case.

export class Speech {
  constructor(button, region) {
    Object.assign(this, { button, region, last: null });
    button.hidden = !window.speechSynthesis;
    button.onclick = () => this.set(!this.on, true);
    this.set(stored() === 'on', false);
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

  // The wearer's alarm is spoken whether speech is switched on or not, with vibration where the device has it; the same one again when its `times` changes.
  alarm(alarm) {
    const now = alarm ? `${alarm.kind} ${alarm.times}` : '';
    if (now === this.alarmed) return;
    this.alarmed = now;
    if (!alarm || !window.speechSynthesis) return;
    this.say(alarm.spoken);
    if (navigator.userActivation?.hasBeenActive) navigator.vibrate?.([400, 200, 400]);  // browsers forbid it before the first tap
  }

  say(text) {
    window.speechSynthesis.cancel();
    if (!text) return;
    this.sentence = new SpeechSynthesisUtterance(text);  // kept in a field: browsers drop a sentence without a reference
    this.sentence.lang = 'en';
    window.speechSynthesis.speak(this.sentence);
  }
}

function stored() {
  try { return localStorage.getItem('speech'); } catch { return null; }
}
