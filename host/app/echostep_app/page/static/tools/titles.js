// SPDX-License-Identifier: MIT
// Titles: what a mouse shows over each control, from its name for screen readers, its label or its text, with its key.

export function titled(keys = {}) {
  for (const control of document.querySelectorAll('button, select, input')) {
    const name = control.getAttribute('aria-label') ?? control.labels?.[0]?.textContent.trim() ?? control.textContent.trim();
    const key = keys[control.id];
    if (!control.title) control.title = key ? `${name} (${key})` : name;
  }
}
