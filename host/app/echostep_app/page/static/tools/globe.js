// SPDX-License-Identifier: MIT
// A place of a georeferenced plan in longitude and latitude, and in the Military Grid Reference System [NGA.STND.0037, 3.3]; linear about the plan's middle.

const COLUMNS = ['STUVWXYZ', 'ABCDEFGH', 'JKLMNPQR'];  // of 100 km squares, by the zone modulo 3
const ROWS = 'ABCDEFGHJKLMNPQRSTUV';  // of odd zones; those of even ones begin with F
const SQUARE_M = 1e5;

export class Globe {
  // `fields`: of the server's hello (plan/places/globe.py)
  constructor({ x_m, y_m, degrees, utm_m, zone, band }) { Object.assign(this, { x_m, y_m, lon_lat: degrees, utm_m, zone, band }); }

  at(functions, x, y) { return functions.map(([value, byX, byY]) => value + byX * (x - this.x_m) + byY * (y - this.y_m)); }

  degrees(x, y) { return this.at(this.lon_lat, x, y).map((value) => Number(value.toFixed(7))); }

  mgrs(x, y) { return mgrs(this.zone, this.band, ...this.at(this.utm_m, x, y)); }

  words(x, y) {
    const [lon, lat] = this.degrees(x, y);
    return [`${lat.toFixed(6)}°, ${lon.toFixed(6)}°`, this.mgrs(x, y)].filter(Boolean).join(' · ');
  }
}

// With one metre's digits; empty where there is no band: near the poles.
export function mgrs(zone, band, easting, northing) {
  if (!band) return '';
  const column = COLUMNS[zone % 3][Math.floor(easting / SQUARE_M) - 1], row = ROWS[(Math.floor(northing / SQUARE_M) + (zone % 2 ? 0 : 5)) % 20];
  const digits = (metres) => String(Math.floor(metres % SQUARE_M)).padStart(5, '0');
  return `${zone}${band} ${column}${row} ${digits(easting)} ${digits(northing)}`;
}
