// SPDX-License-Identifier: MIT
// The WebSocket to the server: reconnects when it closes, parses frames, sends requests.

const LONGEST_WAIT_MS = 5000;
const REFUSALS = 4;  // connections in a row that failed, after two seconds, before that is explained

export class Link {
  // `parse`: bytes of a frame -> frame.
  constructor({ onHello, onFrame, onRefused, onFailed, onConsidered, onState, parse = parseFrame }) {
    Object.assign(this, { onHello, onFrame, onRefused, onFailed, onConsidered, onState, parse, wait: 250, failures: 0, explained: false });
    this.open();
  }

  open() {
    const url = new URL('socket', document.baseURI);
    url.protocol = url.protocol.replace('http', 'ws');
    this.socket = new WebSocket(url);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = ({ data }) => (typeof data === 'string' ? this.onText(JSON.parse(data)) : this.onFrame(this.parse(data)));
    this.socket.onclose = () => {
      this.onState(false);
      this.failures += 1;
      if (this.failures === REFUSALS && !this.explained) this.onFailed('No connection to the tracker: has it ended? A proxy must pass WebSockets, and the browser\'s Host or X-Forwarded-Host.');
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
    };
  }

  onText(message) {
    if (message.kind === 'hello') {
      this.wait = 250;
      this.failures = 0;
      this.explained = false;
      this.onState(true);
      this.onHello(message);
    } else if (message.kind === 'refused') this.onRefused(message.reason);
    else if (message.kind === 'considered') this.onConsidered(message);
    else if (message.kind === 'failed') {
      this.wait = LONGEST_WAIT_MS;
      this.explained = true;  // what is then not answered is no news
      this.onFailed(message.reason, message.ended);
    }
  }

  send(kind, fields = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ kind, ...fields }));
  }
}

// A frame's header with the new points of the trail and the columns of the cloud; the layout is in page/protocol.py.
export function parseFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let offset = 4 + length;
  header.trail.points = new Float32Array(buffer, offset, 3 * header.trail.count);
  offset += 12 * header.trail.count;
  if (header.drawing) {
    const { walls, points, trail_count } = header.drawing;
    header.drawing = { trail_count, walls: new Float32Array(buffer, offset, 5 * walls), path: new Float32Array(buffer, offset + 20 * walls, 2 * points) };
    offset += 20 * walls + 8 * points;
  }
  if (header.cloud) {
    const n = header.cloud.count;
    header.cloud.x = new Uint16Array(buffer, offset, n);
    header.cloud.y = new Uint16Array(buffer, offset + 2 * n, n);
    header.cloud.weight = new Uint8Array(buffer, offset + 4 * n, n);
    header.cloud.level = new Uint8Array(buffer, offset + 5 * n, n);
  }
  return header;
}
