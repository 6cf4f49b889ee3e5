// SPDX-License-Identifier: MIT
// What the browser remembers for this address; nothing where it forbids that, as in private browsing.

export function recall(key) {
  try { return localStorage.getItem(key); } catch { return null; }
}

// `text` null: forget.
export function remember(key, text) {
  try { if (text === null) localStorage.removeItem(key); else localStorage.setItem(key, text); } catch { /* forbidden */ }
}
