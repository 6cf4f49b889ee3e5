// SPDX-License-Identifier: MIT
// The elements of a level: {of: the object in the plan's tree, rows: its segments; one without a length of what is a point}. Pure functions from a plan to elements and to a new plan.

import { closed, foot, sides, within } from './geometry.js';
import { settled } from './questions.js';

export const startOn = (tree, level) => tree.start && (tree.start.level ?? 0) === level;

// The connectors (stairs, lifts, ramps) that join a level with others.
export const connectorsOf = (tree, level) => (tree.connectors ?? []).filter(({ levels }) => levels.includes(level));

export function elementsOf(tree, level) {
  const { walls, windows = [], doors = [], obstacles = [], rooms = [] } = tree.levels[level], { x, y } = tree.start ?? {};
  return [
    ...[...walls, ...windows].map((of) => ({ of, rows: [of] })),
    ...doors.map((of) => ({ of, rows: [of.line] })),
    ...obstacles.map((of) => ({ of, rows: sides(of) })),
    ...connectorsOf(tree, level).map((of) => ({ of, rows: sides(of.outline) })),
    ...rooms.map((of) => ({ of, rows: [[...of.at, ...of.at]] })),
    ...(startOn(tree, level) ? [{ of: tree.start, rows: [[x, y, x, y]] }] : []),
  ];
}

const away = ({ rows }, p) => Math.min(...rows.map((row) => foot(p, row).away));

// The element nearest to p within reach, or undefined.
export const elementAt = (elements, p, reach) => elements.map((element) => ({ element, away: away(element, p) })).filter((one) => one.away <= reach).sort((a, b) => a.away - b.away)[0]?.element;

// The elements that lie wholly within a polygon.
export const elementsWithin = (elements, corners) => elements.filter(({ rows }) => rows.every((row) => within(row, corners)));

// The plan without the elements of a level whose objects are in a set; the walls beside a door or window are joined.
export function without(tree, k, gone) {
  const kept = (list) => list.filter((one) => !gone.has(one)), level = { ...tree.levels[k] };
  const gaps = [...(level.doors ?? []).filter((door) => gone.has(door)).map(({ line }) => line), ...(level.windows ?? []).filter((line) => gone.has(line))];
  for (const field of ['walls', 'windows', 'doors', 'rooms', 'obstacles']) if (level[field]) level[field] = kept(level[field]);
  level.walls = gaps.reduce(closed, level.walls);
  return {
    ...tree, levels: tree.levels.with(k, settled(level)),
    ...(tree.connectors && { connectors: kept(tree.connectors) }), ...(gone.has(tree.start) && { start: null }),
  };
}
