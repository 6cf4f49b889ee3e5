# SPDX-License-Identifier: MIT
"""Zero-velocity-aided inertial navigation of one foot: samples -> stances and steps.

In: time, specific force and angular rate of the foot, any mounting, 50-500 Hz. Out: `Step` when the foot has landed, `Stance` when it has left.
Owns the state of the kernel `zupt_ins`. Walk frame: levelled, z up, origin and yaw from the first rest; yaw is the foot's turn since then.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from echostep.additions import svg_of
from echostep.arrays import Bools, Floats, Ints
from echostep.foot import ins, stance, zupt_ins, zupt_state
from echostep.foot.magnetometer import MEASURED, TRUSTED, new_compass
from echostep.ports.imu_samples import check_samples

MOST_EXCESS = 0.02  # of the force at rest that is not worth a sentence
LEG_SHARE = 0.1  # sd of a length by a sensor of unrest 1 on a leg; public recordings of shanks err by 0.1 to 0.13, of thighs by 1 and more
NO_MAG: Floats = np.empty((0, 3))  # in place of magnetometer samples


@dataclass(frozen=True, slots=True)
class FootSettings:
    """`height_m`: height of the sensor above the sole's contact with the floor; the instep of a shoe by default."""

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

    `heading_rad` is its yaw after the step. The covariance holds for a known yaw before the step; `heading_sd_rad` is the growth of the yaw's
    error: its square is the growth of the variance. The sum of all moves is the position. `toe_rad` is the angle from the yaw to the direction of the
    toe, as known so far; None until the foot has tipped enough to estimate it. `excess`: the specific force at rest over gravity, less 1. `unrest`:
    above 1 the sensor is on no foot.
    """

    t_start_s: float
    t_end_s: float
    move_m: tuple[float, float, float]
    covariance: Floats = field(repr=False)
    heading_rad: float
    heading_sd_rad: float
    toe_rad: float | None = None
    excess: float = 0.0
    unrest: float = 0.0

    @property
    def scale_sd(self) -> float:
        """Standard deviation of the scale that all lengths so far share: an excess may be an offset or a scale, and a leg's lever is not known."""
        return math.hypot(self.excess, LEG_SHARE * self.unrest**2 if self.unrest > 1.0 else 0.0)

    def doubts(self) -> list[str]:
        """What is wrong with the sensor or its place, a sentence each."""
        percent = f"lengths are known to {100 * self.scale_sd:.0f} % (1 sd) only"
        force = f"the accelerometer shows {ins.GRAVITY_M_S2 * (1.0 + self.excess):.2f} m/s2 at rest, gravity is {ins.GRAVITY_M_S2}"
        worn = f"the sensor does not rest while the foot stands: {percent}; wrong bits, a loose part, a shank or a thigh? Strap it to the shoe"
        wrong = f"{force}: an offset or a wrong scale, {percent}; calibrate it"
        return [worn] if self.unrest > 1.0 else [wrong] * (abs(self.excess) > MOST_EXCESS)


@dataclass(frozen=True, slots=True)
class FootCounts:
    """Counts of samples: all; skipped as `impossible` (not finite, or beyond any foot) or `not_later`; `saturated` ones, with inflated covariance.

    `forced`: samples of rest accepted against the innovation gate. After each of the `gaps`, which include long runs of forced rest, the foot
    is levelled again.
    """

    samples: int
    impossible: int
    not_later: int
    saturated: int
    gaps: int
    forced: int


@dataclass(frozen=True, slots=True)
class Track:
    """A whole walk; a notebook shows it as a picture.

    `t_s` (n,), `position_m` (n, 3), `heading_rad` (n,), `stance` (n,) bool, the events and the counts.

    `toe_known`: yaw zero is the direction of the toe when the foot was levelled (`alignment.aligned`); otherwise it is arbitrary.
    `compass`: stances in which the magnetometer was trusted, and in which it was read.
    """

    t_s: Floats
    position_m: Floats
    heading_rad: Floats
    stance: Bools
    events: list[Step | Stance]
    counts: FootCounts
    toe_known: bool = False
    compass: tuple[int, int] = (0, 0)

    def __repr__(self) -> str:
        """Steps, duration and length."""
        length_m = sum(math.hypot(*step.move_m[:2]) for step in self.steps)
        span_s = float(self.t_s[-1] - self.t_s[0]) if len(self.t_s) else 0.0
        return f"<Track: {len(self.steps)} steps, {span_s:.1f} s, {length_m:.1f} m>"

    def _repr_svg_(self) -> str | None:
        """The track as a picture; None without matplotlib, so that the repr is shown."""
        return svg_of(self)

    @property
    def steps(self) -> list[Step]:
        """The steps among the events."""
        return [event for event in self.events if isinstance(event, Step)]


@dataclass(frozen=True, slots=True)
class FootEvents:
    """Events of samples (n,): `sample_index` (k,) of the sample after which each event was known; `position_m` (n, 3), `heading_rad`, `stance` (n,)
    after each sample.
    """

    events: list[Step | Stance]
    sample_index: Ints
    position_m: Floats
    heading_rad: Floats
    stance: Bools


