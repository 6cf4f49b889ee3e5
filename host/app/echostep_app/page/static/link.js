// SPDX-License-Identifier: MIT
// The WebSocket to the server: reconnects when it closes or gives no beat, parses frames, sends requests; those of the outbox again until they are answered.

import { Outbox } from './outbox.js';
import { Pulse } from './pulse.js';

const LONGEST_WAIT_MS = 5000;
const REVIVE_MS = 10000;  // a socket that gives no beat for so long is given up: out of reach, none closes by itself

export class Link {
  // `onAge()`: of the pulse; `isLive()`: what is shown is the present; `onUnsent(text)`: of the outbox; `parse`: bytes of a frame -> frame.
  constructor({ onHello, onFrame, onRefused, onFailed, onConsidered, onAge, onUnsent, isLive, parse }) {
    Object.assign(this, { onHello, onFrame, onRefused, onFailed, onConsidered, onAge, parse, wait: 250, failures: 0, isOpen: false });
    this.pulse = new Pulse(() => { this.revive(); onAge(); }, isLive);
    this.outbox = new Outbox((request) => this.transmit(request), onUnsent, () => this.pulse.now_s);
    this.open();
  }

  open() {
    const url = new URL('socket', document.baseURI);
    url.protocol = url.protocol.replace('http', 'ws');
    const socket = this.socket = new WebSocket(url);
    this.begun = performance.now();
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({ data }) => (typeof data === 'string' ? this.onText(JSON.parse(data)) : this.onFrame(this.parse(data)));
    socket.onclose = () => {
      this.isOpen = false;
      this.onAge();
      this.failures += 1;
      setTimeout(() => this.socket === socket && this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
    };
  }

  revive() {
    const isLate = performance.now() - Math.max(this.begun, this.pulse.beat[0]) > REVIVE_MS;
    if (!isLate || this.socket.readyState > WebSocket.OPEN) return;
    this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
    this.isOpen = false;
    this.open();
  }

  onText(message) {
    if (message.kind === 'beat') this.pulse.hear(message.age_s, message.now_s);
    else if (message.kind === 'hello') {
      this.wait = 250;
      this.failures = 0;
      this.isOpen = true;
      [this.pulse.program] = message.title.split(' (');
      this.pulse.hear(0, null);
      this.onAge();
      this.onHello(message);
      this.outbox.greet(message.run);
    } else if (message.kind === 'answered') {
      this.outbox.answered(message);
      if (message.reason) this.onRefused(message.reason);
    } else if (message.kind === 'refused') this.onRefused(message.reason);
    else if (message.kind === 'considered') this.onConsidered(message);
    else if (message.kind === 'failed') {
      this.wait = LONGEST_WAIT_MS;
      this.onFailed(message.reason, message.ended);
    }
  }

  send(kind, fields = {}) {
    if (Outbox.keeps(kind)) this.outbox.put(kind, fields);
    else this.transmit({ kind, ...fields });
  }

  transmit(request) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }
}
