// SPDX-License-Identifier: MIT
// Geometry of the plan editor: pure functions from a level of plan.json {walls, doors, windows, rooms, ...} to a new level. Metres, x east, y north.

const GRID_M = 0.05;
const JOINT_M = 1e-3; // ends with a smaller distance are one joint
const THICK_M = 0.6, JAMB_M = 0.15; // distance of a wall's two faces, and of a door's end from the wall's end there, at most
const PARALLEL = 0.02; // sine of the angle below which the faces of a wall are parallel
const IN_LINE = 1e-3; // sine of the angle below which two segments are in line

export const round = (v) => Math.round(v * 1e4) / 1e4;
export const onGrid = (v) => round(Math.round(v / GRID_M) * GRID_M);
export const distance = ([ax, ay], [bx, by]) => Math.hypot(bx - ax, by - ay);
export const same = (a, b) => distance(a, b) < JOINT_M;
export const ends = ([x0, y0, x1, y1]) => [[x0, y0], [x1, y1]];
export const length = (s) => distance(...ends(s));
const unit = ([ax, ay], [bx, by]) => { const l = Math.hypot(bx - ax, by - ay); return [(bx - ax) / l, (by - ay) / l]; };
const spot = ([x, y]) => [round(x), round(y)];

// The point of a segment nearest to p: its position `at`, its share `t` of the segment (0 to 1), its distance `away` from p.
export function foot(p, [x0, y0, x1, y1]) {
  const dx = x1 - x0, dy = y1 - y0, t = Math.min(Math.max(((p[0] - x0) * dx + (p[1] - y0) * dy) / (dx * dx + dy * dy || 1), 0), 1);
  const at = [x0 + t * dx, y0 + t * dy];
  return { at, t, away: distance(p, at) };
}

function nearest(p, rows, reach) {
  let found = null;
  rows.forEach((row, k) => {
    const here = foot(p, row);
    if (here.away <= reach && (!found || here.away < found.away)) found = { ...here, k };
  });
  return found;
}

// Snap a point: to the end of a wall, to a right angle with the last wall of the chain (or along x or y), onto a wall, or to the grid.
export function snap(p, { walls = [], from = null, before = null, reach = 0.2 } = {}) {
  const near = walls.flatMap(ends).filter((e) => distance(e, p) <= reach && !(from && same(e, from))).sort((a, b) => distance(a, p) - distance(b, p))[0];
  if (near) return { at: near, kind: 'end' };
  if (from && distance(from, p) > 0) {
    const u = before && !same(before, from) ? unit(before, from) : [1, 0];
    for (const [ux, uy] of [u, [-u[1], u[0]], [1, 0], [0, 1]]) {
      const along = (p[0] - from[0]) * ux + (p[1] - from[1]) * uy, off = Math.abs((p[1] - from[1]) * ux - (p[0] - from[0]) * uy);
      if (off > reach || Math.abs(along) <= off) continue;
      const wall = walls.map((w) => crossing(from, [ux, uy], w)).filter((c) => c && distance(c, p) <= reach && !same(c, from)).sort((a, b) => distance(a, p) - distance(b, p))[0];
      if (wall) return { at: spot(wall), kind: 'wall' };
      const far = Math.round(along / GRID_M) * GRID_M;
      if (far) return { at: spot([from[0] + far * ux, from[1] + far * uy]), kind: 'right angle' };
    }
  }
  const wall = nearest(p, walls, reach);
  if (wall) return { at: spot(wall.at), kind: 'wall' };
  return { at: [onGrid(p[0]), onGrid(p[1])], kind: 'grid' };
}

// The intersection of a line (point, unit vector) with a segment, or null.
function crossing([px, py], [ux, uy], [x0, y0, x1, y1]) {
  const vx = x1 - x0, vy = y1 - y0, d = ux * vy - uy * vx;
  if (Math.abs(d) < IN_LINE * Math.hypot(vx, vy)) return null;
  const t = ((x0 - px) * uy - (y0 - py) * ux) / d;
  return t < 0 || t > 1 ? null : [x0 + t * vx, y0 + t * vy];
}

// Cut a door of a width into wall k at the point nearest to p, in steps of 5 cm along the wall; null where the wall is too short. Remaining pieces shorter than a joint are dropped.
// Of a wall that is drawn as two faces the other one is cut too, and the gap's ends join both.
export function cutDoor(level, k, p, width, kept = { state: 'unknown' }) {
  const wall = level.walls[k], [a, b] = ends(wall), long = length(wall);
  if (!(width > JOINT_M) || long < width - JOINT_M) return null;
  const u = unit(a, b), w = Math.min(width, long);
  let s = Math.min(Math.max(foot(p, wall).t * long - w / 2, 0), long - w);
  s = Math.min(Math.round(s / GRID_M) * GRID_M, long - w);
  const at = (d) => (d <= JOINT_M ? a : d >= long - JOINT_M ? b : spot([a[0] + d * u[0], a[1] + d * u[1]]));
  const jambs = [at(s), at(s + w)], other = otherFace(level.walls, k, jambs), walls = level.walls.toSpliced(k, 1, ...beside(wall, jambs));
  if (other >= 0) {
    const face = level.walls[other], across = jambs.map((e) => spot(foot(e, face).at));
    walls.splice(walls.indexOf(face), 1, ...beside(face, across));
    jambs.forEach((e, i) => { if (!ends(wall).some((corner) => same(corner, e))) walls.push([...e, ...across[i]]); });
  }
  return { ...level, walls, doors: [...(level.doors ?? []), { ...kept, line: jambs.flat() }] };
}

