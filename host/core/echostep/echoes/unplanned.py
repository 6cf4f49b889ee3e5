# SPDX-License-Identifier: MIT
"""Which pings count, and their density if nothing is known about the pose: as received by a wearer anywhere in the building,
or as predicted by the last echoes.

In: walls, their floor, `MeasuredSegment`s in order of time. Out: `Background`: log-density by range; `PingBatch` and the pings'
densities without a plan. Owns the views of both rangers, each the line in the walk frame that it detected last, or none, and the length of the path.

A cloud that explains the echoes no better than this density is wrong, or the plan is. So the density is the best possible without a plan: a
continuing wall is predicted as well as by the plan; the plan has more information only where a view changes. A smooth wall answers from the foot of
the perpendicular, whatever the ranger's axis: so its distance shrinks by the way along its normal. An extended Kalman filter of distance and
direction of the normal. An edge or a corner answers as a wall whose normal turns, which TURN_SD_RAD allows.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import (
    STRAY_ON,
    EchoModel,
    EchoSettings,
    MissedEchoes,
    detection,
    echo_density,
    echo_model,
    normal,
)
from echostep.jit import kernel
from echostep.particles.arrays import PingBatch
from echostep.path import MeasuredSegment, Odometer
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.floor import Floor
from echostep.walls.index import CONE_RAD, WallIndex
from echostep.walls.tile_points import WALL

# Assumed, not measured.
# Of a new wall's normal about the ranger's axis: half of the angle at which walls answer
AXIS_SD_RAD = math.radians(20.0)
TURN_SD_RAD = 0.05  # change of the normal on a metre of path
VIEW_M = 2.5  # mean length of the path between two changes of a view: walls, doors, corners
POSES = 400  # drawn on the floor: their mean is then good to 5 %
BIN_M = 0.05  # width of a bin of ranges
VIEW_RAD = 2.0 * CONE_RAD  # mean turn of a ranger between two changes of its view: the width of its cone
LEAST_POWER = 0.01  # share of independent information below which a ping is left out: it changes nothing
# Turns on a segment at which its pings count half: headings between its ends are interpolated
TURNING_RAD = math.radians(45.0)  # as weights of particles
EVIDENCE_RAD = math.radians(15.0)  # as evidence for the cloud: they select the path of a turn, and are predicted badly


class LastWall:
    """`distance_m`, `normal_rad`: the line seen from where the last echo was received; their covariance."""

    def __init__(self, range_m: float, axis_rad: float, sd_m: float, slant_m: float) -> None:
        """Begin with a first echo. Standard deviation of a range: `sd_m`, and `slant_m` per radian off the axis."""
        self._sd_m, self._slant_m = sd_m, slant_m
        self.distance_m, self.normal_rad = range_m, axis_rad
        self._var_m2, self._covariance_m, self._var_rad2 = sd_m**2, 0.0, AXIS_SD_RAD**2

    def move(self, dx_m: float, dy_m: float) -> None:
        """Predict the line as seen after this way in the walk frame."""
        c, s = math.cos(self.normal_rad), math.sin(self.normal_rad)
        self.distance_m -= c * dx_m + s * dy_m
        across = s * dx_m - c * dy_m  # change of the distance with the normal
        self._var_m2 += across * (2.0 * self._covariance_m + across * self._var_rad2)
        self._covariance_m += across * self._var_rad2
        self._var_rad2 += TURN_SD_RAD**2 * math.hypot(dx_m, dy_m)

    def densities(self, range_m: float, axis_rad: float, blur_m: float, model: EchoModel) -> tuple[float, float]:
        """Density (1/m) of an echo of this wall, and blurred by a standard deviation; it is detected as a wall of the plan would be."""
        detected = detection(self.distance_m, abs(wrap(self.normal_rad - axis_rad)), WALL, model)
        off_m, variance_m2 = range_m - self.distance_m, self._var_m2 + self._error_m(axis_rad) ** 2
        blurred = normal(off_m, math.sqrt(variance_m2 + blur_m**2))
        return detected * normal(off_m, math.sqrt(variance_m2)), detected * blurred

    def update(self, range_m: float, axis_rad: float, power: float) -> None:
        """Correct the line by an echo, whose error counts by `power`: errors of successive echoes are alike."""
        total = self._var_m2 + self._error_m(axis_rad) ** 2 / power
        gain_m, gain_rad = self._var_m2 / total, self._covariance_m / total
        difference = range_m - self.distance_m
        self.distance_m += gain_m * difference
        self.normal_rad += gain_rad * difference
        self._var_rad2 -= gain_rad * self._covariance_m
        self._covariance_m -= gain_m * self._covariance_m
        self._var_m2 -= gain_m * self._var_m2

    def _error_m(self, axis_rad: float) -> float:
        """Standard deviation of a range."""
        return self._sd_m + self._slant_m * abs(wrap(self.normal_rad - axis_rad))


class UnplannedView:
    """The view of one ranger without a plan: for each ping call `move`, `densities`, `update`, in this order."""

    def __init__(self, echo: EchoSettings) -> None:
        self._echo, self._model = echo, echo_model(echo)
        self._wall: LastWall | None = None  # None before the first echo
        self._x_m, self._y_m, self._axis_rad = math.nan, math.nan, math.nan

    @property
    def is_silent(self) -> bool:
        """Whether the last ping had no echo, or there was no ping."""
        return self._wall is None

    def move(self, x_m: float, y_m: float, axis_rad: float) -> float:
        """Advance to the place and axis of the next ping; returns the probability that the view is the same there, 0 for the first one."""
        dx_m, dy_m, turn_rad = x_m - self._x_m, y_m - self._y_m, abs(wrap(axis_rad - self._axis_rad))
        self._x_m, self._y_m, self._axis_rad = x_m, y_m, axis_rad
        if math.isnan(dx_m):
            return 0.0
        if self._wall is not None:
            self._wall.move(dx_m, dy_m)
        return math.exp(-math.hypot(dx_m, dy_m) / VIEW_M - turn_rad / VIEW_RAD)

    def densities(self, range_m: float, axis_rad: float, stray: float, blur_m: float) -> tuple[float, float]:
        """Density (1/m) of a range if the view continues, and blurred by a standard deviation; range 0: the probability of no echo.

        `stray`: probability of a second reflection where nothing answers.
        """
        if self._wall is None:
            return (1.0 - stray if range_m <= 0.0 else stray / (self._echo.maximum_m - self._echo.minimum_m),) * 2
        return (0.0, 0.0) if range_m <= 0.0 else self._wall.densities(range_m, axis_rad, blur_m, self._model)

    def update(self, range_m: float, axis_rad: float, power: float, goes_on: bool) -> None:
        """Update by a ping; `goes_on`: whether the view continues, by the densities."""
        if range_m <= 0.0:
            if not goes_on:  # otherwise it is likelier that an echo was missed
                self._wall = None
        elif goes_on and self._wall is not None:
            self._wall.update(range_m, axis_rad, power)
        else:
            self._wall = LastWall(range_m, axis_rad, self._echo.sd_m, self._echo.slant_m)


class Background(NamedTuple):
    """`log_density` (bins + 1,): log of the density (1/m) in each bin of BIN_M; the last entry: log-probability of no echo."""

    log_density: Floats

    def of(self, range_m: Floats) -> Floats:
        """Log-densities of ranges (k,); 0: no echo."""
        last = len(self.log_density) - 1
        k = np.minimum((range_m / BIN_M).astype(np.int64), last - 1)
        return self.log_density[np.where(range_m > 0.0, k, last)]


def background(walls: Walls, floor: Floor, model: EchoModel) -> Background:
    """The mean of the echo density over poses evenly on the floor; for a plan without a floor, even over all ranges."""
    bins = math.ceil(model.maximum_m / BIN_M) + 1
    if not len(floor.x_m):
        return Background(np.full(bins + 1, -math.log(model.maximum_m)))
    rng = np.random.default_rng(0)
    x, y = floor.draw(POSES, rng)
    density = _mean_density(x, y, 2.0 * math.pi * rng.random(POSES), walls.near(x, y), model, bins)
    return Background(np.log(density))


class PlacedPings(NamedTuple):
    """Pings (k,): `ranger`; place and axis in the walk frame; `range_m`, 0: no echo; `power`."""

    ranger: Ints
    x_m: Floats
    y_m: Floats
    axis_rad: Floats
    range_m: Floats
    power: Floats


class UnplannedDensities(NamedTuple):
    """Of pings (k,): `stray`, probability of a second reflection where nothing answers, by the one before; `missed`, odds that a silent ping missed
    its echo, 0 for an echo; `alike`, the density if like the ping before, without these two.

    Logs of densities to the pings' power, anywhere in the building or like the ping before: `either`, and `blurred` as for a scattered cloud.
    `counts`: share that is evidence for a cloud: information deferred from a turn only selects particles, since the trunk follows the foot late.
    """

    stray: Floats
    missed: Floats
    alike: Floats
    either: Floats
    blurred: Floats
    counts: Floats


class RangeMemory:
    """The density of echoes without any plan: the view of the same ranger continues, or it has changed to any in the building."""

    def __init__(self, background: Background, echo: EchoSettings, blur_m: float = 0.0) -> None:
        self._background, self._echo, self._blur_m = background, echo, blur_m
        self._missed = MissedEchoes()
        self._views = [UnplannedView(echo), UnplannedView(echo)]

    def densities(self, pings: PlacedPings) -> UnplannedDensities:
        """For pings (k,) in order of time."""
        anywhere = np.exp(self._background.of(pings.range_m))
        stray, missed, alike, blurred, changed = (np.zeros(len(anywhere)) for _ in range(5))
        for k, which in enumerate(pings.ranger.tolist()):
            view, range_m = self._views[which], float(pings.range_m[k])
            stray[k] = self._echo.stray * (STRAY_ON if view.is_silent else 1.0)
            missed[k] = self._missed.odds(which) if range_m <= 0.0 else 0.0
            self._missed.update(which, range_m)
            axis_rad = float(pings.axis_rad[k])
            same = view.move(float(pings.x_m[k]), float(pings.y_m[k]), axis_rad)
            changed[k] = 1.0 - (1.0 - self._echo.outlier) * same
            alike[k], blurred[k] = view.densities(range_m, axis_rad, float(stray[k]), self._blur_m)
            goes_on = (1.0 - changed[k]) * (alike[k] + missed[k]) > changed[k] * anywhere[k]
            view.update(range_m, axis_rad, float(pings.power[k]), goes_on)
        either, either_blurred = (
            changed * (anywhere + missed) ** pings.power + (1.0 - changed) * (like + missed) ** pings.power
            for like in (alike, blurred)
        )
        return UnplannedDensities(stray, missed, alike, np.log(either), np.log(either_blurred), np.ones(len(missed)))


@kernel
def _mean_density(x: Floats, y: Floats, axis: Floats, walls: WallIndex, model: EchoModel, bins: int) -> Floats:
    """Mean over the poses of the density in the middle of each bin, and of the probability of no echo."""
    block, distance_m, off_axis_rad, kind = one_receiver()
    mean = np.zeros(bins + 1)
    for i in range(len(x)):
        count = echo_sources(x[i], y[i], axis[i], walls, block)
        for k in range(bins):
            mean[k] += echo_density((k + 0.5) * BIN_M, count, distance_m, off_axis_rad, kind, model)
        mean[bins] += echo_density(0.0, count, distance_m, off_axis_rad, kind, model)
    return mean / len(x)


def evidence_share(turn_rad: float) -> float:
    """Share of the information of a turning segment's pings that is evidence for or against the cloud."""
    return _loss(turn_rad, TURNING_RAD) / _loss(turn_rad, EVIDENCE_RAD)


