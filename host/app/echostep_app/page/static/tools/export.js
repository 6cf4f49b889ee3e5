// SPDX-License-Identifier: MIT
// The shown floor as GeoJSON, to be saved.

// Walls, rooms, track and position of the shown floor [RFC 7946]; in longitude and latitude on a plan with a georeference, else in metres of the plan.
export function geojson({ lines, level, rooms, trail, estimate, globe }) {
  const at = (x, y) => (globe ? globe.degrees(x, y) : [Number(x.toFixed(3)), Number(y.toFixed(3))]);
  const feature = (type, coordinates, properties) => ({ type: 'Feature', geometry: { type, coordinates }, properties });
  const walls = Object.entries(lines).map(([kind, rows]) => feature('MultiLineString', pairs(rows).map(([x0, y0, x1, y1]) => [at(x0, y0), at(x1, y1)]), { kind }));
  const names = rooms.map(({ name, at_m }) => feature('Point', at(...at_m), { kind: 'room', name }));
  const track = tracks(trail, level).map((part) => part.map(([x, y]) => at(x, y)));
  const made = [...walls.filter(({ geometry }) => geometry.coordinates.length), ...names];
  if (track.length) made.push(feature('MultiLineString', track, { kind: 'track' }));
  if (estimate?.placed && estimate.level === level) made.push(feature('Point', at(estimate.x_m, estimate.y_m), { kind: 'position', status: estimate.status, radius95_m: estimate.major_m }));
  return { type: 'FeatureCollection', ...(globe ? {} : { coordinates: 'metres of the plan, not longitude and latitude: it has no georeference' }), features: made };
}

const pairs = (rows) => Array.from({ length: rows.length / 4 }, (_, k) => [...rows.subarray(4 * k, 4 * k + 4)]);

// The pieces of the track on a level; a NaN breaks it.
function tracks({ points, count }, level) {
  const pieces = [[]];
  for (let k = 0; k < count; k++) {
    const [x, y, on] = points.subarray(3 * k, 3 * k + 3);
    if (Number.isNaN(x) || on !== level) { if (pieces.at(-1).length) pieces.push([]); } else pieces.at(-1).push([x, y]);
  }
  return pieces.filter((piece) => piece.length > 1);
}

export function save(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);  // the browser has read it by then; assumed
}
