"""Zero-velocity inertial navigation of one foot: samples -> stances and steps.

In: time, specific force and angular rate of the foot, any mounting, 50-500 Hz. Out: `Step` when the foot has landed, `Stance` when it has left.
Owns the filter's state (`ins`), the stance detector's (`stance`), and where the last step ended. Walk frame: levelled, z up, origin and yaw
those of the first rest.

Until the foot has been still for a moment there is no level and no navigation; the same holds after samples were missing for too long.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep import ins, stance
from echostep.ins import POS, TILT, YAW, Nav
from echostep.stance import Rest, Window

Floats = NDArray[np.float64]

CONFIRM_S = 0.03  # a stance is told after so much rest
SETTLE_S = 0.2  # by then it has corrected the step that led to it
LEAVE_S = 0.1  # and is over after so long without rest
GAP_S = 0.25  # the filter carries on over shorter gaps
STRAY_SAMPLES = 20  # so many samples in a row from the past: the clock has been set back
WALK_M_S = 1.5  # a foot that nobody watches moves no faster, on the whole
MAX_ACCEL_M_S2, MAX_RATE_RAD_S = 1e3, 1e2  # no foot goes beyond
STEEP_M_S2, STEEP_RAD_S = 15.0, 4.0  # beyond these, two equal readings in a row are a sensor at its limit
LOST_SHARE = 0.3  # of such a reading
LEVEL_S, LEVEL_RAD_S, LEVEL_M_S2 = 0.1, 0.3, 1.0  # still enough, for long enough, to take gravity from
IMPATIENT_S = 3.0  # without any such moment, start all the same
ACCEL_BIAS_M_S2, GYRO_BIAS_RAD_S = 0.3, 0.005
FLAT_M, FLAT_SD_M = 0.04, 0.01  # floors are level: a step that rises less is no stair, kerb or ramp

STEP, STANCE = 0.0, 1.0
EVENT_SIZE = 17  # kind, start, end, move (3), covariance (9), heading, heading sd

STATE = np.dtype(
    [(name, "f8") for name in (
        "t_s", "levelled", "yaw", "still_s", "waited_s", "calm_s", "rest_s", "rest_t_s", "rest_yaw", "in_stance", "began_s", "left_s",
        "stepped", "settled", "yaw_variance", "lost_m2",
    )] + [("samples", "i8"), ("force_samples", "i8"), ("not_finite", "i8"), ("not_later", "i8"), ("stray", "i8"), ("saturated", "i8"), ("gaps", "i8"), ("forced", "i8")]
    + [("origin", "f8", 3), ("force", "f8", 3), ("rate", "f8", 3), ("force_sum", "f8", 3)]
    + [("force_limit_s", "f8", 3), ("rate_limit_s", "f8", 3)]
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class FootSettings:
    """`height_m`: of the sensor above the sole's contact with the floor; the instep of a shoe by default."""

    height_m: float = 0.08


@dataclass(frozen=True, slots=True)
class Stance:
    """The foot stood from `t_start_s` to `t_end_s`; `heading_rad` is its yaw in the walk frame when it left."""

    t_start_s: float
    t_end_s: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class Step:
    """The foot left at `t_start_s`, landed at `t_end_s` and moved by `move_m` (walk frame) with `covariance` (3, 3) m2.

    `heading_rad` is its yaw after the step; the covariance is given for a known yaw before it, and `heading_sd_rad` is the growth of the
    yaw's error: its square is the growth of the variance. All moves together give the position.
    """

    t_start_s: float
    t_end_s: float
    move_m: tuple[float, float, float]
    covariance: Floats
    heading_rad: float
    heading_sd_rad: float


@dataclass(frozen=True, slots=True)
class FootCounts:
    """What was wrong with the samples, and what was done: `not_finite` (or impossible) and `not_later` were skipped, `saturated` trusted less.

    `gaps` made the foot wait for a new level; `forced` stances contradicted the filter, which gave in.
    """

    samples: int
    not_finite: int
    not_later: int
    saturated: int
    gaps: int
    forced: int


@dataclass(frozen=True, slots=True)
class Track:
    """A whole walk: `t_s` (n,), `position_m` (n, 3), `heading_rad` (n,), `stance` (n,) bool, the events and the counts."""

    t_s: Floats
    position_m: Floats
    heading_rad: Floats
    stance: NDArray[np.bool_]
    events: list[Step | Stance]
    counts: FootCounts

    @property
    def steps(self) -> list[Step]:
        """The steps among the events."""
        return [event for event in self.events if isinstance(event, Step)]


