// SPDX-License-Identifier: MIT
// Layers of the map that can be left out; remembered. `shows(name)`: whether one is drawn.

export const LAYERS = { cloud: 'Where you may be (cloud)', trail: 'Track', echoes: 'Echoes', beacons: 'Beacons', marks: 'Marks', names: 'Names of rooms' };

export class Layers {
  constructor() { this.hidden = new Set(stored().filter((name) => name in LAYERS)); }

  shows(name) { return !this.hidden.has(name); }

  set(name, on) {
    this.hidden[on ? 'delete' : 'add'](name);
    try { localStorage.setItem('hidden', JSON.stringify([...this.hidden])); } catch { /* private browsing */ }
  }
}

function stored() {
  try {
    const names = JSON.parse(localStorage.getItem('hidden') ?? '[]');
    return Array.isArray(names) ? names : [];
  } catch { return []; }
}
