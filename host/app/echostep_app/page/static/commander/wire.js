// SPDX-License-Identifier: MIT
// Frames of the commander's page: the header with its rows as arrays of numbers; the layout is in operation/session.py.

export const PLACE = 7, TRAIL = 5;  // numbers in a row

export function parseFrame(buffer) {
  const length = new DataView(buffer).getUint32(0, true), header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const places = new Float32Array(buffer, 4 + length, PLACE * header.places);
  const trail = new Float32Array(buffer, 4 + length + 4 * places.length, TRAIL * header.trail);
  return { ...header, places, trail };
}

// The places by wearer.
export function placesOf(rows) {
  const places = new Map();
  for (let k = 0; k < rows.length; k += PLACE) {
    const [id, x, y, level, heading, radius, protection] = rows.subarray(k, k + PLACE);
    places.set(id, { id, x, y, level, heading, radius, protection });
  }
  return places;
}