class Foot:
    """Feed it samples in any portions; equal samples give equal events, bit for bit."""

    def __init__(self, settings: FootSettings | None = None) -> None:
        self._height_m = (settings or FootSettings()).height_m
        self._nav = ins.new_nav()
        self._window = stance.new_window()
        self._rest = stance.new_rest()
        self._state = np.zeros(1, STATE)

    @property
    def in_stance(self) -> bool:
        """Whether the foot stands."""
        return bool(self._state["in_stance"][0])

    @property
    def position_m(self) -> tuple[float, float, float]:
        """Position in the walk frame."""
        x, y, z = self._nav.position.tolist()
        return x, y, z

    @property
    def heading_rad(self) -> float:
        """Yaw in the walk frame."""
        return float(ins.heading(self._nav))

    @property
    def counts(self) -> FootCounts:
        """What was wrong with the samples so far."""
        return FootCounts(**{name: int(self._state[name][0]) for name in FootCounts.__slots__})

    def feed(self, t_s: Floats, accel: Floats, gyro: Floats) -> list[Step | Stance]:
        """Events of samples t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s, body frame; raises ValueError for other shapes."""
        return self._run(t_s, accel, gyro, np.empty((0, 5)))

    def _run(self, t_s: Floats, accel: Floats, gyro: Floats, rows: Floats) -> list[Step | Stance]:
        t_s, accel, gyro = (np.ascontiguousarray(v, np.float64) for v in (t_s, accel, gyro))
        if t_s.ndim != 1 or accel.shape != (len(t_s), 3) or gyro.shape != (len(t_s), 3):
            raise ValueError(f"samples of shapes {t_s.shape}, {accel.shape}, {gyro.shape}; expected (n,), (n, 3), (n, 3)")
        events = np.zeros((2 * len(t_s), EVENT_SIZE))
        found = _walk(self._state[0], self._nav, self._window, self._rest, self._height_m, t_s, accel, gyro, events, rows)
        return [_event(row) for row in events[:found]]


def walk_track(t_s: Floats, accel: Floats, gyro: Floats, settings: FootSettings | None = None) -> Track:
    """The whole walk of samples t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s at once; what `Foot` would have told live."""
    foot = Foot(settings)
    rows = np.zeros((len(t_s), 5))
    events = foot._run(t_s, accel, gyro, rows)
    return Track(np.asarray(t_s, np.float64), rows[:, :3], rows[:, 3], rows[:, 4] > 0.0, events, foot.counts)


def _event(row: Floats) -> Step | Stance:
    kind, start, end, dx, dy, dz = row[:6].tolist()
    heading, heading_sd = row[15:].tolist()
    if kind == STANCE:
        return Stance(start, end, heading)
    return Step(start, end, (dx, dy, dz), row[6:15].reshape(3, 3).copy(), heading, heading_sd)


@njit(cache=True)
def _walk(
    s: Any, nav: Nav, window: Window, rest: Rest, height_m: float,
    t_s: Floats, accel: Floats, gyro: Floats, events: Floats, rows: Floats,
) -> int:  # fmt: skip
    """Every sample in turn; fills `events`, and `rows` where there are any; returns the number of events."""
    found = 0
    for k in range(len(t_s)):
        if _usable(s, t_s[k], accel[k], gyro[k]):
            dt = t_s[k] - s.t_s
            if s.samples > 1 and not 0.0 < dt <= GAP_S:
                found = _lose(s, nav, rest, dt, events, found)
            stance.put(window, t_s[k], accel[k], gyro[k])
            rate2, force2 = stance.activity(window, nav.gyro_bias)
            if s.levelled:
                found = _advance(s, nav, window, rest, height_m, dt, t_s[k], accel[k], gyro[k], rate2, force2, events, found)
            else:
                found = _find_level(s, nav, min(max(dt, 0.0), GAP_S), t_s[k], accel[k], gyro[k], rate2, force2, events, found)
            s.t_s = t_s[k]
            s.force[:] = accel[k]
            s.rate[:] = gyro[k]
        if len(rows):
            rows[k, 0:3] = nav.position
            rows[k, 3] = ins.heading(nav)
            rows[k, 4] = s.in_stance
    return found


