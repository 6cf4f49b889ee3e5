// SPDX-License-Identifier: MIT
// Marks that commanders set: a cleared room (square, tick), a hazard (diamond, exclamation mark), no way (octagon, cross), a meeting point (circle, M); on the wearer's and the commander's page.

const LOOKS = {
  cleared: { letter: '✓', colour: 'good', words: 'cleared', shape: [[-9, -9], [9, -9], [9, 9], [-9, 9]] },
  hazard: { letter: '!', colour: 'bad', words: 'hazard', shape: [[0, -13], [13, 0], [0, 13], [-13, 0]] },
  blocked: { letter: '✕', colour: 'bad', words: 'no way', shape: [[-5, -11], [5, -11], [11, -5], [11, 5], [5, 11], [-5, 11], [-11, 5], [-11, -5]] },
  meeting: { letter: 'M', colour: 'here', words: 'meeting point', shape: null },
};

export function paintMarks(painter, view, marks, level) {
  const { pen, colour } = painter;
  for (const { mark, x_m, y_m, level: on } of marks) {
    const look = LOOKS[mark];
    if (on !== level || !look) continue;
    const [sx, sy] = view.toScreen(x_m, y_m);
    if (look.shape) painter.path(look.shape.map(([x, y]) => [sx + x, sy + y]));
    else painter.ring([sx, sy], 11);
    pen.closePath();
    pen.fillStyle = colour.halo;
    pen.fill();
    painter.stroke(colour[look.colour], 2.5);
    painter.text(look.letter, sx, sy + 1, colour[look.colour], { size: 14, align: 'center', base: 'middle', weight: 700, halo: 0 });
  }
}

export const markWords = (mark) => LOOKS[mark]?.words ?? mark;

// How many marks of each kind there are, and on which floors the hazards are.
export function marksText(marks, levels) {
  const counts = Object.keys(LOOKS).map((kind) => [kind, marks.filter(({ mark }) => mark === kind)]).filter(([, of]) => of.length);
  const floors = [...new Set(marks.filter(({ mark }) => mark === 'hazard').map(({ level }) => levels[level]?.name))].filter(Boolean).join(', ');
  return counts.length ? `marks: ${counts.map(([kind, of]) => `${of.length} ${LOOKS[kind].words}`).join(', ')}${floors && levels.length > 1 ? `, hazards on ${floors}` : ''}` : '';
}
