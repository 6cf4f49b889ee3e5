// SPDX-License-Identifier: MIT
// The sheet in SVG. In: a level, the picture's position, the view, the selected element and the draft. Owns the SVG elements.

import { ends, length } from './geometry.js';

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

export function paint({ level, picture, view, chosen, shown, draft, measure, cross, points }) {
  byId('world').setAttribute('transform', `matrix(${view.matrix().join(' ')})`);
  const image = byId('image');
  image.toggleAttribute('hidden', !picture);
  if (picture) image.setAttribute('transform', `matrix(${picture.perPx} 0 0 ${-picture.perPx} ${picture.x} ${picture.y + picture.height * picture.perPx})`);
  const doors = level.doors ?? [];
  byId('walls').setAttribute('d', path(level.walls));
  byId('windows').setAttribute('d', path(level.windows ?? []));
  byId('obstacles').setAttribute('d', (level.obstacles ?? []).map((o) => `M${o.map((p) => p.join(' ')).join('L')}Z`).join(''));
  byId('doors').setAttribute('d', path(doors.map((door) => door.line)));
  const row = chosen && { wall: level.walls[chosen.k], end: level.walls[chosen.k], door: doors[chosen.k]?.line }[chosen.kind];
  byId('chosen').setAttribute('d', row ? path([row]) : '');
  byId('draft').setAttribute('d', draft ? path([draft]) : '');
  const marks = (level.rooms ?? []).map((room, k) => mark('text', view.toScreen(...room.at), room.name, chosen?.kind === 'room' && chosen.k === k));
  for (const p of [...(row ? ends(row) : []), ...points]) marks.push(mark('circle', view.toScreen(...p)));
  byId('marks').replaceChildren(...marks, ...paintQuestions(level.questions ?? [], shown, view));
  byId('cross').setAttribute('transform', `translate(${view.toScreen(...cross).join(' ')})`);
  const measured = draft ?? (measure ? row : null), text = byId('measure');
  text.textContent = measured && length(measured) > 0 ? `${length(measured).toFixed(2)} m` : '';
  if (measured) {
    const [x, y] = view.toScreen((measured[0] + measured[2]) / 2, (measured[1] + measured[3]) / 2);
    text.setAttribute('x', x);
    text.setAttribute('y', y - 12);
  }
}
