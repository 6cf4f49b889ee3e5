// SPDX-License-Identifier: MIT
// All sentences of the editor's scripts, in one place. One that states values is a function of them: metres, degrees, names.

const m = (metres) => `${metres.toFixed(2)} m`;
const deg = (degrees) => `${(((degrees % 360) + 360) % 360).toFixed(1).replace('360.0', '0.0')}°`;
const at = ([x, y]) => `x ${x.toFixed(2)}, y ${y.toFixed(2)} m`;
const along = ([dx, dy]) => `${m(Math.hypot(dx, dy))}, ${deg(Math.atan2(dy, dx) * 180 / Math.PI)}`;

const percent = (share) => (Math.abs(share) < 5e-4 ? 'the same' : `${Math.abs(100 * share).toFixed(1)} % ${share > 0 ? 'longer' : 'shorter'}`);

export const KINDS = { wall: 'wall', end: 'corner', door: 'door', window: 'window', room: 'name', corner: 'corner', start: 'start', obstacle: 'obstacle', stairs: 'stairs', lift: 'lift', ramp: 'ramp' };
const SNAPPED = { end: 'to a corner', wall: 'to a wall', 'right angle': 'at a right angle', grid: 'to the 5 cm grid', typed: 'as typed' };
const capital = (text) => text[0].toUpperCase() + text.slice(1);

const corners = (kind) => `Click the corners of the ${kind}, the first one last, or drag a rectangle`;

export const HINTS = {
  select: 'Drag walls, corners, doors, windows, names, outlines and the start', wall: 'Click from corner to corner, or drag; End ends a wall. Two fingers or the right button move the sheet', door: 'Click on a wall', window: 'Click on a wall: glass is no way',
  erase: 'Click on an element to delete it', room: 'Click into a room', obstacle: corners('obstacle'), stairs: corners('stairs'), lift: corners('lift'), ramp: corners('ramp'),
  start: 'Click where walks begin, then where the wearer looks; or drag', scale: 'Click two points whose distance you know', origin: 'Drag the picture',
  earth: 'Click a point that you find on a map too, such as a corner of the building; then a second one far from it',
};

export const WORDS = {
  // what an edit did
  wall: (from, to, kind) => `Wall ${along([to[0] - from[0], to[1] - from[1]])}, ${SNAPPED[kind]}`,
  door: (width) => `Door ${m(width)}`, window: (width) => `Window ${m(width)}`,
  room: (name) => `Room ${name}`,
  outline: (kind, [width, height]) => `${capital(KINDS[kind])} ${m(width)} by ${m(height)}`,
  connector: (kind, levels) => `${capital(KINDS[kind])}: ${levels.join(', ')}`,
  start: (place, heading) => `Start at ${at(place)}, looking ${deg(heading)}`,
  moved: (kind, by) => `Moved the ${KINDS[kind]} by ${along(by)}`,
  deleted: (kind) => `Deleted the ${KINDS[kind]}`,
  pictureMoved: (by) => `Moved the picture by ${along(by)}`,
  scaled: (perPx) => `Scale: ${perPx} m a pixel`,
  georeference: (bearing, plan, earth) => `Georeference: y points ${deg(bearing)} from north; ${m(plan)} here are ${m(earth)} on Earth, ${percent(earth / plan - 1)}`,
  levelAdded: (name, height) => `Level ${name} at ${m(height)}`,
  answered: { kept: 'Kept', added: 'Added', dropped: 'Dropped', deleted: 'Deleted', moved: 'Moved' },
  lastAnswer: (words) => `${words}. No question is left: Save`,
  undone: (words) => `Undone: ${words}`,
  redone: (words) => `Again: ${words}`,
  saved: (name) => `Saved ${name}`,
  finding: (k, count, text) => `${k} of ${count} findings: ${text}`, nothingWrong: 'Nothing wrong',
  // what is under way
  wallFrom: (place, kind) => `Wall from ${at(place)}, ${SNAPPED[kind]}`,
  corner: (count, place) => `Corner ${count} at ${at(place)}`,
  looks: (place) => `Start at ${at(place)}: now click where the wearer looks`,
  wallEnded: 'Wall ended', ended: 'Ended', pickedUp: 'Picked up: arrows carry it, Enter puts it down',
  firstPoint: (latitude, longitude) => `First point ${latitude.toFixed(6)}°, ${longitude.toFixed(6)}°: now click the second one, far from it`,
  north: (bearing) => `north; y points ${deg(bearing)}`,
  second: 'Now the second point',
  cross: at,
  level: (name, height) => `Level ${name}, ${height} m`,
  doorHere: 'Click on the wall where the door belongs', roomHere: 'Click where the room is',
  question: (k, count, text) => `${k} of ${count}: ${text}`,
  questions: (count) => `Questions of the import: ${count}, marked on the plan. Answer them one by one, or Move, Door and Delete as you like`,
  scaleFirst: 'Set the scale first: Scale, then two points whose distance you know',
  unsaved: '(not saved)',
  length: (from, to) => along([to[0] - from[0], to[1] - from[1]]),
  size: (width, height) => `${width.toFixed(2)} × ${m(height)}`,
  // why nothing changed
  nothing: 'Nothing here', unchanged: 'Nothing changed: click. Two fingers or the right button move the sheet',
  noWall: 'No wall here: doors and windows are cut into a wall', short: (width) => `This wall is shorter than ${m(width)}`,
  noRoomForDoor: 'No wall here that is long enough: click on a wall',
  noOutline: 'An outline has three corners or more: nothing drawn', givenUp: (kind) => `No ${KINDS[kind]} drawn`,
  oneLevel: (kind) => `No ${KINDS[kind]} drawn: there is one level. Add the other one first (+ Level)`,
  twoLevels: 'Choose two levels or more',
  noDirection: 'No direction: click farther away', noPicture: 'There is no picture to scale: start with --picture IMAGE',
  noGeoreference: (reason) => `No georeference: ${reason}. Click both points again`, silent: 'echostep does not answer, is it still running?',
  noDegrees: 'Not latitude, then longitude. Like 48.137154, 11.576124, or 48°08\'13.8"N 11°34\'34.0"E, or the link of a map',
  noScale: 'Scale unchanged: the distance is a number of metres',
  badLength: (least, most) => `The length is a number of metres from ${least} to ${most}`, badAngle: 'The angle is a number of degrees, counter-clockwise from x',
  needAngle: 'Type the angle too: degrees counter-clockwise from x', noFirst: 'First click where it begins', noChosen: 'First click on what is to be moved', noMove: 'Nothing changed: it does not fit there',
  levelExists: (name) => `There is a level ${name}`, noHeight: 'No level: its height is a number of metres',
  // questions of dialogs, and labels
  degrees: (k) => `Latitude, longitude of point ${k}, typed or pasted from a map`,
  roomName: 'Name of the room', distance: 'Distance of the two points in metres', levelName: 'Name of the new level', levelHeight: 'Its height in metres above the ground',
  connectorTitle: (kind) => capital(KINDS[kind]),
  add: 'Add', keep: 'Keep', drop: 'Drop', remove: 'Delete',
  writeOver: (reason) => `${reason}. Write over it? It stays as .bak.`,
  // faults
  notSaved: (reason) => `Not saved: ${reason}`, noAnswer: 'Not saved: echostep does not answer. Is it still running?', noShow: 'The browser cannot show this picture', noStart: (reason) => `Cannot start: ${reason}`,
};
