// SPDX-License-Identifier: MIT
// The view as a picture (PNG) and as GeoJSON, to be saved.

const WALL_PX = 1.6;

// What the map shows: walls, canvas, names, on the ground's colour.
export async function picture(view, wallsGroup, canvas, roomsGroup) {
  const sharp = window.devicePixelRatio || 1, sheet = new OffscreenCanvas(canvas.width, canvas.height), pen = sheet.getContext('2d');
  const style = getComputedStyle(document.documentElement), colour = (name) => style.getPropertyValue(`--${name}`).trim();
  pen.fillStyle = colour('ground');
  pen.fillRect(0, 0, sheet.width, sheet.height);
  pen.setTransform(...view.matrix().map((value) => value * sharp));
  Object.assign(pen, { strokeStyle: colour('wall'), lineWidth: WALL_PX / view.scale });
  for (const path of wallsGroup.children) {
    pen.setLineDash(path.classList.contains('unknown') ? [3 / view.scale, 3 / view.scale] : []);
    pen.stroke(new Path2D(path.getAttribute('d')));
  }
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.drawImage(canvas, 0, 0);
  pen.setTransform(sharp, 0, 0, sharp, 0, 0);
  Object.assign(pen, { font: '13px system-ui, sans-serif', textAlign: 'center', textBaseline: 'middle', lineWidth: 4, strokeStyle: colour('ground'), fillStyle: colour('room') });
  for (const text of roomsGroup.children) {
    if (text.getAttribute('visibility') !== 'visible' || roomsGroup.hasAttribute('hidden')) continue;
    const at = [Number(text.getAttribute('x')), Number(text.getAttribute('y'))];
    pen.strokeText(text.textContent, ...at);
    pen.fillText(text.textContent, ...at);
  }
  return sheet.convertToBlob({ type: 'image/png' });
}

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
