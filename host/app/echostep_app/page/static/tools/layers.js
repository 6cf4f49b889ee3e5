// SPDX-License-Identifier: MIT
// Layers of the map that can be left out; remembered. `shows(name)`: whether one is drawn.

import { recall, remember } from '../storage.js';

export const LAYERS = { cloud: 'Where you may be (cloud)', trail: 'Track', echoes: 'Echoes', beacons: 'Beacons', marks: 'Marks', names: 'Names of rooms' };

export class Layers {
  constructor() { this.hidden = new Set((recall('hidden') ?? '').split(',').filter((name) => name in LAYERS)); }

  shows(name) { return !this.hidden.has(name); }

  set(name, on) {
    this.hidden[on ? 'delete' : 'add'](name);
    remember('hidden', [...this.hidden].join());
  }
}
