// SPDX-License-Identifier: MIT
// The legend: what each sign on the map means, the keys, the choice of language and unit; a dialog that a button or the keys L and ? open, on the wearer's and the commander's page.

import { dialogOf } from './dialog.js';
import { startLanguage } from './language.js';
import { chooseUnit, chosenUnit } from './tools/units.js';

const line = (d, colour = 'wall', width = 1.5, more = '') => `<path d="${d}" fill="none" stroke="var(--${colour})" stroke-width="${width}" ${more}/>`;
const shape = (d, colour, fill = colour) => `<path d="${d}" fill="${fill === 'none' ? 'none' : `var(--${fill})`}" stroke="var(--${colour})" stroke-width="2"/>`;
const disc = (r, colour, fill = 'none', more = '') => `<circle r="${r}" fill="${fill === 'none' ? 'none' : `var(--${fill})`}" stroke="var(--${colour})" stroke-width="2" ${more}/>`;
const letter = (text, colour) => `<text y="4.5" text-anchor="middle" font-size="12" font-weight="700" fill="var(--${colour})">${text}</text>`;
const JAMBS = 'M-9-5V5M9-5V5';
const JOINED = line('M-16 0H-9M9 0H16', 'wall', 2.5);  // the wall on both sides of a door or a window
const STEPS = [-8, -4, 0, 4, 8].map((x) => `M${x}-7V7`).join(''), BOX = 'M-12-7H12V7H-12Z';

const BUILDING = [
  [line('M-16 0H16', 'wall', 2.5), 'wall, side of an obstacle'],
  [JOINED + line('M-9-3H9V3H-9ZM-9 0H9'), 'window'],
  [JOINED + line(JAMBS), 'door that is open'],
  [JOINED + line(`${JAMBS}M-9 0H9`), 'door that is shut'],
  [JOINED + line(JAMBS) + line('M-9 0H9', 'wall', 1.5, 'stroke-dasharray="3 3"'), 'door, open or shut; to which side it opens is in no plan'],
  [JOINED + line(JAMBS) + line('M0-11V11', 'good', 3), 'way out of the building, with the word EXIT'],
  [line(BOX + STEPS), 'stairs; ↑ ↓ beside the name: they lead up, down'],
  [line(`${BOX}M-12-7 12 7M-12 7 12-7`), 'lift'],
  [line(`${BOX}M-12 0H12M-12 0-8-3M-12 0-8 3M12 0 8-3M12 0 8 3`), 'ramp'],
];
const MARKS = [
  [shape('M-8-8H8V8H-8Z', 'good', 'halo') + letter('✓', 'good'), 'cleared, marked by a commander'],
  [shape('M0-10 10 0 0 10-10 0Z', 'bad', 'halo') + letter('!', 'bad'), 'hazard'],
  [shape('M-4-9H4L9-4V4L4 9H-4L-9 4V-4Z', 'bad', 'halo') + letter('✕', 'bad'), 'no way'],
  [disc(9, 'here', 'halo') + letter('M', 'here'), 'meeting point'],
];
const ARROW = 'M12 0-8 7-4 0-8-7Z';

