// SPDX-License-Identifier: MIT
// Questions that an import left: {text, about: door | wall | room, at, lines, proposed}. In: a level of plan.json. Out: a new level with the answer in it.
// A question is open while its element is proposed, or still there as it was: a door that is moved or deleted otherwise answers its question.

import { closed, cutDoor, distance, ends, foot, length, onGrid, same } from './geometry.js';

const WALL_REACH_M = 1; // a door is put into a wall that is nearer than this

const alike = (a, b) => ends(a).every((end, k) => same(end, ends(b)[k]));
const doorOf = (level, { lines }) => (level.doors ?? []).findIndex((door) => lines.some((line) => alike(door.line, line)));
const isOf = ({ at, lines }) => (room) => [at, ...lines.map((line) => line.slice(0, 2))].some((place) => same(room.at, place));
const withoutDoor = (level, k) => ({ ...level, walls: closed(level.walls, level.doors[k].line), doors: level.doors.toSpliced(k, 1) });
const without = (level, question) => ({ ...level, questions: level.questions.filter((other) => other !== question) });

const isOpen = (level, question) => question.proposed
  || (question.about === 'door' ? doorOf(level, question) >= 0 : question.about === 'room' ? (level.rooms ?? []).some(isOf(question)) : level.walls.some((wall) => question.lines.some((line) => alike(wall, line))));

// The level without the questions that a change has answered.
export function settled(level) {
  const open = level.questions?.filter((question) => isOpen(level, question));
  return open && open.length < level.questions.length ? { ...level, questions: open } : level;
}

// Yes: what is proposed becomes a part of the plan, what is there stays.
export function accept(level, question) {
  const left = without(level, question), { lines } = question;
  if (!question.proposed) return left;
  if (question.about === 'wall') return { ...left, walls: [...left.walls, ...lines] };
  return { ...left, doors: [...(left.doors ?? []), ...lines.map((line) => ({ line, state: 'unknown' }))] };
}

// No: what is proposed is forgotten, what is there is deleted; the wall is closed where a door was.
export function reject(level, question) {
  const left = without(level, question);
  if (question.proposed) return left;
  if (question.about === 'room') return { ...left, rooms: left.rooms.filter((room) => !isOf(question)(room)) };
  if (question.about === 'door') return question.lines.reduce((kept, line) => {
    const k = doorOf(kept, { lines: [line] });
    return k < 0 ? kept : withoutDoor(kept, k);
  }, left);
  return { ...left, walls: left.walls.filter((wall) => !question.lines.some((line) => alike(wall, line))) };
}

// Put a door or a room where it belongs: a door into the wall nearest to p. Null where there is none, for walls, and for many doors or rooms.
export function put(level, question, p) {
  if (question.about === 'wall' || question.lines.length > 1) return null;
  const left = without(level, question);
  if (question.about === 'room') {
    const k = left.rooms.findIndex(isOf(question));
    return { ...left, rooms: left.rooms.with(k, { ...left.rooms[k], at: p.map(onGrid) }) };
  }
  const k = question.proposed ? -1 : doorOf(left, question), { line, ...kept } = k < 0 ? { line: question.lines[0], state: 'unknown' } : left.doors[k];
  const base = k < 0 ? left : withoutDoor(left, k);
  const near = base.walls.map((wall, w) => ({ w, ...foot(p, wall) })).sort((a, b) => a.away - b.away)[0];
  return near && near.away < WALL_REACH_M ? cutDoor(base, near.w, p, length(line), kept) : null;
}

// The open question nearest to p within reach, or undefined.
export const questionAt = (level, p, reach) => (level.questions ?? []).filter(({ at }) => distance(at, p) <= reach).sort((a, b) => distance(a.at, p) - distance(b.at, p))[0];
