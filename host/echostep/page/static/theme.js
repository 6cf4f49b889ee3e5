// Colours: bright, dark or high contrast; by default as the system likes it.

const LIKES = { contrast: '(prefers-contrast: more)', dark: '(prefers-color-scheme: dark)' };

export function startTheme(select, onChange) {
  const kept = () => { try { return localStorage.getItem('look'); } catch { return null; } };
  const apply = () => {
    const liked = Object.keys(LIKES).find((look) => matchMedia(LIKES[look]).matches) ?? 'bright';
    document.documentElement.dataset.look = select.value === 'auto' ? liked : select.value;
    onChange();
  };
  select.value = kept() ?? 'auto';
  if (!select.value) select.value = 'auto';
  select.onchange = () => {
    try { localStorage.setItem('look', select.value); } catch { /* private browsing */ }
    apply();
  };
  for (const query of Object.values(LIKES)) matchMedia(query).addEventListener('change', apply);
  apply();
}