export const LIVE = [
  ['The building', BUILDING],
  ['The wearer', [
    [shape(ARROW, 'here'), 'you, and where your feet point'], [disc(7, 'here', 'here'), 'you; heading not known'],
    [disc(9, 'here', 'none'), 'you are in it, with 95 %'], [disc(9, 'here', 'none', 'stroke-dasharray="4 4"'), 'you are in it, but for 1 in 1,000'],
    [disc(9, 'here') + letter('1', 'ink'), 'a place that fits, with its probability'],
    [[[-6, -3], [0, 4], [5, -5], [-2, 0], [7, 3]].map(([x, y]) => `<rect x="${x}" y="${y}" width="3" height="3" fill="var(--cloud)"/>`).join(''), 'where you may be'],
    [line('M-16 4-4-3 16 2', 'trail', 2), 'track'],
  ]],
  ['Echoes, beacons and ways', [
    [line('M-16 0H8', 'left', 2.5) + line('M8-6V6', 'left', 3.5), 'range measured to the left'], [line('M-16 0H8', 'right', 2.5) + line('M8-6V6', 'right', 3.5), 'to the right'],
    [line('M-16 0H4', 'expected', 1.5, 'stroke-dasharray="2 4"') + '<circle cx="9" r="5" fill="none" stroke="var(--expected)" stroke-width="1.5"/>', 'range that the plan predicts'],
    [shape('M0-8 7 5H-7Z', 'beacon'), 'beacon; hollow: silent or moved'], [line('M-16 0H16', 'goal', 3, 'stroke-dasharray="7 6"'), 'way to the flag'],
    [shape('M0-8 8 0 0 8-8 0Z', 'good', 'none'), 'true position, of a simulation'],
  ]],
  ['Marks', MARKS],
];
const MOVES = { 'arrow keys': 'move the map', '+ −': 'zoom', '[ ]': 'rotate', N: 'north up', W: 'the whole floor', Space: 'play or pause a recording', 'L ?': 'this', Escape: 'cancel, close' };
export const LIVE_KEYS = { ...MOVES, F: 'follow', H: 'I am here: a cross', G: 'go to: a cross', D: 'measure a distance', Enter: 'take the cross', ', .': 'turn the heading', C: 'charts', T: 'more' };
export const COMMAND_KEYS = { ...MOVES, M: 'mark the middle', P: 'crews', V: 'all storeys' };
export const COMMAND = [
  ['The building', BUILDING],
  ['Wearers', [
    [shape('M0-10 9 6H-9Z', 'bad'), 'mayday'], [disc(7, 'bad', 'halo') + line('M-3-3 3 3M-3 3 3-3', 'bad', 2.5), 'lost'], [disc(7, 'bad', 'halo'), 'silent'],
    [disc(7, 'fair', 'halo') + shape('M0-6A6 6 0 0 1 0 6Z', 'fair'), 'uncertain'], [disc(7, 'good', 'good'), 'tracked; a tip points along the heading'], [shape('M-6-6H6V6H-6Z', 'faint', 'halo'), 'run ended'],
    [disc(9, 'good', 'none', 'stroke-dasharray="4 4"'), 'in it, but for 1 in 1,000'], [disc(9, 'good', 'none', 'stroke-dasharray="2 4"'), 'in it, with 95 %'],
    [line('M-16 4-4-3 16 2', 'trail', 2), 'trail of the last 3 minutes'],
  ]],
  ['Marks', MARKS],
];

// A dialog with these groups of [picture, words] and the keys; `onUnit()`: another one is chosen. Returns what opens it, at the keys or at its beginning.
export function startLegend(button, groups, keys, onUnit) {
  const rows = (entries) => entries.map(([picture, words]) => `<li><svg viewBox="-16 -12 32 24" aria-hidden="true">${picture}</svg><span>${words}</span></li>`).join('');
  const names = Object.entries(keys).map(([key, words]) => `<li><kbd>${key}</kbd><span>${words}</span></li>`).join('');
  const signs = groups.map(([title, entries]) => `<h3>${title}</h3><ul>${rows(entries)}</ul>`).join('');
  const choices = '<label for="language" class="unseen">Language</label><select id="language"></select><label for="unit" class="unseen">Lengths in</label><select id="unit"><option>m</option><option>ft</option></select>';
  const dialog = dialogOf('legend', 'Legend', `<div tabindex="0" role="group" aria-label="Signs">${signs}<h3 id="keys-title">Keys on the map</h3><ul>${names}</ul></div>`, choices);
  startLanguage(document.getElementById('language'));
  const unit = document.getElementById('unit');
  unit.value = chosenUnit();
  unit.onchange = () => { chooseUnit(unit.value); onUnit(); };
  const open = (atKeys) => {
    dialog.showModal();
    document.getElementById(atKeys ? 'keys-title' : 'legend').scrollIntoView();
  };
  button.onclick = () => open(false);
  return open;
}
