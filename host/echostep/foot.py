"""Zero-velocity inertial navigation of one foot: samples -> stances and steps.

In: time, specific force, angular rate of the foot, any mounting, 50-500 Hz. Out: `Step` when the foot lands, `Stance` when it leaves. Owns the
filter's state (`ins`) and where the last step began. Walk frame: levelled, z up, yaw zero at the start.

The stance detector is the SHOE statistic [Skog et al. 2010] in physical units, with two additions that make one setting serve walking and running:
its threshold grows with the time since the last stance [Wahlstrom et al. 2019], and the velocity in a stance is only as good as zero as the foot's
own rotation allows: the sensor sits a lever arm away from the point of contact, so v = 0 +- lever x rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from echostep import ins

Floats = NDArray[np.float64]

STEP, STANCE = 0, 1
EVENT_SIZE = 12  # kind, start, end, move (3), covariance xx yy zz xy, yaw, yaw sd
CONFIRM_S = 0.03
LEAVE_S = 0.04
GAP_S = 0.25
STILL_ACCEL, STILL_RATE = 0.15, 0.05  # m/s2 and rad/s rms: nobody moves; the gyro shows its bias


@dataclass(frozen=True, slots=True)
class FootSettings:
    """One setting for everybody: `accel_sd`, `gyro_sd` are noise densities (m/s2, rad/s per root Hz) of an MTx-class sensor, vibration included;
    `accel_still`, `rate_still` scale the stance statistic (m/s2, rad/s); `span_s` is its window; `lever_m` the distance from sensor to contact.
    """

    accel_sd: float = 0.06
    gyro_sd: float = 0.003
    accel_still: float = 0.6
    rate_still: float = 0.5
    span_s: float = 0.06
    lever_m: float = 0.1
    still_sd_m_s: float = 0.01
    patience_s: float = 0.6
    growth_s: float = 0.15
    bias_sd: float = 0.005


@dataclass(frozen=True, slots=True)
class Stance:
    """The foot stood still from `t_start_s` to `t_end_s`; `heading_rad` is its yaw in the walk frame."""

    t_start_s: float
    t_end_s: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class Step:
    """The foot left at `t_start_s`, landed at `t_end_s`, and moved by `move_m` (walk frame) with `covariance` (3, 3).

    `heading_rad` is its yaw after the step, `heading_sd_rad` the growth of the yaw's error during it.
    """

    t_start_s: float
    t_end_s: float
    move_m: tuple[float, float, float]
    covariance: Floats
    heading_rad: float
    heading_sd_rad: float


@dataclass(frozen=True, slots=True)
class Track:
    """A whole walk: `t_s` (n,), `position_m` (n, 3), `heading_rad` (n,), `stance` (n,) bool, and the events."""

    t_s: Floats
    position_m: Floats
    heading_rad: Floats
    stance: NDArray[np.bool_]
    events: list[Step | Stance]


class Foot:
    """Feed it samples in any portions; equal samples give equal events."""

    def __init__(self, settings: FootSettings | None = None) -> None:
        s = settings or FootSettings()
        self._numbers = np.array(
            [s.accel_sd, s.gyro_sd, s.accel_still, s.rate_still, s.span_s, s.lever_m, s.still_sd_m_s, s.patience_s,
             s.growth_s, s.bias_sd]
        )  # fmt: skip
        self._state = np.zeros(ins.STATE_SIZE)
        self._state[ins.QUAT] = 1.0
        self._cov = np.zeros((12, 12))
        self._ring = np.zeros((ins.WINDOW, 7))
        self._phase = np.zeros(8)  # standing, begin, end, origin xyz, seen a stance, yaw variance used
        self.bad_samples = 0

    @property
    def in_stance(self) -> bool:
        """Whether the foot stands."""
        return bool(self._phase[0])

    @property
    def position_m(self) -> tuple[float, float, float]:
        """Position in the walk frame."""
        x, y, z = self._state[ins.POS : ins.POS + 3].tolist()
        return x, y, z

    @property
    def heading_rad(self) -> float:
        """Yaw of the sensor's x axis in the walk frame."""
        return float(_yaw(self._state))

    @property
    def gaps(self) -> int:
        """How often samples were missing for longer than a quarter of a second."""
        return int(self._state[ins.GAPS])

    def feed(self, t_s: Floats, accel: Floats, gyro: Floats) -> list[Step | Stance]:
        """Events of samples t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s; samples that are not finite or not later are counted and skipped."""
        track = np.empty((0, 5))
        return self._run(t_s, accel, gyro, track)

    def _run(self, t_s: Floats, accel: Floats, gyro: Floats, track: Floats) -> list[Step | Stance]:
        events = np.zeros((len(t_s) + 2, EVENT_SIZE))
        count = _walk(
            self._state, self._cov, self._ring, self._phase, self._numbers,
            np.ascontiguousarray(t_s, np.float64), np.ascontiguousarray(accel, np.float64),
            np.ascontiguousarray(gyro, np.float64), events, track,
        )  # fmt: skip
        self.bad_samples = int(self._state[ins.BAD])
        return [_event(row) for row in events[:count].tolist()]


