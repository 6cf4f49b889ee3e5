// SPDX-License-Identifier: MIT
// The sheet in SVG. In: the tools (plan, picture, selected element, draft), the view and the question that is shown. Owns the SVG elements.

import { ends, length } from './geometry.js';
import { middle, outlined, outlineOf, sides, size, startOn } from './shapes.js';
import { tr } from './language.js';
import { halfOf, isFree } from './plan.js';
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

// The elements that are outlines; names of rooms, and of stairs, lifts and ramps in their middle. Returns the names and the start.
function paintShapes({ tree, sheet: { k }, chosen }, view) {
  const rows = outlined(tree, k), closed = (kind) => rows.filter((row) => row.kind === kind).map(({ outline }) => `M${outline.map((p) => p.join(' ')).join('L')}Z`).join('');
  byId('obstacles').setAttribute('d', closed('obstacle'));
  byId('connectors').setAttribute('d', closed('connector'));
  const ways = rows.filter(({ way }) => way).map(({ outline, way, name }) => ({ at: middle(outline), name: name || tr(KINDS[way]) }));
  const rooms = (tree.levels[k].rooms ?? []).map((room, n) => ({ ...room, isChosen: chosen?.kind === 'room' && chosen.k === n }));
  const names = paintNames([...rooms, ...ways].sort((a, b) => (b.isChosen ?? false) - (a.isChosen ?? false)), view);
  return startOn(tree, k) ? [...names, startMark(tree.start, view, chosen?.kind === 'start')] : names;
}

// Names of which none covers an earlier one.
function paintNames(rows, view) {
  const taken = [], placed = rows.map((row) => ({ ...row, spot: [...view.toScreen(...row.at), halfOf(row.name)] }));
  return placed.filter(({ spot }) => isFree(taken, spot) && taken.push(spot)).map(({ spot, name, isChosen }) => mark('text', spot, name, isChosen));
}

// The segments of the selected element.
function chosenRows({ tree, level, sheet: { k }, chosen }) {
  if (!chosen) return [];
  const { kind, of } = chosen;
  if (kind === 'obstacle' || kind === 'connector' || of) return sides(outlineOf(tree, k, of ?? chosen));
  return [{ wall: level.walls[chosen.k], end: level.walls[chosen.k], door: level.doors?.[chosen.k]?.line, window: level.windows?.[chosen.k] }[kind]].filter(Boolean);
}

// The length of what is drawn or moved, or the size of a rectangle: [text, position].
function measured({ draft, box, live }, rows) {
  if (box) return [tr(WORDS.size(...size(box))), middle(box)];
  const row = draft ?? (live && rows.length === 1 ? rows[0] : null);
  return row && length(row) > 0 ? [tr(WORDS.length(...ends(row))), middle(ends(row))] : ['', [0, 0]];
}

export function paint(tools, view, shown) {
  const { level, picture, draft, box, chain, cross, points } = tools, doors = level.doors ?? [];
  byId('world').setAttribute('transform', `matrix(${view.matrix().join(' ')})`);
  const image = byId('image');
  image.toggleAttribute('hidden', !picture);
  if (picture) image.setAttribute('transform', `matrix(${picture.perPx} 0 0 ${-picture.perPx} ${picture.x} ${picture.y + picture.height * picture.perPx})`);
  const below = tools.tree.levels.filter(({ height_m }) => height_m < level.height_m).sort((a, b) => b.height_m - a.height_m)[0];
  byId('below').setAttribute('d', path(below?.walls ?? []));
  byId('walls').setAttribute('d', path(level.walls));
  byId('windows').setAttribute('d', path(level.windows ?? []));
  byId('doors').setAttribute('d', path(doors.map((door) => door.line)));
  const rows = chosenRows(tools), drawn = chain?.corners ? sides(chain.corners).slice(0, -1) : [];
  byId('chosen').setAttribute('d', path(rows));
  byId('draft').setAttribute('d', path([...drawn, ...(box ? sides(box) : draft ? [draft] : [])]));
  const marks = [...rows.flatMap(ends), ...points].map((p) => mark('circle', view.toScreen(...p)));
  byId('marks').replaceChildren(...marks, ...paintShapes(tools, view), ...paintQuestions(level.questions ?? [], shown, view));
  byId('cross').setAttribute('transform', `translate(${view.toScreen(...cross).join(' ')})`);
  const [text, at] = measured(tools, rows), [x, y] = view.toScreen(...at), label = byId('measure');
  label.textContent = text;
  label.setAttribute('x', x);
  label.setAttribute('y', y - 12);
}
