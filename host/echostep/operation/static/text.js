// SPDX-License-Identifier: MIT
// Texts of elements.

// Unchanged text causes no new layout.
export const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };
