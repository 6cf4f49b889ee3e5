// Words and numbers around the map: status, place, health of the streams, beacons, guidance, floors, scale bar; and what a screen reader is told.

const MARKS = { waiting: '○', tracking: '●', uncertain: '◐', lost: '✕' };
const COMPASS = ['E', 'NE', 'N', 'NW', 'W', 'SW', 'S', 'SE'];
const SPOKEN_MS = 8000;  // a screen reader hears a new place no sooner
const FASTEST_RAD_S = Math.PI;  // as the arrow of the guide turns
const $ = (id) => document.getElementById(id);

export class Panel {
  constructor(onFloor) {
    this.onFloor = onFloor;
    this.spoken = { at: -Infinity, status: '', text: '' };
    this.turn = 0;  // of the arrow, in turns without end, so that it goes the short way
  }

  hello({ title, plan }) {
    $('title').textContent = `${title}: ${plan.name}`;
    document.title = title;
    $('goal').replaceChildren(new Option('Go to…', ''), new Option('a place on the map', 'map'),
      ...plan.levels.flatMap(({ rooms, name }, level) => rooms.map((room, k) => new Option(plan.levels.length > 1 ? `${room.name} (${name})` : room.name, `${level} ${k}`))));
    $('floors').replaceChildren(...plan.levels.map((level, k) => {
      const button = document.createElement('button'), share = document.createElement('span');
      button.type = 'button';
      button.textContent = level.name;
      share.className = 'share';
      button.append(share);
      button.onclick = () => this.onFloor(k);
      return button;
    }));
  }

  frame({ told, words, streams, guidance, beams, beacons }, rooms) {
    const status = told?.status ?? 'waiting';
    this.status(status, words);
    $('place').textContent = told ? whereabouts(told, rooms) : '';
    $('echoes').textContent = told ? echoes(beams) : '';
    $('health').textContent = streams ? rates(streams) : 'no bytes yet';
    $('wrong').textContent = streams?.wrong ?? '';
    $('wrong').hidden = !streams?.wrong;
    $('beacons').textContent = census(beacons);
    $('beacons').hidden = !beacons.length;
    this.guide(guidance);
    this.speak(`${status} ${streams?.wrong ?? ''}`, [words, told ? near(told, rooms) : '', streams?.wrong].filter(Boolean).join('. '));
  }

  // The arrow points from where he looks: up is straight ahead.
  guide(guidance) {
    $('guidance').hidden = !guidance;
    if (!guidance) return;
    const { kind, text, arrow_rad, left_m, own } = guidance;
    $('guidance').dataset.kind = kind;
    $('turn').dataset.sign = arrow_rad !== null ? 'arrow' : kind === 'arrived' ? 'there' : 'halt';
    const by = arrow_rad === null ? 0 : Math.atan2(Math.sin(-arrow_rad - this.turn), Math.cos(-arrow_rad - this.turn));
    if (by) {
      this.turn += by;
      $('arrow').style.transition = `transform ${0.2 + Math.abs(by) / FASTEST_RAD_S}s ease-out`;
      $('arrow').style.transform = `rotate(${this.turn}rad)`;
    }
    $('cue').textContent = text;
    $('left').textContent = left_m === null ? '' : `${left_m < 0.95 ? left_m.toFixed(1) : left_m.toFixed(0)} m to go`;
    $('nowhere').hidden = !own;
  }

  status(status, words) {
    $('words').dataset.status = status;
    $('mark').textContent = MARKS[status];
    if ($('said').textContent !== words) $('said').textContent = words;
  }

  floors(shown, told) {
    [...$('floors').children].forEach((button, k) => {
      const share = told?.levels?.[k] ?? 0;
      button.setAttribute('aria-pressed', String(k === shown));
      button.setAttribute('aria-label', `${button.firstChild.textContent}, ${Math.round(100 * share)} % likely`);
      button.lastChild.style.width = `${100 * share}%`;
    });
  }

  scale(view) {
    const longest = 90 / view.scale, unit = 10 ** Math.floor(Math.log10(longest)), length = [5, 2, 1].find((k) => k * unit <= longest) * unit;
    $('bar').style.width = `${length * view.scale}px`;
    $('bar-text').textContent = length < 1 ? `${Math.round(100 * length)} cm` : `${length} m`;
    $('needle').style.transform = `rotate(${-view.turn}rad)`;
  }

  speak(status, text) {
    const now = performance.now(), { spoken } = this;
    if (text === spoken.text || (status === spoken.status && now - spoken.at < SPOKEN_MS)) return;
    this.spoken = { at: now, status, text };
    $('live').textContent = text;
  }
}

function near({ x_m, y_m }, rooms) {
  const away = rooms.map(({ name, at_m: [x, y] }) => [Math.hypot(x - x_m, y - y_m), name]).sort((a, b) => a[0] - b[0]);
  return away.length ? `near ${away[0][1]}` : '';
}

function whereabouts(told, rooms) {
  const degrees = ((told.heading_rad * 180) / Math.PI + 360) % 360, spread = Math.round((told.heading_sd_rad * 180) / Math.PI);
  const heading = told.heading_known ? `${COMPASS[Math.round(degrees / 45) % 8]} ${Math.round(degrees) % 360}° ±${spread}°` : 'heading unknown';
  return [near(told, rooms), `x ${told.x_m.toFixed(1)}, y ${told.y_m.toFixed(1)} m`, heading].filter(Boolean).join(' · ');
}

function echoes(beams) {
  const one = ({ measured_m, expected_m }) => `${length(measured_m)}, plan ${length(expected_m)}`;
  const heard = beams.map((beam) => `${beam.ranger ? 'right' : 'left'} ${one(beam)}`);
  return heard.length ? heard.join(' · ') : 'no echoes';
}

// Beacons in words, those that are not well by number.
function census(beacons) {
  const of = (state) => beacons.filter((beacon) => beacon.state === state).map(({ number }) => number).join(', ');
  const heard = `beacons: ${beacons.filter((beacon) => beacon.heard).length} of ${beacons.length} heard`;
  return [heard, of('silent') && `silent: ${of('silent')}`, of('moved') && `moved: ${of('moved')}`].filter(Boolean).join(' · ');
}

const length = (metres) => (metres === null ? 'none' : `${metres.toFixed(2)} m`);

function rates({ mtx_hz, pings_hz, lost, rejected, late_pings, synchronised }) {
  const rate = (value, unit) => (value === null ? '…' : `${Math.round(value)}${unit}`);
  const late = late_pings ? ` · ${late_pings} late` : '';
  return `MTx ${rate(mtx_hz, ' Hz')} · pings ${rate(pings_hz, '/s')} · drops ${lost}${late} · bad ${rejected} · ${synchronised ? 'SyncOut' : 'no SyncOut'}`;
}
