// SPDX-License-Identifier: MIT
// Latitude and longitude as people type or paste them: "48.13715, 11.57612", "48,13715 11,57612", 48°08'13.7"N 11°34'34.0"E, geo:48.1,11.5, or the link of a map.

const NUMBER = String.raw`([+−-]?\d+(?:[.,]\d+)?)\s*(?:[°º]\s*(?:(\d+(?:[.,]\d+)?)\s*['′’]\s*)?(?:(\d+(?:[.,]\d+)?)\s*["″”]\s*)?)?`;
const LEADING = String.raw`([NSEW])\s*${NUMBER}`, TRAILING = String.raw`${NUMBER}\s*([NSEW])`; // not O: east in German, west in French
const BETWEEN = String.raw`\s*[,;/\s]\s*`;
const LINKS = [/mlat=(-?\d+\.\d+)&mlon=(-?\d+\.\d+)/, /[@=:](-?\d+\.\d+),\s*(-?\d+\.\d+)/, /#map=[\d.]+\/(-?\d+\.\d+)\/(-?\d+\.\d+)/];

const value = (text) => Number(text.replace('−', '-').replace(',', '.'));

// Degrees of one coordinate, and whether its letter is one of longitude (undefined without a letter); null where minutes or seconds are 60 or more.
function coordinate(letter, whole, minutes = '0', seconds = '0') {
  if (value(minutes) >= 60 || value(seconds) >= 60) return null;
  const size = Math.abs(value(whole)) + value(minutes) / 60 + value(seconds) / 3600, isNegative = /^[-−]/.test(whole) !== /[SW]/i.test(letter ?? '');
  return { degrees: isNegative ? -size : size, isLongitude: letter && /[EW]/i.test(letter) };
}

function pair(text) {
  const match = (one) => new RegExp(`^${one}${BETWEEN}${one}$`, 'i').exec(text)?.slice(1);
  const lead = match(LEADING), trail = !lead && match(TRAILING), bare = !lead && !trail && match(NUMBER);
  if (lead) return [coordinate(...lead.slice(0, 4)), coordinate(...lead.slice(4))];
  if (trail) return [coordinate(trail[3], ...trail.slice(0, 3)), coordinate(trail[7], ...trail.slice(4, 7))];
  return bare ? [coordinate(undefined, ...bare.slice(0, 3)), coordinate(undefined, ...bare.slice(3))] : null;
}

// [latitude, longitude] in degrees, or null.
export function readDegrees(text) {
  let plain = text.trim().replace(/\s+/g, ' ');
  try { plain = decodeURIComponent(plain); } catch { /* a percent sign of its own */ }
  const link = /^\w+:/.test(plain) && LINKS.map((form) => form.exec(plain)).find(Boolean);
  const [a, b] = (link ? link.slice(1).map((one) => coordinate(undefined, one)) : pair(plain)) ?? [];
  if (!a || !b || Boolean(a.isLongitude) === Boolean(b.isLongitude) && a.isLongitude !== undefined) return null;
  const [latitude, longitude] = a.isLongitude ? [b.degrees, a.degrees] : [a.degrees, b.degrees];
  return Math.abs(latitude) <= 90 && Math.abs(longitude) <= 180 ? [latitude, longitude] : null;
}
