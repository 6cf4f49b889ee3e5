// SPDX-License-Identifier: MIT
// Colours: bright, dark or high contrast; by default those of the system.

import { recall, remember } from './storage.js';

const SYSTEM_QUERIES = { contrast: '(prefers-contrast: more)', dark: '(prefers-color-scheme: dark)' };

export function startTheme(select, onChange) {
  const apply = () => {
    const liked = Object.keys(SYSTEM_QUERIES).find((look) => matchMedia(SYSTEM_QUERIES[look]).matches) ?? 'bright';
    document.documentElement.dataset.look = select.value === 'auto' ? liked : select.value;
    onChange();
  };
  select.value = recall('look') ?? 'auto';
  if (!select.value) select.value = 'auto';
  select.onchange = () => {
    remember('look', select.value);
    apply();
  };
  for (const query of Object.values(SYSTEM_QUERIES)) matchMedia(query).addEventListener('change', apply);
  apply();
}