def walk_track(t_s: Floats, accel: Floats, gyro: Floats, settings: FootSettings | None = None) -> Track:
    """The whole walk at once, by the same kernel as live."""
    foot = Foot(settings)
    rows = np.zeros((len(t_s), 5))
    events = foot._run(t_s, accel, gyro, rows)
    return Track(np.asarray(t_s), rows[:, :3], rows[:, 3], rows[:, 4] > 0.5, events)


def _event(row: list[float]) -> Step | Stance:
    kind, start, end, dx, dy, dz, xx, yy, zz, xy, yaw, yaw_sd = row
    if kind == STANCE:
        return Stance(start, end, yaw)
    covariance = np.array([[xx, xy, 0.0], [xy, yy, 0.0], [0.0, 0.0, zz]])
    return Step(start, end, (dx, dy, dz), covariance, yaw, yaw_sd)


@njit(cache=True)
def _yaw(state: Floats) -> float:
    r = ins.rotation(state[ins.QUAT : ins.QUAT + 4])
    return math.atan2(r[1, 0], r[0, 0])


@njit(cache=True)
def _begin(state: Floats, cov: Floats, t: float, accel: Floats, gyro: Floats, bias_sd: float) -> None:
    """First sample: level, and know nothing of the velocity but that people start slowly."""
    ins.level(state, accel)
    state[ins.T] = t
    state[ins.ACC : ins.ACC + 3] = accel
    state[ins.GYR : ins.GYR + 3] = gyro
    for i in range(3):
        cov[ins.V + i, ins.V + i] = 0.5**2
        cov[ins.TH + i, ins.TH + i] = 0.1**2 if i < 2 else 0.0
        cov[ins.BG + i, ins.BG + i] = bias_sd**2


@njit(cache=True)
def _gap(cov: Floats, dt: float) -> None:
    """Samples are missing: whatever the foot did in the meantime, a walking foot stays within this."""
    for i in range(3):
        cov[ins.P + i, ins.P + i] += (1.5 * dt) ** 2
        cov[ins.V + i, ins.V + i] += 2.0**2
        cov[ins.TH + i, ins.TH + i] += 0.3**2


