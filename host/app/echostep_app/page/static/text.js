// SPDX-License-Identifier: MIT
// Texts of elements, and the time of day.

import { tr } from './language.js';
import { inUnits } from './tools/units.js';

// Unchanged text causes no new layout.
export const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

// In the reader's language and units.
export const said = (text) => tr(inUnits(text));
export const say = (element, text) => put(element, said(text));

// The same, and the element is shown while there is a text.
export function tell(element, text) {
  say(element, text);
  if (element.hidden !== !text) element.hidden = !text;
}

export const clock = (unix_s) => new Date(1000 * unix_s).toLocaleTimeString('en-GB');
