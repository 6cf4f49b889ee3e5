// SPDX-License-Identifier: MIT
// Texts of elements, and the time of day.

import { inUnits } from '../static/tools/units.js';
import { tr } from '../static/language.js';

// Unchanged text causes no new layout.
export const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

// In the reader's language and units.
export const said = (text) => tr(inUnits(text));
export const say = (element, text) => put(element, said(text));

export const clock = (unix_s) => new Date(1000 * unix_s).toLocaleTimeString('en-GB');
