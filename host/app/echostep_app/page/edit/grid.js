// SPDX-License-Identifier: MIT
// The grid under the sheet and the scale bar. In: the view. Owns their elements. An arrow key moves the cross by a square of the grid.

import { tr } from './language.js';

const STEPS_M = [0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 25, 50, 100, 250, 500, 1000, 2500];
const SQUARE_PX = 14, BAR_PX = 60; // sides of a square and length of the bar at least
const byId = (id) => document.getElementById(id);
const atLeast = (px, view) => STEPS_M.find((m) => m * view.scale >= px) ?? STEPS_M.at(-1);

export const squareOf = (view) => atLeast(SQUARE_PX, view);

// The multiples of a step from one value to another one.
function multiples(step, from, to) {
  const first = Math.ceil(from / step);
  return Array.from({ length: Math.max(Math.floor(to / step) - first + 1, 0) }, (_, k) => (first + k) * step);
}

export function paintGrid(view) {
  const square = squareOf(view), { width, height } = view, [x0, y1] = view.toMap(0, 0), [x1, y0] = view.toMap(width, height);
  const down = multiples(square, x0, x1).map((x) => `M${view.toScreen(x, 0)[0].toFixed(1)} 0V${height}`);
  const across = multiples(square, y0, y1).map((y) => `M0 ${view.toScreen(0, y)[1].toFixed(1)}H${width}`);
  byId('grid').setAttribute('d', [...down, ...across].join(''));
  const metres = atLeast(BAR_PX, view);
  byId('bar').style.width = `${metres * view.scale}px`;
  byId('bar-text').textContent = tr(`${metres} m`);
  byId('square').textContent = `▦ ${tr(`${square} m`)}`;
}
