// SPDX-License-Identifier: MIT
// One level of the plan in SVG: lines as paths by tiles, of which only those on the screen are in the document; names of rooms, stairs and lifts and signs
// of exits, always upright.

import { tr } from './language.js';

const SVG = 'http://www.w3.org/2000/svg';
const TILE_M = 30;  // side of a tile
const LEAST_PX = { wall: 1, window: 4, door: 2, unknown: 2, exit: 0, stairs: 6, lift: 6, ramp: 6 };  // length of the shortest lines drawn, by kind
const NOTHING_DRAWN = [-10, -10, 10, 10];  // m about the origin, shown where there is no plan
const KEPT_PX = 22;  // distance of names from signs

export class PlanView {
  constructor(wallsGroup, roomsGroup) {
    Object.assign(this, { wallsGroup, roomsGroup, tiles: [], rooms: [], lines: {}, signs: [], box: [0, 0, 10, 10], isEmpty: true });
  }

  // `bytes`: of the server's lines/N; exits, then stairs and lifts keep their names where another would cover one.
  show(bytes, { rooms, ways }) {
    const lines = this.lines = linesOf(bytes);
    this.tiles = Object.entries(lines).flatMap(([kind, rows]) => tilesOf(rows, kind));
    this.box = boxOf(lines, [...rooms, ...ways]);
    this.isEmpty = this.box === NOTHING_DRAWN;
    this.wallsGroup.replaceChildren();
    const exits = Array.from({ length: lines.exit.length / 4 }, (_, k) => ({ name: tr('EXIT'), at_m: lines.exit.subarray(4 * k + 2, 4 * k + 4), kind: 'exit' }));
    this.rooms = [...exits, ...ways.map((way) => ({ ...way, kind: 'way' })), ...rooms].map(({ name, at_m: [x, y], kind = 'room' }) => {
      const text = document.createElementNS(SVG, 'text');
      text.textContent = name;
      text.classList.add(kind);
      return { x, y, text, half: halfOf(name) };
    });
    this.roomsGroup.replaceChildren(...this.rooms.map((room) => room.text));
  }

  draw(view) {
    this.wallsGroup.setAttribute('transform', `matrix(${view.matrix().join(' ')})`);
    const [x, y] = [view.x, view.y], reach = Math.hypot(view.width, view.height) / 2 / view.scale;
    for (const tile of this.tiles) {
      const seen = tile.box[0] < x + reach && tile.box[2] > x - reach && tile.box[1] < y + reach && tile.box[3] > y - reach;
      for (const part of tile.parts) setShown(part, seen && part.longest * view.scale > LEAST_PX[tile.kind], this.wallsGroup);
    }
    this.names(view);
  }

  // Names of rooms that do not cover each other; one that would cover a sign, whose pixels are `signs`, is moved aside, or left out.
  names(view, signs = this.signs) {
    this.signs = signs;
    const taken = [];
    for (const room of this.rooms) {
      const [sx, at] = view.toScreen(room.x, room.y), beside = signs.filter(([x]) => Math.abs(x - sx) < room.half + KEPT_PX);
      const covered = (y) => beside.find(([, sign]) => Math.abs(sign - y) < KEPT_PX), sign = covered(at);
      const places = sign ? [-KEPT_PX, KEPT_PX].map((by) => sign[1] + by).sort((a, b) => Math.abs(a - at) - Math.abs(b - at)) : [at];
      const sy = places.find((place) => isFree(taken, [sx, place, room.half]) && !covered(place));
      const shown = sy !== undefined && sx > -room.half && sx < view.width + room.half && sy > -10 && sy < view.height + 10;
      if (shown) taken.push([sx, sy, room.half]);
      setNew(room.text, 'visibility', shown ? 'visible' : 'hidden');
      if (shown) { setNew(room.text, 'x', sx.toFixed(1)); setNew(room.text, 'y', sy.toFixed(1)); }
    }
  }
}

// Half of a name's width in pixels; whether a name [x, y, half] covers none of those that are taken.
export const halfOf = (name) => 4 * name.length + 4;
export const isFree = (taken, [x, y, half]) => taken.every(([tx, ty, other]) => Math.abs(tx - x) > other + half || Math.abs(ty - y) > 18);

function setNew(element, name, value) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

// Put a part's path into the document, or remove it.
function setShown(part, shown, group) {
  if (shown === part.shown) return;
  part.shown = shown;
  if (!part.path) {
    part.path = document.createElementNS(SVG, 'path');
    part.path.classList.add(part.kind);
    part.path.setAttribute('d', part.d.join(''));
    part.d = null;
  }
  if (shown) group.append(part.path);
  else part.path.remove();
}

// Rows x0, y0, x1, y1 by kind; the layout is in page/protocol.py.
export function linesOf(bytes) {
  const length = new DataView(bytes).getUint32(0, true), counts = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  let offset = 4 + length;
  return Object.fromEntries(Object.entries(counts).map(([kind, count]) => {
    const rows = new Float32Array(bytes, offset, 4 * count);
    offset += 16 * count;
    return [kind, rows];
  }));
}

// Lines of a kind by tile and by length, so that lines too short to be seen can be left out.
function tilesOf(lines, kind) {
  const tiles = new Map();
  for (let k = 0; k < lines.length; k += 4) {
    const [x0, y0, x1, y1] = lines.subarray(k, k + 4);
    const key = `${Math.floor((x0 + x1) / 2 / TILE_M)} ${Math.floor((y0 + y1) / 2 / TILE_M)}`;
    if (!tiles.has(key)) tiles.set(key, { box: [Infinity, Infinity, -Infinity, -Infinity], parts: new Map() });
    const tile = tiles.get(key), length = Math.hypot(x1 - x0, y1 - y0), size = Math.ceil(Math.log2(Math.max(length, 0.01)));
    tile.box = [Math.min(tile.box[0], x0, x1), Math.min(tile.box[1], y0, y1), Math.max(tile.box[2], x0, x1), Math.max(tile.box[3], y0, y1)];
    if (!tile.parts.has(size)) tile.parts.set(size, { kind, longest: 2 ** size, d: [], path: null, shown: false });
    tile.parts.get(size).d.push(`M${x0} ${y0}L${x1} ${y1}`);
  }
  return [...tiles.values()].map(({ box, parts }) => ({ kind, box, parts: [...parts.values()] }));
}

export function boxOf(lines, names) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (x, y) => { box[0] = Math.min(box[0], x); box[1] = Math.min(box[1], y); box[2] = Math.max(box[2], x); box[3] = Math.max(box[3], y); };
  for (const rows of Object.values(lines)) for (let k = 0; k < rows.length; k += 2) add(rows[k], rows[k + 1]);
  for (const name of names) add(...name.at_m);
  return box[0] > box[2] ? NOTHING_DRAWN : box;
}