// The parts of a wall on both sides of the piece between two points on it, in the order of the wall.
function beside(wall, [p, q]) {
  const [near, far] = foot(p, wall).t <= foot(q, wall).t ? [p, q] : [q, p], [a, b] = ends(wall);
  return [[...a, ...near], [...far, ...b]].filter((part) => length(part) > JOINT_M);
}

// The other face of the wall whose one face is wall k: the index of the nearest parallel wall all along the piece from p to q, or -1.
function otherFace(walls, k, [p, q]) {
  const u = unit(p, q), along = (e) => (e[0] - p[0]) * u[0] + (e[1] - p[1]) * u[1];
  let found = -1, least = THICK_M;
  walls.forEach((row, i) => {
    const [a, b] = ends(row), v = unit(a, b), away = Math.abs((a[0] - p[0]) * u[1] - (a[1] - p[1]) * u[0]);
    const covers = Math.min(along(a), along(b)) < JOINT_M && Math.max(along(a), along(b)) > distance(p, q) - JOINT_M;
    if (i !== k && covers && Math.abs(u[0] * v[1] - u[1] * v[0]) < PARALLEL && away > JOINT_M && away < least) [found, least] = [i, away];
  });
  return found;
}

// Whether two segments are in line and share an end.
function continues(a, b) {
  const [[p, q], [r, s]] = [ends(a), ends(b)];
  const [ux, uy] = unit(p, q), [vx, vy] = unit(r, s);
  return Math.abs(ux * vy - uy * vx) < IN_LINE && [p, q].some((e) => same(e, r) || same(e, s));
}

// Fill the gap of a line: the walls that continue it and the gap become one wall, the last. Returns the walls; the same ones when no wall is beside the gap.
function filled(walls, line) {
  const joined = [];
  for (const end of ends(line)) {
    const i = walls.findIndex((w, j) => !joined.includes(j) && continues(line, w) && ends(w).some((e) => same(e, end)));
    if (i >= 0) joined.push(i);
  }
  if (!joined.length) return walls;
  const points = [...ends(line), ...joined.flatMap((i) => ends(walls[i]))], u = unit(...ends(line));
  const along = (e) => e[0] * u[0] + e[1] * u[1];
  points.sort((a, b) => along(a) - along(b));
  return [...walls.filter((_, i) => !joined.includes(i)), [...points[0], ...points.at(-1)]];
}

// The two ends of a gap in a wall that is drawn as two faces: short walls across the line, one at each of its ends; null for other gaps.
function jambsOf(walls, line) {
  const u = unit(...ends(line)), found = ends(line).map((end) => walls.find((w) => {
    const v = unit(...ends(w));
    return length(w) < THICK_M && Math.abs(u[0] * v[0] + u[1] * v[1]) < PARALLEL && foot(end, w).away < JAMB_M;
  }));
  return found.every(Boolean) && Math.abs(length(found[0]) - length(found[1])) < GRID_M ? found : null;
}

// Close the gap of a line: the walls on both sides and the gap become one wall, of a wall with two faces both. Returns the walls.
export function closed(walls, line) {
  const jambs = jambsOf(walls, line);
  if (!jambs) return filled(walls, line);
  const [[a, b], other] = jambs.map(ends), [c, d] = distance(a, other[0]) < distance(a, other[1]) ? other : other.toReversed();
  const off = (row) => foot(line.slice(0, 2), row).away, faces = [[...a, ...c], [...b, ...d]].sort((one, two) => off(two) - off(one));
  return faces.reduce(filled, walls.filter((wall) => !jambs.includes(wall)));
}

export const sides = (corners) => corners.map((p, i) => [...p, ...corners[(i + 1) % corners.length]]);
export const middle = (corners) => [0, 1].map((i) => (Math.max(...corners.map((p) => p[i])) + Math.min(...corners.map((p) => p[i]))) / 2);
export const rectangle = ([ax, ay], [bx, by]) => [[ax, ay], [bx, ay], [bx, by], [ax, by]];

function inside([x, y], corners) {
  return sides(corners).filter(([x0, y0, x1, y1]) => y0 > y !== y1 > y && x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)).length % 2 === 1;
}

// On which side of a segment a point lies, by its sign.
const sideOf = ([x0, y0, x1, y1], [x, y]) => (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0);
const cross = (a, b) => [[a, b], [b, a]].every(([row, other]) => { const [p, q] = ends(other); return sideOf(row, p) * sideOf(row, q) < 0; });

// Whether a segment lies wholly within a polygon.
export const within = (row, corners) => ends(row).every((p) => inside(p, corners)) && !sides(corners).some((side) => cross(row, side));

// The bounds of segments.
export function box(rows) {
  const bound = (picks, of) => rows.flatMap((row) => picks.map((i) => row[i])).reduce((a, b) => of(a, b));
  return rows.length ? [bound([0, 2], Math.min), bound([1, 3], Math.min), bound([0, 2], Math.max), bound([1, 3], Math.max)] : [0, 0, 10, 8];
}