@njit(cache=True)
def _usable(s: Any, t_s: float, accel: Floats, gyro: Floats) -> bool:
    """Whether this is a sample: finite, possible, later than the last one; counts those that are not."""
    possible = math.isfinite(t_s)
    for i in range(3):
        possible = possible and abs(accel[i]) < MAX_ACCEL_M_S2 and abs(gyro[i]) < MAX_RATE_RAD_S  # false for NaN
    if not possible:
        s.not_finite += 1
        return False
    if s.samples > 0 and t_s <= s.t_s:
        s.stray += 1
        if s.stray < STRAY_SAMPLES:
            s.not_later += 1
            return False
    s.stray = 0
    s.samples += 1
    return True


@njit(cache=True)
def _lose(s: Any, nav: Nav, rest: Rest, dt: float, events: Floats, found: int) -> int:
    """Samples are missing, or the clock was set: the stance ends, the level is lost, and what the foot did meanwhile is unknown."""
    s.gaps += 1
    span = min(max(dt, GAP_S), 3600.0)
    s.lost_m2 += (WALK_M_S * span) ** 2
    nav.P[YAW, YAW] = min(nav.P[YAW, YAW] + span, math.pi**2 / 3.0)
    if s.in_stance:
        found = _leave(s, events, found)
    if s.levelled:
        s.yaw = ins.heading(nav)
    stance.end_rest(rest)
    s.levelled = s.still_s = s.waited_s = s.calm_s = s.rest_s = 0.0
    return found


@njit(cache=True)
def _find_level(
    s: Any, nav: Nav, dt: float, t_s: float, accel: Floats, gyro: Floats, rate2: float, force2: float, events: Floats, found: int
) -> int:
    """Wait for a still moment and take level and gyro bias from it; after a while, start without."""
    still = rate2 < LEVEL_RAD_S**2 and force2 < LEVEL_M_S2**2
    s.waited_s += dt
    s.still_s = s.still_s + dt if still else 0.0
    if s.still_s == 0.0:
        s.force_sum[:] = 0.0
        s.force_samples = 0
    s.force_sum += accel
    s.force_samples += 1
    if s.still_s >= LEVEL_S or s.waited_s >= IMPATIENT_S:
        sure = s.still_s >= LEVEL_S
        _begin(s, nav, t_s, math.sqrt(force2), sure)
        found = _land(s, nav, t_s - s.still_s, events, found)
    return found


@njit(cache=True)
def _begin(s: Any, nav: Nav, t_s: float, scatter: float, sure: bool) -> None:
    """Navigate from here on: level, at rest as far as anybody knows."""
    ins.set_level(nav, s.force_sum / s.force_samples, s.yaw)
    nav.velocity[:] = 0.0
    tilt_sd = 0.005 + scatter / ins.GRAVITY_M_S2 if sure else 0.5
    ins.set_covariance(nav, tilt_sd, 0.02 if sure else WALK_M_S, GYRO_BIAS_RAD_S, ACCEL_BIAS_M_S2)
    for i in range(3):
        nav.P[POS + i, POS + i] = s.lost_m2
    s.lost_m2 = 0.0
    s.levelled = 1.0
    s.rest_t_s = t_s


@njit(cache=True)
def _advance(
    s: Any, nav: Nav, window: Window, rest: Rest, height_m: float, dt: float, t_s: float, accel: Floats, gyro: Floats, rate2: float, force2: float,
    events: Floats, found: int,
) -> int:  # fmt: skip
    """One sample of navigation: predict, decide whether the foot rests, correct."""
    ins.predict(nav, dt, s.force, accel, s.rate, gyro)
    _doubt_limits(s, nav, dt, accel, gyro)
    if _rests(s, nav, window, height_m, dt, t_s, gyro, rate2, force2):
        stance.learn_bias(nav, rest, dt, s.rate, gyro)
        s.rest_s += dt
        s.rest_t_s = t_s
        s.rest_yaw = ins.heading(nav)
        if not s.in_stance and s.rest_s >= CONFIRM_S - 1e-6:
            found = _land(s, nav, t_s - s.rest_s, events, found)
        if s.in_stance and not s.settled and s.rest_s >= SETTLE_S:
            _settle(s, nav)
    else:
        stance.end_rest(rest)
        s.rest_s = 0.0
        if s.in_stance and t_s - s.rest_t_s >= LEAVE_S - 1e-6:
            found = _leave(s, events, found)
            if not s.settled:
                _settle(s, nav)
    return found


