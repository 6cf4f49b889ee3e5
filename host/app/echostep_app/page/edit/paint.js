// SPDX-License-Identifier: MIT
// The sheet in SVG. In: the tools (plan, picture, selection, draft), the view and the question that is shown. Owns the SVG elements.

import { connectorsOf, startOn } from './elements.js';
import { ends, length, middle } from './geometry.js';
import { tr } from '../static/language.js';
import { halfOf, isFree } from '../static/plan.js';
import { KINDS, WORDS } from './words.js';

const SVG = 'http://www.w3.org/2000/svg';
const byId = (id) => document.getElementById(id);
const path = (rows) => rows.map(([a, b, c, d]) => `M${a} ${b}L${c} ${d}`).join('');

function mark(kind, [x, y], text, chosen) {
  const made = document.createElementNS(SVG, kind);
  made.setAttribute(kind === 'text' ? 'x' : 'cx', x);
  made.setAttribute(kind === 'text' ? 'y' : 'cy', y);
  if (kind === 'text') made.textContent = text;
  else made.setAttribute('r', 5);
  if (chosen) made.dataset.chosen = '';
  return made;
}

// The open questions of a level: their lines, dashed where they are proposed, and a mark each.
function paintQuestions(questions, shown, view) {
  const lines = (wanted) => path(questions.filter((q) => q.proposed === wanted).flatMap((q) => q.lines));
  byId('asked-lines').setAttribute('d', lines(false));
  byId('proposed').setAttribute('d', lines(true));
  return questions.flatMap((question) => {
    const [x, y] = view.toScreen(...question.at), made = [mark('circle', [x, y]), mark('text', [x, y + 5], '?')];
    for (const one of made) one.dataset.question = question === shown ? 'shown' : '';
    return made;
  });
}

// Symbol of the start: a disc with an arrow, 30 pixels long, where the wearer looks.
function startMark({ x, y, heading_deg }, view, chosen) {
  const made = document.createElementNS(SVG, 'path'), [sx, sy] = view.toScreen(x, y);
  made.id = 'start';
  made.setAttribute('d', 'M-6 0A6 6 0 1 0 6 0A6 6 0 1 0-6 0M6 0H30M22-6L30 0L22 6');
  made.setAttribute('transform', `translate(${sx} ${sy}) rotate(${-heading_deg})`);
  made.toggleAttribute('data-chosen', chosen);
  return made;
}

// Names of rooms, and of stairs, lifts and ramps in their middle; the start.
function paintNames({ sheet: { tree, k }, chosen }, view) {
  const ways = connectorsOf(tree, k).map((way) => ({ at: middle(way.outline), name: way.name || tr(KINDS[way.kind]), isChosen: chosen.has(way) }));
  const rooms = (tree.levels[k].rooms ?? []).map((room) => ({ ...room, isChosen: chosen.has(room) }));
  const names = freeNames([...rooms, ...ways].sort((a, b) => b.isChosen - a.isChosen), view);
  return startOn(tree, k) ? [...names, startMark(tree.start, view, chosen.has(tree.start))] : names;
}

// Names of which none covers an earlier one.
function freeNames(rows, view) {
  const taken = [], placed = rows.map((row) => ({ ...row, spot: [...view.toScreen(...row.at), halfOf(row.name)] }));
  return placed.filter(({ spot }) => isFree(taken, spot) && taken.push(spot)).map(({ spot, name, isChosen }) => mark('text', spot, name, isChosen));
}

export function paint(tools, view, shown) {
  const { sheet, sheet: { tree, k, level, picture }, area, chain, cross, draft } = tools, outlines = (rows) => rows.map((corners) => `M${corners.map((p) => p.join(' ')).join('L')}Z`).join('');
  byId('world').setAttribute('transform', `matrix(${view.matrix().join(' ')})`);
  const image = byId('image');
  image.toggleAttribute('hidden', !picture);
  const [perPx, x0, y0] = picture ? sheet.lies : [];
  if (picture) image.setAttribute('transform', `matrix(${perPx} 0 0 ${-perPx} ${x0} ${y0 + picture.height * perPx})`);
  const below = tree.levels.filter(({ height_m }) => height_m < level.height_m).sort((a, b) => b.height_m - a.height_m)[0];
  const lines = {
    below: path(below?.walls ?? []), walls: path(level.walls), windows: path(level.windows ?? []), doors: path((level.doors ?? []).map((door) => door.line)),
    obstacles: outlines(level.obstacles ?? []), connectors: outlines(connectorsOf(tree, k).map(({ outline }) => outline)),
    chosen: path(tools.selected.flatMap(({ rows }) => rows)), draft: path(draft ? [draft] : []), area: outlines(area ? [area.corners] : []),
  };
  for (const [id, d] of Object.entries(lines)) byId(id).setAttribute('d', d);
  const points = (chain ? [chain.at] : []).map((p) => mark('circle', view.toScreen(...p)));
  byId('marks').replaceChildren(...points, ...paintNames(tools, view), ...paintQuestions(level.questions ?? [], shown, view));
  byId('cross').setAttribute('transform', `translate(${view.toScreen(...cross).join(' ')})`);
  const label = byId('measure'), [x, y] = view.toScreen(...middle(ends(draft ?? [0, 0, 0, 0])));
  label.textContent = draft && length(draft) > 0 ? tr(WORDS.length(length(draft))) : '';
  label.setAttribute('x', x);
  label.setAttribute('y', y - 12);
}
