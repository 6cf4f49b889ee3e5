// SPDX-License-Identifier: MIT
// Frames of the wearer's page: the header with the new points of the trail and the columns of the cloud; the layout is in page/protocol.py.

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

// Add a frame's points to the trail that is shown.
export function extend(trail, { first, count, points }) {
  const total = first + count;
  if (3 * total > trail.points.length) {
    const more = new Float32Array(6 * total);
    more.set(trail.points.subarray(0, 3 * first));
    trail.points = more;
  }
  trail.points.set(points, 3 * first);
  trail.count = total;
}
