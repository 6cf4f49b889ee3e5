// The link to the server: opens the socket again when it closes, takes frames apart, says what the page wants.

const LONGEST_WAIT_MS = 5000;

export class Link {
  constructor({ onHello, onFrame, onRefused, onState }) {
    Object.assign(this, { onHello, onFrame, onRefused, onState, wait: 250 });
    this.open();
  }

  open() {
    const url = new URL('socket', document.baseURI);
    url.protocol = url.protocol.replace('http', 'ws');
    this.socket = new WebSocket(url);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = ({ data }) => (typeof data === 'string' ? this.told(JSON.parse(data)) : this.onFrame(parseFrame(data)));
    this.socket.onclose = () => {
      this.onState(false);
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
    };
  }

  told(message) {
    if (message.kind === 'hello') {
      this.wait = 250;
      this.onState(true);
      this.onHello(message);
    } else if (message.kind === 'refused') this.onRefused(message.what);
  }

  say(kind, fields = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ kind, ...fields }));
  }
}

// Header, the trail's new points, and the cloud as grid columns: see wire.py.
export function parseFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  header.trail.points = new Float32Array(buffer, at, 3 * header.trail.count);
  at += 12 * header.trail.count;
  if (header.cloud) {
    const n = header.cloud.count;
    header.cloud.x = new Uint16Array(buffer, at, n);
    header.cloud.y = new Uint16Array(buffer, at + 2 * n, n);
    header.cloud.weight = new Uint8Array(buffer, at + 4 * n, n);
    header.cloud.level = new Uint8Array(buffer, at + 5 * n, n);
  }
  return header;
}
