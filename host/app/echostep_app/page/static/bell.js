// SPDX-License-Identifier: MIT
// The bell: tones and vibration of an alarm. Browsers allow neither before the first tap or key; until then a button invites to it.

import { tr } from './language.js';

const TONE_HZ = 880, TONE_S = 0.25, TONES = 3;  // assumed
const VIBRATION_MS = [400, 200, 400];
const active = () => navigator.userActivation?.hasBeenActive ?? false;

export class Bell {
  constructor(invitation) {
    Object.assign(this, { invitation, tapped: active(), isLive: false });
    for (const kind of ['pointerup', 'keyup']) window.addEventListener(kind, () => this.wake(), true);
  }

  // A live page invites to the first tap with this text; a replay has no alarms.
  invite(isLive, text) {
    this.isLive = isLive;
    this.invitation.textContent = tr(text);
    this.invitation.hidden = !isLive || this.tapped;
  }

  wake() {
    this.tapped = true;
    this.invitation.hidden = true;
    if (this.isLive && !this.audio && window.AudioContext) this.audio = new AudioContext();
    this.audio?.resume().catch(() => {});
  }

  ring() {
    this.tone();
    this.vibrate();
  }

  vibrate() { if (active()) navigator.vibrate?.(VIBRATION_MS); }

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
}
