// Speech: says the newest sentence of the guidance, when that is switched on; a newer one takes the place of an older. A screen reader hears it in any case.

export class Speech {
  constructor(button, region) {
    Object.assign(this, { button, region, last: null });
    button.hidden = !window.speechSynthesis;
    button.onclick = () => this.set(!this.on, true);
    this.set(kept() === 'on', false);
  }

  set(on, chosen) {
    this.on = on && !this.button.hidden;
    this.button.setAttribute('aria-pressed', String(this.on));
    if (!chosen) return;
    try { localStorage.setItem('speech', on ? 'on' : 'off'); } catch { /* private browsing */ }
    if (!on) window.speechSynthesis.cancel();
    else if (this.last) this.say(this.last.text);
  }

  // What the guidance says now; the same sentence of the same moment is not said again.
  hear(guidance) {
    const now = guidance?.spoken ? { text: guidance.spoken, at_s: guidance.spoken_s, own: guidance.own } : null, { last } = this;
    if (now?.text === last?.text && now?.at_s === last?.at_s && now?.own === last?.own) return;
    this.last = now;
    this.region.textContent = now?.text ?? '';
    if (this.on) this.say(now?.text);
  }

  say(text) {
    window.speechSynthesis.cancel();
    if (!text) return;
    const sentence = new SpeechSynthesisUtterance(text);
    sentence.lang = 'en';
    window.speechSynthesis.speak(sentence);
  }
}

function kept() {
  try { return localStorage.getItem('speech'); } catch { return null; }
}
