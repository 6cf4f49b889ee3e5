// SPDX-License-Identifier: MIT
// The georeference by two clicks: two places of the plan whose latitude and longitude are known. The server computes it (plan/two_points.py). Owns the arrow to north.

import { readDegrees } from './degrees.js';
import { tr } from './language.js';
import { WORDS } from './words.js';

const byId = (id) => document.getElementById(id);

export async function earthClick(tools, p) {
  const { desk, sheet } = tools, { at } = tools.snapped(p), before = tools.known;
  tools.points = [...before.map(({ x_m, y_m }) => [x_m, y_m]), at];
  desk.changed();
  const text = await desk.ask(WORDS.degrees(tools.points.length), '', (typed) => (readDegrees(typed) ? '' : WORDS.noDegrees));
  if (text === null) { tools.points.pop(); desk.changed(); return; }
  const [latitude_deg, longitude_deg] = readDegrees(text);
  tools.known = [...before, { x_m: at[0], y_m: at[1], longitude_deg, latitude_deg }];
  if (tools.known.length < 2) desk.say(WORDS.firstPoint(latitude_deg, longitude_deg));
  else {
    const { known } = tools, { tree } = sheet;
    tools.stop();
    const reply = await fitted(known);
    if (reply.error) desk.say(WORDS.noGeoreference(reply.error));
    else if (sheet.tree === tree) sheet.change({ ...tree, georeference: reply.georeference }, WORDS.georeference(bearing(reply.georeference), reply.plan_m, reply.earth_m));
  }
  desk.changed();
}

async function fitted(points) {
  try {
    const answer = await fetch('georeference', { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify({ points }), signal: AbortSignal.timeout(30000) });
    return await answer.json();
  } catch { return { error: WORDS.silent }; }
}

// Where the plan's y axis points: degrees clockwise from north.
const bearing = ({ rotation_deg }) => -(rotation_deg ?? 0);

// An arrow to north, and the bearing of y, for a plan with a georeference.
export function paintNorth({ georeference }) {
  byId('north').hidden = !georeference;
  if (!georeference) return;
  byId('north-arrow').setAttribute('transform', `rotate(${-bearing(georeference)})`);
  byId('north-text').textContent = tr(WORDS.north(bearing(georeference)));
}