@njit(cache=True)
def _rests(s: Any, nav: Nav, window: Window, height_m: float, dt: float, t_s: float, gyro: Floats, rate2: float, force2: float) -> bool:
    """Whether the foot rests now; if so, the velocity has been corrected."""
    s.calm_s = s.calm_s + dt if stance.calm(rate2, force2) else 0.0
    if s.calm_s == 0.0:
        return False
    expected = stance.rolling(nav, gyro, height_m)
    variance = stance.rest_variance(rate2)
    if stance.surprise(nav, expected, variance, stance.mean_force(window)) > stance.BELIEF:
        if s.calm_s < stance.LASTING_S and t_s - s.rest_t_s < stance.OVERDUE_S:
            return False
        s.forced += 1
        stance.distrust(nav, t_s - s.rest_t_s)
    stance.hold(nav, expected, variance, dt)
    return True


@njit(cache=True)
def _doubt_limits(s: Any, nav: Nav, dt: float, accel: Floats, gyro: Floats) -> None:
    """A sensor at the end of its range reads the same again and again: how far beyond the truth lies stays unknown all that time."""
    for i in range(3):
        s.force_limit_s[i] = s.force_limit_s[i] + dt if accel[i] == s.force[i] and abs(accel[i]) > STEEP_M_S2 else 0.0
        s.rate_limit_s[i] = s.rate_limit_s[i] + dt if gyro[i] == s.rate[i] and abs(gyro[i]) > STEEP_RAD_S else 0.0
        force = _limit_variance(accel[i], s.force_limit_s[i], dt)
        rate = _limit_variance(gyro[i], s.rate_limit_s[i], dt)
        if force + rate > 0.0:
            s.saturated += 1
            axis = ins.rotation(nav.attitude)[:, i]
            for j in range(3):
                for k in range(3):
                    nav.P[ins.VEL + j, ins.VEL + k] += force * axis[j] * axis[k]
                    nav.P[TILT + j, TILT + k] += rate * axis[j] * axis[k]
            nav.P[YAW, YAW] += rate * axis[2] ** 2


@njit(cache=True)
def _limit_variance(value: float, span_s: float, dt: float) -> float:
    """Growth over `dt` of the variance of the integral of a value at its limit since `span_s`, whose error is the same all the time."""
    return (LOST_SHARE * value) ** 2 * (2.0 * span_s - dt) * dt if span_s > 0.0 else 0.0


@njit(cache=True)
def _land(s: Any, nav: Nav, began_s: float, events: Floats, found: int) -> int:
    """A stance begins; the step that led to it is told, unless it is the first."""
    s.in_stance = 1.0
    s.began_s = max(began_s, s.left_s)
    s.rest_yaw = ins.heading(nav)
    rise = nav.position[2] - s.origin[2]
    if s.stepped and abs(rise) < FLAT_M:
        ins.observe(nav, POS + 2, -rise, FLAT_SD_M**2)
    if s.stepped:
        _write_step(s, nav, events[found])
        found += 1
    s.stepped = 1.0
    s.origin[:] = nav.position
    s.yaw_variance = nav.P[YAW, YAW]
    s.settled = 0.0
    return found


@njit(cache=True)
def _settle(s: Any, nav: Nav) -> None:
    """The rest so far has corrected the step before it; the next step's errors count from here."""
    s.settled = 1.0
    ins.forget_start(nav)


@njit(cache=True)
def _write_step(s: Any, nav: Nav, row: Floats) -> None:
    row[0], row[1], row[2] = STEP, s.left_s, s.began_s
    for i in range(3):
        row[3 + i] = nav.position[i] - s.origin[i]
        for j in range(3):
            row[6 + 3 * i + j] = nav.P[POS + i, POS + j]
    row[15] = s.rest_yaw
    row[16] = math.sqrt(max(nav.P[YAW, YAW] - s.yaw_variance, 0.0))


@njit(cache=True)
def _leave(s: Any, events: Floats, found: int) -> int:
    """The stance is over since its last rest."""
    row = events[found]
    row[0], row[1], row[2], row[15] = STANCE, s.began_s, max(s.rest_t_s, s.began_s), s.rest_yaw
    s.left_s = row[2]
    s.in_stance = 0.0
    return found + 1