@njit(cache=True)
def _walk(
    state: Floats, cov: Floats, ring: Floats, phase: Floats, numbers: Floats,
    t: Floats, accel: Floats, gyro: Floats, events: Floats, track: Floats,
) -> int:  # fmt: skip
    """All samples; fills `events`, and `track` when it has rows; returns the number of events."""
    accel_sd, gyro_sd, accel_still, rate_still, span_s = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]
    lever, still_sd, patience, growth, bias_sd = numbers[5], numbers[6], numbers[7], numbers[8], numbers[9]
    found = 0
    zero = np.zeros(3)
    for k in range(len(t)):
        if _usable(state, t[k], accel[k], gyro[k]):
            count = int(state[ins.COUNT])
            ring[count % ins.WINDOW, 0] = t[k]
            ring[count % ins.WINDOW, 1:4] = accel[k]
            ring[count % ins.WINDOW, 4:7] = gyro[k]
            state[ins.COUNT] = count + 1
            if count == 0:
                _begin(state, cov, t[k], accel[k], gyro[k], bias_sd)
            dt = t[k] - state[ins.T]
            if dt > GAP_S:
                _gap(cov, dt)
                state[ins.GAPS] += 1
                dt = GAP_S
            force = 0.5 * (accel[k] + state[ins.ACC : ins.ACC + 3])
            rate = 0.5 * (gyro[k] + state[ins.GYR : ins.GYR + 3])
            if dt > 0.0:
                ins.predict(state, cov, force, rate, dt, accel_sd, gyro_sd)
            state[ins.T] = t[k]
            state[ins.ACC : ins.ACC + 3] = accel[k]
            state[ins.GYR : ins.GYR + 3] = gyro[k]
            a2, w2 = ins.motion(ring, count + 1, span_s, state[ins.BIAS : ins.BIAS + 3])
            statistic = a2 / accel_still**2 + w2 / rate_still**2
            since = t[k] - phase[2] if phase[0] == 0.0 and phase[6] else 0.0
            threshold = math.exp(min(max(since - patience, 0.0) / growth, 4.0))
            still = statistic < threshold
            if still:
                sd = math.sqrt(still_sd**2 + lever**2 * w2 + (0.05 * span_s) ** 2 * a2)
                ins.observe(state, cov, ins.V, -state[ins.VEL : ins.VEL + 3], sd)
                if a2 < STILL_ACCEL**2 and w2 < STILL_RATE**2 and count > 10:
                    ins.observe(state, cov, ins.BG, gyro[k] - state[ins.BIAS : ins.BIAS + 3], 0.05)
            found = _phases(state, cov, phase, still, dt, events, found)
        if len(track):
            track[k, 0:3] = state[ins.POS : ins.POS + 3]
            track[k, 3] = _yaw(state)
            track[k, 4] = phase[0]
    return found


@njit(cache=True)
def _usable(state: Floats, t: float, accel: Floats, gyro: Floats) -> bool:
    """Whether a sample can be taken: finite, within what a foot can do, later than the last one."""
    good = math.isfinite(t) and (state[ins.COUNT] == 0 or t > state[ins.T])
    for i in range(3):
        good = good and abs(accel[i]) < 1e3 and abs(gyro[i]) < 1e2  # false for NaN, too
    if not good:
        state[ins.BAD] += 1
    return good


@njit(cache=True)
def _phases(
    state: Floats, cov: Floats, phase: Floats, still: bool, dt: float, events: Floats, found: int
) -> int:
    """Stance and swing with a little patience at either end; writes the event that completes."""
    t = state[ins.T]
    if phase[0] == 0.0:
        state[ins.STILL_S] = state[ins.STILL_S] + dt if still else 0.0
        if still and state[ins.STILL_S] >= CONFIRM_S:
            begin = t - state[ins.STILL_S]
            if phase[6]:
                _write_step(state, cov, phase, begin, events[found])
                found += 1
            else:
                phase[3:6] = state[ins.POS : ins.POS + 3]
                _forget_position(cov)
            phase[0], phase[1], phase[6] = 1.0, begin, 1.0
            state[ins.SWING_S] = 0.0
    else:
        state[ins.SWING_S] = 0.0 if still else state[ins.SWING_S] + dt
        if state[ins.SWING_S] >= LEAVE_S:
            events[found, 0], events[found, 1] = STANCE, phase[1]
            events[found, 2] = max(t - state[ins.SWING_S], phase[1])
            events[found, 10] = _yaw(state)
            phase[0], phase[2] = 0.0, events[found, 2]
            state[ins.STILL_S] = 0.0
            found += 1
    return found


@njit(cache=True)
def _write_step(state: Floats, cov: Floats, phase: Floats, begin: float, row: Floats) -> None:
    """The move since the last step was written, with its own covariance; then position and yaw count from here."""
    row[0], row[1], row[2] = STEP, phase[2], begin
    for i in range(3):
        row[3 + i] = state[ins.POS + i] - phase[3 + i]
        phase[3 + i] = state[ins.POS + i]
    row[6], row[7], row[8] = cov[ins.P, ins.P], cov[ins.P + 1, ins.P + 1], cov[ins.P + 2, ins.P + 2]
    row[9] = cov[ins.P, ins.P + 1]
    row[10] = _yaw(state)
    row[11] = math.sqrt(max(cov[ins.TH + 2, ins.TH + 2], 0.0))
    _forget_position(cov)


@njit(cache=True)
def _forget_position(cov: Floats) -> None:
    """Where the foot is and looks now becomes the reference: those errors belong to the steps already written."""
    for j in (ins.P, ins.P + 1, ins.P + 2, ins.TH + 2):
        cov[j, :] = 0.0
        cov[:, j] = 0.0
