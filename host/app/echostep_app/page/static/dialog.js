// SPDX-License-Identifier: MIT
// A dialog of the page: it opens over everything, and a tap beside it closes it.

import { localise, tr } from './language.js';

// `content`, and `choices` beside the title: HTML in English.
export function dialogOf(id, title, content, choices = '') {
  const dialog = document.createElement('dialog');
  dialog.id = id;
  dialog.setAttribute('aria-label', tr(title));
  dialog.innerHTML = `<form method="dialog"><h2>${title}</h2>${choices}<button aria-label="Close">✕</button></form>${content}`;
  dialog.onclick = ({ target }) => { if (target === dialog) dialog.close(); };
  localise(dialog);
  document.body.append(dialog);
  return dialog;
}
