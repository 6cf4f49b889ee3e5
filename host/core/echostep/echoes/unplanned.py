# SPDX-License-Identifier: MIT
"""Which pings count, and their density if nothing is known about the pose: as received by a wearer anywhere in the building,
or as predicted by the last echoes.

In: walls, their floor, `MeasuredSegment`s in order of time. Out: `Background`: log-density by range; `PingBatch` and the pings'
densities without a plan. Owns what is remembered of both rangers, and the length of the path.

A cloud that explains the echoes no better than this density is wrong, or the plan is. So the density is the best possible without a plan: a
continuing wall is predicted as well as by the plan; the plan has more information only where a view changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import EchoModel, EchoSettings, echo_density, echo_model
from echostep.echoes.range_memory import VIEW_RAD, PlacedPings, new_memory, remembered_densities
from echostep.jit import kernel
from echostep.particles.arrays import PingBatch
from echostep.path import MeasuredSegment, Odometer
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.floor import Floor
from echostep.walls.index import WallIndex

# Assumed, not measured.
POSES = 400  # drawn on the floor: their mean is then good to 5 %
BIN_M = 0.05  # width of a bin of ranges
LEAST_POWER = 0.01  # share of independent information below which a ping is left out: it changes nothing
# Turns on a segment at which its pings count half: headings between its ends are interpolated
TURNING_RAD = math.radians(45.0)  # as weights of particles
EVIDENCE_RAD = math.radians(15.0)  # as evidence for the cloud: they select the path of a turn, and are predicted badly


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
    axis_rad = 2.0 * math.pi * rng.random(POSES)
    return Background(_log_mean_density(x, y, axis_rad, walls.near(x, y), model, bins))


class UnplannedDensities(NamedTuple):
    """Of pings (k,): logs of densities to their power, anywhere in the building or like the ping before, and blurred as for a scattered cloud.

    `counts`: share that is evidence for a cloud: information deferred from a turn only selects particles, since the trunk follows the foot late.
    """

    log: Floats
    log_blurred: Floats
    counts: Floats


class RangeMemory:
    """The density of echoes without any plan: the view of the same ranger continues, or it has changed to any in the building."""

    def __init__(self, background: Background, echo: EchoSettings, blur_m: float = 0.0) -> None:
        self._background, self._model, self._blur_m = background, echo_model(echo), blur_m
        self._memory = new_memory()

    def densities(self, pings: PlacedPings) -> Floats:
        """Rows STRAY to LOG_BLURRED (6, k) for pings in order of time."""
        return remembered_densities(self._memory, pings, self._background.of(pings.range_m), self._blur_m, self._model)


@kernel
def _log_mean_density(x: Floats, y: Floats, axis: Floats, walls: WallIndex, model: EchoModel, bins: int) -> Floats:
    """Log of the mean over the poses of the density in the middle of each bin, and of the probability of no echo."""
    block, distance_m, off_axis_rad, kind = one_receiver()
    mean = np.zeros(bins + 1)
    for i in range(len(x)):
        count = echo_sources(x[i], y[i], axis[i], walls, block)
        for k in range(bins):
            mean[k] += echo_density((k + 0.5) * BIN_M, count, distance_m, off_axis_rad, kind, model)
        mean[bins] += echo_density(0.0, count, distance_m, off_axis_rad, kind, model)
    return np.log(mean / len(x))


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
        stray, missed, alike, density, log, log_blurred = self._ranges.densities(pings)
        return PingBatch(
            share[used], pings.axis_rad, pings.range_m, pings.power, pings.ranger, travel_m[used], stray, missed, alike, density,
        ), UnplannedDensities(log, log_blurred, counts=1.0 - unused_m[used] / travel_m[used])  # fmt: skip

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
