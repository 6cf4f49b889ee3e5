// SPDX-License-Identifier: MIT
// Round lengths that fit the view: the step of an arrow key, and the scale bar. In: the view. Owns the bar's elements.

import { tr } from './language.js';

const STEPS_M = [0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 25, 50, 100, 250, 500, 1000, 2500];
const STEP_PX = 14, BAR_PX = 60; // at least
const byId = (id) => document.getElementById(id);
const atLeast = (px, view) => STEPS_M.find((m) => m * view.scale >= px) ?? STEPS_M.at(-1);

export const stepOf = (view) => atLeast(STEP_PX, view);

export function paintBar(view) {
  const metres = atLeast(BAR_PX, view);
  byId('bar').style.width = `${metres * view.scale}px`;
  byId('bar-text').textContent = tr(`${metres} m`);
}
