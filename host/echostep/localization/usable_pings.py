# SPDX-License-Identifier: MIT
"""Which pings of a segment bring information, and how much.

In: `MeasuredSegment`s in order of time. Out: a `PingBatch` and the pings' densities without a plan. Owns the length of the path, and each ranger's
last ping.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization.background import Background, PlacedPings, RangeMemory, UnplannedDensities
from echostep.localization.echo_likelihood import EchoSettings
from echostep.localization.particle_kernels import PingBatch
from echostep.path import MeasuredSegment

LEAST_POWER = 0.01  # share of independent information below which a ping is left out, by reason: it changes nothing
# Turns on a segment at which its pings count half, by reason: headings between its ends are interpolated
TURNING_RAD = math.radians(45.0)  # as weights of particles
JUDGING_RAD = math.radians(15.0)  # as evidence for the cloud: they choose a way round, and are foretold badly


def judged_share(turn_rad: float) -> float:
    """Share of the information of a turning segment's pings that tells whether the cloud is right."""
    return _loss(turn_rad, TURNING_RAD) / _loss(turn_rad, JUDGING_RAD)


def _loss(turn_rad: float, half_rad: float) -> float:
    """By what the information of a ping is divided on a segment that turns; 2 where it turns by `half_rad`."""
    return 1.0 + (turn_rad / half_rad) ** 2


class UsablePings:
    """Pings from nearly one place repeat each other's errors: each counts by the path since the one before, up to `own` after `correlation_m`."""

    def __init__(self, background: Background, echo: EchoSettings) -> None:
        self.path_m = 0.0  # length of the path so far
        self.hear_by(background, echo)
        self._x_m, self._y_m = 0.0, 0.0  # end of the path in the walk frame
        self._last_ping_m = [-math.inf, -math.inf]  # length of the path at each ranger's last ping

    def hear_by(self, background: Background, echo: EchoSettings) -> None:
        """From now on the pings are those of rangers with these settings."""
        self._correlation_m, self._own = echo.correlation_m, echo.own
        self._ranges = RangeMemory(background, echo)

    @property
    def silent_m(self) -> float:
        """Length of the path since the last ping."""
        return self.path_m - max(self._last_ping_m)

    def take(self, measured: MeasuredSegment) -> tuple[PingBatch, UnplannedDensities]:
        """The pings that bring information, with their share of the segment and their axis in the walk frame, and their densities without a plan."""
        segment = measured.segment
        length, span_s = math.hypot(segment.dx_m, segment.dy_m), segment.t1_s - segment.t0_s
        share = np.ones(len(measured.t_s))
        if span_s > 0.0:
            share = np.clip((measured.t_s - segment.t0_s) / span_s, 0.0, 1.0)
        axis = segment.heading0_rad + share * segment.turn_rad + measured.off_heading_rad
        range_m = np.where(np.isnan(measured.range_m), 0.0, measured.range_m)
        travel_m = self._travels(measured.ranger, self.path_m + share * length)
        power = self._own * np.minimum(travel_m / self._correlation_m, 1.0) / _loss(segment.turn_rad, TURNING_RAD)
        self.path_m += length
        used = power > LEAST_POWER
        way_x_m, way_y_m = segment.way_m(share)
        x_m, y_m = self._x_m + way_x_m, self._y_m + way_y_m
        self._x_m, self._y_m = self._x_m + segment.dx_m, self._y_m + segment.dy_m
        pings = PlacedPings(measured.ranger[used], x_m[used], y_m[used], axis[used], range_m[used], power[used])
        unplanned = self._ranges.densities(pings)
        return PingBatch(
            share[used], pings.axis_rad, pings.range_m, pings.power, pings.ranger, travel_m[used],
            unplanned.missed, unplanned.alike, np.exp(unplanned.either),
        ), unplanned  # fmt: skip

    def _travels(self, ranger: Ints, path_m: Floats) -> Floats:
        """Length of the path (k,) between each ping and the one before it of the same ranger."""
        travel_m = np.zeros(len(path_m))
        for which in (0, 1):
            own = np.flatnonzero(ranger == which)
            if len(own):
                travel = path_m[own]
                last_m, self._last_ping_m[which] = self._last_ping_m[which], float(travel[-1])
                travel[1:] -= travel[:-1].copy()
                travel[0] -= last_m
                travel_m[own] = travel
        return travel_m
