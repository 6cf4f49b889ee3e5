// SPDX-License-Identifier: MIT
// All sentences of the editor's scripts, in one place. One that states values is a function of them: metres, names.

const m = (metres) => `${metres.toFixed(2)} m`;
const at = ([x, y]) => `x ${x.toFixed(2)}, y ${y.toFixed(2)} m`;

export const KINDS = { stairs: 'stairs', lift: 'lift', ramp: 'ramp' };
const SNAPPED = { end: 'to a corner', wall: 'to a wall', 'right angle': 'at a right angle', grid: 'to the 5 cm grid' };

export const HINTS = {
  select: 'Tap one or drag about many, then Delete. Two fingers or the right button move the sheet',
  wall: 'Drag, or tap from corner to corner; tap the last one again to end',
  door: 'Drag along a wall or over a gap, from jamb to jamb',
  room: 'Tap into a room', scale: 'Drag along a distance that you know',
};

export const WORDS = {
  // what an edit did
  wall: (length, kind) => `Wall ${m(length)}, ${SNAPPED[kind]}`,
  door: (width) => `Door ${m(width)}`,
  room: (name) => `Room ${name}`,
  selected: (count) => `Selected: ${count}`, deleted: (count) => `Deleted: ${count}`,
  scaled: (perPx) => `Scale: ${perPx} m a pixel`,
  answered: { kept: 'Kept', added: 'Added', dropped: 'Dropped', deleted: 'Deleted', moved: 'Moved' },
  lastAnswer: (words) => `${words}. No question is left: Save`,
  undone: (words) => `Undone: ${words}`,
  redone: (words) => `Again: ${words}`,
  saved: (name) => `Saved ${name}`,
  finding: (k, count, text) => `${k} of ${count} findings: ${text}`, nothingWrong: 'Nothing wrong',
  // what is under way
  wallFrom: (place, kind) => `Wall from ${at(place)}, ${SNAPPED[kind]}`,
  wallEnded: 'Wall ended', ended: 'Ended',
  second: 'Now the second point',
  cross: at,
  level: (name, height) => `Level ${name}, ${height} m`,
  doorHere: 'Tap the wall where the door belongs', roomHere: 'Tap where the room is',
  question: (k, count, text) => `${k} of ${count}: ${text}`,
  questions: (count) => `Questions of the import: ${count}, marked on the plan. Answer them one by one, or draw and delete as you like`,
  scaleFirst: 'Set the scale first: Scale, then drag along a distance that you know',
  unsaved: '(not saved)',
  length: m,
  // why nothing changed
  nothing: 'Nothing here', noneSelected: 'Nothing is selected',
  noWall: 'No wall here that is long enough, and no gap from wall to wall', narrow: (least) => `A door is ${m(least)} wide or more: drag from jamb to jamb`,
  noRoomForDoor: 'No wall here that is long enough: tap a wall',
  noPicture: 'There is no picture to scale: start with --picture IMAGE',
  silent: 'echostep does not answer, is it still running?',
  noScale: 'Scale unchanged: the distance is a number of metres',
  // questions of dialogs, and labels
  roomName: 'Name of the room', distance: 'Distance of the two points in metres',
  add: 'Add', keep: 'Keep', drop: 'Drop', remove: 'Delete',
  writeOver: (reason) => `${reason}. Write over it? It stays as .bak.`,
  // faults
  notSaved: (reason) => `Not saved: ${reason}`, noAnswer: 'Not saved: echostep does not answer. Is it still running?', noShow: 'The browser cannot show this picture', noStart: (reason) => `Cannot start: ${reason}`,
};