def _loss(turn_rad: float, half_rad: float) -> float:
    """Divisor of a ping's information on a segment that turns; 2 if it turns by `half_rad`."""
    return 1.0 + (turn_rad / half_rad) ** 2


class UsablePings:
    """Pings of nearly one view have correlated errors: each counts by the change of the view since the ping before, up to `own` on `correlation_m`.

    The axis within a turn is uncertain, so its pings count less, and the remainder is deferred to the first ping after it. A ranger counts from its
    first echo on: until then it may not work.
    """

    def __init__(self, background: Background, echo: EchoSettings, blur_m: float = 0.0) -> None:
        """`blur_m`: of the ranges, for scattered clouds."""
        self._blur_m = blur_m
        self.odometer = Odometer()
        self.set_ranger_model(background, echo)
        self._x_m, self._y_m = 0.0, 0.0  # end of the path in the walk frame
        self._viewed_m = 0.0  # way of the views: the path, and `correlation_m` for each VIEW_RAD of turning
        # Mark on that way at each ranger's last ping, from its first echo on; the share deferred from the last turn to its next one
        self._last_ping_m, self._unused_m = [-math.inf, -math.inf], [0.0, 0.0]

    def set_ranger_model(self, background: Background, echo: EchoSettings) -> None:
        """Use these ranger settings, and this density of echoes without a plan, from the next segment on."""
        self._correlation_m, self._own = echo.correlation_m, echo.own
        self._ranges = RangeMemory(background, echo, self._blur_m)

    @property
    def silent_m(self) -> float:
        """Way of the views since the last ping."""
        return self._viewed_m - max(self._last_ping_m)

    def take(self, measured: MeasuredSegment) -> tuple[PingBatch, UnplannedDensities]:
        """The informative pings, with their share of the segment and their axis in the walk frame, and their densities without a plan."""
        segment = measured.segment
        length, span_s = math.hypot(segment.dx_m, segment.dy_m), segment.t1_s - segment.t0_s
        viewed_m = length + self._correlation_m * abs(segment.turn_rad) / VIEW_RAD
        share = np.ones(len(measured.t_s))
        if span_s > 0.0:
            share = np.clip((measured.t_s - segment.t0_s) / span_s, 0.0, 1.0)
        axis = segment.heading0_rad + share * segment.turn_rad + measured.off_heading_rad
        range_m = np.where(np.isnan(measured.range_m), 0.0, measured.range_m)
        travel_m, unused_m = self._travels(measured.ranger, range_m, self._viewed_m + share * viewed_m)
        loss = _loss(segment.turn_rad, TURNING_RAD)
        power = self._own * np.minimum(travel_m / self._correlation_m, 1.0) / loss
        self.odometer.add(length)
        self._viewed_m += viewed_m
        left_m = (1.0 - 1.0 / loss) * min(viewed_m, self._correlation_m)
        self._unused_m = [unused + left_m for unused in self._unused_m]
        used = power > LEAST_POWER
        way_x_m, way_y_m = segment.way_m(share)
        x_m, y_m = self._x_m + way_x_m, self._y_m + way_y_m
        self._x_m, self._y_m = self._x_m + segment.dx_m, self._y_m + segment.dy_m
        pings = PlacedPings(measured.ranger[used], x_m[used], y_m[used], axis[used], range_m[used], power[used])
        unplanned = self._ranges.densities(pings)
        return PingBatch(
            share[used], pings.axis_rad, pings.range_m, pings.power, pings.ranger, travel_m[used],
            unplanned.stray, unplanned.missed, unplanned.alike, np.exp(unplanned.either),
        ), unplanned._replace(counts=1.0 - unused_m[used] / travel_m[used])  # fmt: skip

    def _travels(self, ranger: Ints, range_m: Floats, viewed_m: Floats) -> tuple[Floats, Floats]:
        """Way of the view (k,) between each ping and the one before it of the same ranger, 0 before its first echo; the deferred share."""
        last_m, left_m, travel_m, unused_m = self._last_ping_m, self._unused_m, *np.zeros((2, len(viewed_m)))
        for k, (which, heard_m, mark_m) in enumerate(
            zip(ranger.tolist(), range_m.tolist(), viewed_m.tolist(), strict=True)
        ):
            if heard_m > 0.0 or last_m[which] > -math.inf:
                unused_m[k], left_m[which] = left_m[which], 0.0
                travel_m[k], last_m[which] = mark_m - last_m[which] + unused_m[k], mark_m
        return travel_m, unused_m
