// SPDX-License-Identifier: MIT
// Tools that draw an outline (obstacle, stairs, lift, ramp), corner by corner or as a rectangle by a drag, and the start. In: tools, positions. Out: changes of the sheet.
// The chain of the tools has the corners so far; `box`: a rectangle from its first corner.

import { distance, foot, same } from './geometry.js';
import { addConnector, addObstacle, changeConnector, cleaned, hitShape, joined, outlineOf, sides, size } from './shapes.js';
import { WORDS } from './words.js';

export const CONNECTORS = ['stairs', 'lift', 'ramp'];
export const OUTLINES = ['obstacle', ...CONNECTORS];

export const rectangle = ([ax, ay], [bx, by]) => [[ax, ay], [bx, ay], [bx, by], [ax, by]];

export function outlineClick(tools, p) {
  const { sheet, chain, desk, name } = tools;
  if (name !== 'obstacle' && sheet.tree.levels.length < 2) { tools.stop(); desk.say(WORDS.oneLevel(name)); return; }
  if (chain?.box) { finish(tools, rectangle(chain.at, tools.snapped(p).at)); return; }
  const there = chain ? -1 : connectorAbout(tools, p);
  if (there >= 0 && name !== 'obstacle') { change(tools, there); return; }
  const { at } = tools.snapped(p);
  if (chain && (same(at, chain.at) || same(at, chain.corners[0]))) endOutline(tools);
  else addCorner(tools, at);
}

export function addCorner(tools, at) {
  const corners = [...(tools.chain?.corners ?? []), at];
  Object.assign(tools, { chain: { at, before: tools.chain?.at, corners }, points: corners, draft: null });
  tools.desk.say(WORDS.corner(corners.length, at));
}

export const endOutline = (tools) => finish(tools, tools.chain.corners);

// The connector whose inside p is in, farther than reach from its sides, or -1: a click there changes it, one on its sides begins the next outline.
function connectorAbout({ sheet, reach }, p) {
  const found = hitShape(sheet.tree, sheet.k, p, 0);
  return found?.kind === 'connector' && sides(outlineOf(sheet.tree, sheet.k, found)).every((side) => foot(p, side).away > reach) ? found.k : -1;
}

async function finish(tools, corners) {
  const { sheet, desk, name } = tools, { k } = sheet, outline = cleaned(corners);
  tools.stop();
  if (!outline) { desk.say(WORDS.noOutline); return; }
  if (name === 'obstacle') sheet.change(addObstacle(sheet.tree, k, outline), WORDS.outline(name, size(outline)));
  else {
    const fields = await desk.askConnector(name, { name: '', levels: joined(sheet.tree, k) });
    if (fields) sheet.change(addConnector(sheet.tree, { kind: name, ...fields, outline }), told(sheet, name, fields));
    else desk.say(WORDS.givenUp(name));
  }
  desk.changed();
}

async function change(tools, index) {
  const { sheet, desk, name } = tools, { name: called, levels } = sheet.tree.connectors[index];
  const fields = await desk.askConnector(name, { name: called ?? '', levels });
  if (fields) sheet.change(changeConnector(sheet.tree, index, { kind: name, ...fields }), told(sheet, name, fields));
  desk.changed();
}

const told = (sheet, kind, { levels }) => WORDS.connector(kind, levels.map((k) => sheet.tree.levels[k].name));

export function startClick(tools, p) {
  const { chain, desk } = tools, { at } = tools.snapped(p);
  if (!chain) {
    Object.assign(tools, { chain: { at }, points: [at] });
    desk.say(WORDS.looks(at));
  } else if (distance(chain.at, at) > 0) setStart(tools, Math.atan2(at[1] - chain.at[1], at[0] - chain.at[0]) * 180 / Math.PI);
  else desk.say(WORDS.noDirection);
}

export function setStart(tools, heading) {
  const { sheet, chain: { at: [x, y] } } = tools, heading_deg = Math.round(heading * 10) / 10;
  tools.stop();
  sheet.change({ ...sheet.tree, start: { x, y, heading_deg, level: sheet.k } }, WORDS.start([x, y], heading_deg));
}
