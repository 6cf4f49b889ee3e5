// SPDX-License-Identifier: MIT
// What a walk without a plan has drawn so far: the floor that was walked, walls in a band of twice their standard deviation to either side.

const TRUNK_M = 0.5;  // width of the floor that a person walks on
const WALL_PX = 2.2;

export function paintDrawing(pen, view, { walls, path }, colour) {
  const [a, b, c, d, e, f] = view.matrix(), at = (x, y) => [a * x + c * y + e, b * x + d * y + f];
  pen.beginPath();
  let drawing = false;  // NaN: the path is on another storey
  for (let k = 0; k < path.length; k += 2) {
    const there = !Number.isNaN(path[k]);
    if (there) pen[drawing ? 'lineTo' : 'moveTo'](...at(path[k], path[k + 1]));
    drawing = there;
  }
  stroke(pen, colour.trail, TRUNK_M * view.scale, 0.16);
  stroke(pen, colour.trail, 1.5, 1);
  for (let k = 0; k < walls.length; k += 5) {
    pen.beginPath();
    pen.moveTo(...at(walls[k], walls[k + 1]));
    pen.lineTo(...at(walls[k + 2], walls[k + 3]));
    stroke(pen, colour.wall, 4 * walls[k + 4] * view.scale, 0.22);
    stroke(pen, colour.wall, WALL_PX, 1);
  }
}

function stroke(pen, colour, width, alpha) {
  [pen.strokeStyle, pen.lineWidth, pen.globalAlpha] = [colour, width, alpha];
  pen.stroke();
  pen.globalAlpha = 1;
}

// How much wall is drawn, and how well on the average; empty without a drawing.
export function drawnText(drawing) {
  if (!drawing) return '';
  let length = 0, square = 0;
  const { walls } = drawing;
  for (let k = 0; k < walls.length; k += 5) {
    const piece = Math.hypot(walls[k + 2] - walls[k], walls[k + 3] - walls[k + 1]);
    length += piece;
    square += piece * walls[k + 4] ** 2;
  }
  return `drawn: ${length.toFixed(0)} m of wall${length ? `, to ${(100 * Math.sqrt(square / length)).toFixed(0)} cm` : ''}`;
}
