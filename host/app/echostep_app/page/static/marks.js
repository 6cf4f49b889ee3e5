// SPDX-License-Identifier: MIT
// Marks that commanders set: a cleared room (square, tick), a hazard (diamond, exclamation mark), a meeting point (circle, M); on the wearer's and the commander's page.

const LOOKS = {
  cleared: { letter: '✓', colour: 'good', words: 'cleared', shape: [[-9, -9], [9, -9], [9, 9], [-9, 9]] },
  hazard: { letter: '!', colour: 'bad', words: 'hazard', shape: [[0, -13], [13, 0], [0, 13], [-13, 0]] },
  meeting: { letter: 'M', colour: 'here', words: 'meeting point', shape: null },
};

export function paintMarks(pen, view, marks, level, colour) {
  for (const { mark, x_m, y_m, level: on } of marks) {
    const look = LOOKS[mark];
    if (on !== level || !look) continue;
    const [sx, sy] = view.toScreen(x_m, y_m);
    pen.beginPath();
    if (look.shape) for (const [x, y] of look.shape) pen.lineTo(sx + x, sy + y);
    else pen.arc(sx, sy, 11, 0, 2 * Math.PI);
    pen.closePath();
    [pen.fillStyle, pen.strokeStyle, pen.lineWidth] = [colour.halo, colour[look.colour], 2.5];
    pen.fill();
    pen.stroke();
    [pen.font, pen.textAlign, pen.textBaseline, pen.fillStyle] = ['700 14px system-ui, sans-serif', 'center', 'middle', colour[look.colour]];
    pen.fillText(look.letter, sx, sy + 1);
    [pen.textAlign, pen.textBaseline] = ['left', 'alphabetic'];
  }
}

export const markWords = (mark) => LOOKS[mark]?.words ?? mark;

// How many marks of each kind there are, and on which floors the hazards are.
export function marksText(marks, levels) {
  const counts = Object.keys(LOOKS).map((kind) => [kind, marks.filter(({ mark }) => mark === kind)]).filter(([, of]) => of.length);
  const floors = [...new Set(marks.filter(({ mark }) => mark === 'hazard').map(({ level }) => levels[level]?.name))].filter(Boolean).join(', ');
  return counts.length ? `marks: ${counts.map(([kind, of]) => `${of.length} ${LOOKS[kind].words}`).join(', ')}${floors && levels.length > 1 ? `, hazards on ${floors}` : ''}` : '';
}
