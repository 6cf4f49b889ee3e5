// SPDX-License-Identifier: MIT
// Typed lengths and angles: the next wall or side of an outline, the direction of the start, the movement of the chosen element. In: tools and texts. Out: changes of the sheet.

import { ends, round, same } from './geometry.js';
import { OUTLINES, addCorner, endOutline, setStart } from './outline.js';
import { WORDS } from './words.js';

const SHORTEST_M = 0.01, LONGEST_M = 1e4, FARTHEST_M = 1e5; // the last one: plan.schema.json
const number = (text) => (text.trim() ? Number(text.trim().replace(',', '.')) : null);

export const takesTyped = ({ name }) => ['select', 'wall', 'start', ...OUTLINES].includes(name);

// Returns whether something was done.
export function typed(tools, lengthText, angleText) {
  const { name, chain, chosen, desk } = tools, length = number(lengthText), angle = number(angleText);
  const refuse = (words) => { desk.say(words); return false; };
  if (angle !== null && !Number.isFinite(angle)) return refuse(WORDS.badAngle);
  if (name === 'select' ? !chosen : !chain || chain.box) return refuse(name === 'select' ? WORDS.noChosen : WORDS.noFirst);
  if (name === 'start') return angle === null ? refuse(WORDS.needAngle) : (setStart(tools, angle), true);
  if (!(length >= SHORTEST_M && length <= LONGEST_M)) return refuse(WORDS.badLength(SHORTEST_M, LONGEST_M));
  const by = vector(length, angle, name === 'select' ? null : tools.draft);
  if (!by) return refuse(WORDS.needAngle);
  return (name === 'select' ? move(tools, by) : draw(tools, by)) || refuse(WORDS.noMove);
}

// A length at an angle, or without one in the direction of the draft; null without both.
function vector(length, angle, draft) {
  const [a, b] = draft ? ends(draft) : [], turn = angle === null ? draft && !same(a, b) && Math.atan2(b[1] - a[1], b[0] - a[0]) : angle * Math.PI / 180;
  return typeof turn === 'number' ? [length * Math.cos(turn), length * Math.sin(turn)].map(round) : null;
}

function draw(tools, [dx, dy]) {
  const { chain, name, view } = tools, at = [round(chain.at[0] + dx), round(chain.at[1] + dy)];
  if (at.some((v) => Math.abs(v) > FARTHEST_M)) return false;
  if (name === 'wall') tools.wallTo(at, 'typed');
  else if (same(at, chain.corners[0])) endOutline(tools);
  else addCorner(tools, at);
  tools.cross = at;
  view.keep(...at);
  return true;
}

function move(tools, by) {
  const moved = tools.dragged(tools.chosen, by, true);
  if (!moved || !(moved.by[0] || moved.by[1])) return false;
  tools.take(moved);
  return true;
}
