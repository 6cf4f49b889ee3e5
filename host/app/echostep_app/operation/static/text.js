// SPDX-License-Identifier: MIT
// Texts of elements.

import { tr } from '../static/language.js';

// Unchanged text causes no new layout.
export const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

// In the reader's language.
export const say = (element, text) => put(element, tr(text));
