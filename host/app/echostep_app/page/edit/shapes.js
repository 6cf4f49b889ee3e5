// SPDX-License-Identifier: MIT
// Obstacles, connectors (stairs, lifts, ramps) and the start: pure functions from a plan to a new one. A *level* is an index; a *shape* is
// {kind: 'start'} | {kind: 'obstacle' | 'connector', k: index}, or a corner of one: {kind: 'corner', of: shape, i: index of the corner}.

import { distance, foot, round, same } from './geometry.js';

export const sides = (outline) => outline.map((p, i) => [...p, ...outline[(i + 1) % outline.length]]);
export const size = (outline) => [0, 1].map((i) => Math.max(...outline.map((p) => p[i])) - Math.min(...outline.map((p) => p[i])));
export const middle = (outline) => [0, 1].map((i) => (Math.max(...outline.map((p) => p[i])) + Math.min(...outline.map((p) => p[i]))) / 2);
export const startOn = (tree, level) => tree.start && (tree.start.level ?? 0) === level;
const shifted = ([x, y], [dx, dy]) => [round(x + dx), round(y + dy)];

// The shapes of a level that have an outline.
export function outlined(tree, level) {
  const obstacles = (tree.levels[level].obstacles ?? []).map((outline, k) => ({ kind: 'obstacle', k, outline }));
  const connectors = (tree.connectors ?? []).map(({ outline, kind, name, levels }, k) => ({ kind: 'connector', k, outline, way: kind, name, levels }));
  return [...obstacles, ...connectors.filter(({ levels }) => levels.includes(level))];
}

export const outlineOf = (tree, level, { kind, k }) => (kind === 'obstacle' ? tree.levels[level].obstacles[k] : tree.connectors[k].outline);

// What a shape is, for people: stairs rather than connector.
export const kindOf = (tree, { kind, k }) => (kind === 'connector' ? tree.connectors[k].kind : kind);

export const isShape = (found) => ['start', 'corner', 'obstacle', 'connector'].includes(found?.kind);
export const sameShape = (a, b) => a && b && a.kind === b.kind && a.k === b.k;

function inside([x, y], outline) {
  let is = false;
  for (const [x0, y0, x1, y1] of sides(outline)) if (y0 > y !== y1 > y && x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)) is = !is;
  return is;
}

// The shape at p: the start, a corner or a side within reach, else the smallest outline about p; or null.
export function hitShape(tree, level, p, reach) {
  if (startOn(tree, level) && distance([tree.start.x, tree.start.y], p) <= reach) return { kind: 'start' };
  const rows = outlined(tree, level), shape = ({ kind, k }) => ({ kind, k });
  const corners = rows.flatMap((row) => row.outline.map((at, i) => ({ kind: 'corner', of: shape(row), i, away: distance(at, p) })));
  const near = corners.filter(({ away }) => away <= reach).sort((a, b) => a.away - b.away)[0];
  if (near) return { kind: 'corner', of: near.of, i: near.i };
  const side = rows.find(({ outline }) => sides(outline).some((row) => foot(p, row).away <= reach));
  const area = ({ outline }) => { const [w, h] = size(outline); return w * h; };
  const found = side ?? rows.filter(({ outline }) => inside(p, outline)).sort((a, b) => area(a) - area(b))[0];
  return found ? shape(found) : null;
}

function withOutline(tree, level, { kind, k }, outline) {
  if (kind === 'connector') return { ...tree, connectors: tree.connectors.with(k, { ...tree.connectors[k], outline }) };
  return withObstacles(tree, level, tree.levels[level].obstacles.with(k, outline));
}

const withObstacles = (tree, level, obstacles) => ({ ...tree, levels: tree.levels.with(level, { ...tree.levels[level], obstacles }) });

// The plan with a shape moved by a vector; null where an outline would have fewer than three corners.
export function movedShape(tree, level, shape, by) {
  if (shape.kind === 'start') { const [x, y] = shifted([tree.start.x, tree.start.y], by); return { ...tree, start: { ...tree.start, x, y } }; }
  const whole = shape.of ?? shape, outline = outlineOf(tree, level, whole);
  const moved = cleaned(outline.map((p, i) => (!shape.of || i === shape.i ? shifted(p, by) : p)));
  return moved && withOutline(tree, level, whole, moved);
}

export function removedShape(tree, level, shape) {
  if (shape.kind === 'start') return { ...tree, start: null };
  const { kind, k } = shape.of ?? shape;
  return kind === 'connector' ? { ...tree, connectors: tree.connectors.toSpliced(k, 1) } : withObstacles(tree, level, tree.levels[level].obstacles.toSpliced(k, 1));
}

export const addObstacle = (tree, level, outline) => withObstacles(tree, level, [...(tree.levels[level].obstacles ?? []), outline]);
export const addConnector = (tree, connector) => ({ ...tree, connectors: [...(tree.connectors ?? []), connector] });
export const changeConnector = (tree, k, fields) => ({ ...tree, connectors: tree.connectors.with(k, { ...tree.connectors[k], ...fields }) });

// An outline without corners that are repeated; null where fewer than three are left.
export function cleaned(corners) {
  const left = corners.filter((p, i) => !same(p, corners[(i + 1) % corners.length]));
  return left.length < 3 ? null : left;
}

// The levels that a new connector joins, unless people say otherwise: this one and the next higher one; on the highest the next lower one.
export function joined(tree, level) {
  const height = (k) => tree.levels[k].height_m, others = tree.levels.map((_, k) => k).filter((k) => k !== level);
  const above = others.filter((k) => height(k) > height(level)).sort((a, b) => height(a) - height(b))[0];
  const below = others.sort((a, b) => height(b) - height(a)).find((k) => height(k) <= height(level));
  return [level, above ?? below].sort((a, b) => a - b);
}
