// SPDX-License-Identifier: MIT
// A link to this view, and in a replay to this moment: `#x=…&y=…&zoom=…&turn=…&floor=…&t=…`, metres, pixels a metre, degrees, the level's index, seconds.

const LIMITS = { x: 1e6, y: 1e6, zoom: 2000, turn: 360, floor: 1000, t: 1e9 };

export function linkOf(view, level, t_s) {
  const fields = { x: view.x.toFixed(2), y: view.y.toFixed(2), zoom: view.scale.toFixed(2), turn: (view.turn * 180 / Math.PI).toFixed(1), floor: level };
  if (t_s !== null) fields.t = t_s.toFixed(2);
  const url = new URL(location.href);
  url.hash = new URLSearchParams(fields);
  return String(url);
}

// The view and the moment of a link; null when there is none. A number that cannot be is left out.
export function readLink(hash) {
  const fields = Object.fromEntries([...new URLSearchParams(hash.slice(1))].map(([name, text]) => [name, text.trim() ? Number(text) : NaN])
    .filter(([name, value]) => Math.abs(value) <= (LIMITS[name] ?? -1)));
  if (!('x' in fields && 'y' in fields && fields.zoom > 0)) return null;
  return { x: fields.x, y: fields.y, scale: fields.zoom, turn: (fields.turn ?? 0) * Math.PI / 180, level: Math.max(Math.trunc(fields.floor ?? 0), 0), t_s: fields.t ?? null };
}
