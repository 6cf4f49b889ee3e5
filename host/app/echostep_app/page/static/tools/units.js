// SPDX-License-Identifier: MIT
// Metres or feet: all lengths are written in metres, and this turns them into what was chosen, in any sentence.

import { recall, remember } from '../storage.js';

const FOOT_M = 0.3048, INCH_CM = 2.54;  // [international yard and pound agreement, 1959]
const LENGTH = /(-?\d+(?:\.\d+)?) (m|cm|metres?)(?![\w²])/g, PLACE = /x (-?\d+\.\d), y (-?\d+\.\d) m(?!\w)/g;

const $ = (id) => document.getElementById(id);

let isFeet = recall('unit') === 'ft';
export const chosenUnit = () => (isFeet ? 'ft' : 'm');

export function chooseUnit(unit) {
  isFeet = unit === 'ft';
  remember('unit', unit);
}

export function inUnits(text) {
  if (!isFeet) return text;
  const feet = (metres) => (Number(metres) / FOOT_M).toFixed(1);
  return text.replace(PLACE, (_, x, y) => `x ${feet(x)}, y ${feet(y)} ft`).replace(LENGTH, (_, value, unit) => {
    if (unit === 'cm') return `${(Number(value) / INCH_CM).toFixed(0)} in`;
    const digits = value.includes('.') || Number(value) < 3 ? 1 : 0;
    return `${(Number(value) / FOOT_M).toFixed(digits)} ${unit.startsWith('metre') ? 'feet' : 'ft'}`;
  });
}

// A bar of the longest round length of at most 90 px.
export function showScale(view) {
  const unit_m = isFeet ? FOOT_M : 1, longest = 90 / view.scale / unit_m, ten = 10 ** Math.floor(Math.log10(longest));
  const length = [5, 2, 1].find((k) => k * ten <= longest) * ten, inches = Math.round(12 * length * 10) / 10;
  const text = isFeet ? (length < 1 ? `${inches} in` : `${length} ft`) : length < 1 ? `${Math.round(100 * length)} cm` : `${length} m`;
  $('bar').style.width = `${length * unit_m * view.scale}px`;
  $('bar-text').textContent = text;
}