class Foot:
    """Live processing; equal samples give the same events, bit for bit, in blocks of any size. `nav`: the state after the newest sample."""

    def __init__(self, settings: FootSettings | None = None, noise: ins.Noise | None = None) -> None:
        self._zupt = np.zeros(1, zupt_state.ZUPT_STATE)
        self._zupt["height_m"] = (settings or FootSettings()).height_m
        self.nav = ins.new_nav(noise or ins.Noise())
        self._window = stance.new_window()
        self._sums = stance.new_zaru_sums()
        self._compass = new_compass()

    @property
    def in_stance(self) -> bool:
        """Whether the foot stands."""
        return bool(self._zupt["in_stance"][0])

    @property
    def position_m(self) -> tuple[float, float, float]:
        """Position in the walk frame."""
        x, y, z = self.nav.position.tolist()
        return x, y, z

    @property
    def heading_rad(self) -> float:
        """Yaw in the walk frame."""
        return float(ins.heading(self.nav))

    @property
    def compass(self) -> tuple[int, int]:
        """Stances in which the magnetometer was trusted, and in which it was read."""
        return int(self._compass.seen[TRUSTED]), int(self._compass.seen[MEASURED])

    @property
    def counts(self) -> FootCounts:
        """Counts of the samples so far."""
        return FootCounts(*(int(self._zupt[name][0]) for name in FootCounts.__slots__))

    def feed(self, t_s: Floats, accel: Floats, gyro: Floats, mag: Floats | None = None) -> list[Step | Stance]:
        """Events of samples t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s, mag (n, 3) of any unit, body frame.

        Raises ValueError for other shapes.
        """
        return self._run(t_s, accel, gyro, mag, np.empty((0, zupt_state.ROW_SIZE)))

    def track(self, t_s: Floats, accel: Floats, gyro: Floats, mag: Floats | None = None) -> FootEvents:
        """As `feed`, with the sample after which each event was known."""
        rows = np.zeros((len(t_s), zupt_state.ROW_SIZE))
        events = self._run(t_s, accel, gyro, mag, rows)
        known = np.searchsorted(rows[:, zupt_state.ROW_EVENT_COUNT], np.arange(1, len(events) + 1))
        position_m = rows[:, zupt_state.ROW_POSITION : zupt_state.ROW_POSITION + 3]
        heading_rad, stands = rows[:, zupt_state.ROW_HEADING], rows[:, zupt_state.ROW_IN_STANCE] > 0.0
        return FootEvents(events, known, position_m, heading_rad, stands)

    def _run(self, t_s: Floats, accel: Floats, gyro: Floats, mag: Floats | None, rows: Floats) -> list[Step | Stance]:
        """Events of the samples; fills `rows` (n, ROW_SIZE), or nothing if it is empty."""
        t_s, accel, gyro = (np.ascontiguousarray(v, np.float64) for v in (t_s, accel, gyro))
        mag = NO_MAG if mag is None else np.ascontiguousarray(mag, np.float64)
        if t_s.ndim != 1 or any(v.shape != (len(t_s), 3) for v in (accel, gyro, *([] if mag is NO_MAG else [mag]))):
            raise ValueError(
                f"samples of shapes {t_s.shape}, {accel.shape}, {gyro.shape}; expected (n,), (n, 3), (n, 3), mag as gyro"
            )
        events = np.zeros((zupt_state.EVENTS_PER_SAMPLE * len(t_s), zupt_state.EVENT_SIZE))
        state = zupt_state.ZuptInsState(self._zupt[0], self.nav, self._window, self._sums, self._compass)
        output = zupt_state.Output(events, rows, np.zeros(1, np.int64))
        zupt_ins.process(state, zupt_state.Samples(t_s, accel, gyro, mag), output)
        return [_event(row) for row in events[: output.written[0]]]


def walk_track(
    t_s: Floats,
    accel: Floats,
    gyro: Floats,
    settings: FootSettings | None = None,
    noise: ins.Noise | None = None,
    mag: Floats | None = None,
) -> Track:
    """Track of a whole walk, samples t_s (n,) s, accel (n, 3) m/s2, gyro (n, 3) rad/s; bit for bit as by `Foot` live.

    Raises EchostepError for other units or another order, with the factor; ValueError for other shapes.
    """
    check_samples(t_s, accel, gyro)
    foot = Foot(settings, noise)
    found = foot.track(t_s, accel, gyro, mag)
    t_s = np.asarray(t_s, np.float64)
    return Track(
        t_s, found.position_m, found.heading_rad, found.stance, found.events, foot.counts, compass=foot.compass
    )


def _event(row: Floats) -> Step | Stance:
    """The event of a row (EVENT_SIZE,)."""
    start_s, end_s = row[[zupt_state.START_S, zupt_state.END_S]].tolist()
    heading, heading_sd, toe, excess, unrest = row[zupt_state.HEADING : zupt_state.UNREST + 1].tolist()
    if row[zupt_state.KIND] == zupt_state.STANCE:
        return Stance(start_s, end_s, heading)
    dx, dy, dz = row[zupt_state.MOVE : zupt_state.MOVE + 3].tolist()
    covariance = row[zupt_state.COVARIANCE : zupt_state.COVARIANCE + 9].reshape(3, 3).copy()
    toe_rad = None if math.isnan(toe) else toe
    return Step(start_s, end_s, (dx, dy, dz), covariance, heading, heading_sd, toe_rad, excess, unrest)
