# SPDX-License-Identifier: MIT
"""The beacons of one walk: the cloud is reweighted by their readings, and their places follow from the cloud.

In: a cloud, its last path segment, the beacons' readings on it. Out: log-weights, and `BeaconPlace`s. Owns each beacon's health, when it was
last received, and the readings of beacons whose place is not known yet.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from echostep.arrays import Floats
from echostep.beacons.beliefs import BeaconBeliefs, BeaconMeasurement, empty_beliefs, moments, place_covariance
from echostep.beacons.model import BeaconSettings, beacon_model
from echostep.beacons.slam import SUSPECT, TIMES_MOVED, BeaconHealth, initial_health, propose_heading_jumps
from echostep.beacons.step import Beacons, Waiting, no_waiting, update_by_reading
from echostep.board.gateway import BeaconReading
from echostep.elementary import cos, dot, sin
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.particles import Particles
from echostep.path import PathSegment
from echostep.walls.echo_sources import Walls
from echostep.walls.index import crosses_wall
from echostep.walls.level_sheet import level_of

# Assumed, not measured.
SILENT_S = 8.0  # without a reading, while its reception is expected and others are received: the beacon is silent
EXPECTED_SHARE = 0.6  # of the greatest range at which a beacon was received: within it, and without a wall between, reception is expected


class BeaconState(StrEnum):
    """Known state of a beacon's health."""

    WELL = "well"
    MOVED = "moved"
    SILENT = "silent"


@dataclass(frozen=True, slots=True)
class BeaconPlace:
    """A beacon's place by the cloud: on the map (m), its standard deviation, axis (rad), level, and when it was last received."""

    slot: int
    x_m: float
    y_m: float
    sd_m: float
    axis_rad: float
    level: int
    state: BeaconState
    heard_s: float


class BeaconMap:
    """All beacons that were received on one walk."""

    def __init__(self, walls: Walls, settings: BeaconSettings, rng: np.random.Generator) -> None:
        self._walls = walls
        self._model = beacon_model(settings)
        self._rng = rng
        self.heard_s: float | None = None  # when any beacon was last received
        self._forget()

    def update(
        self, cloud: Cloud, segment: PathSegment, readings: Sequence[BeaconReading], plan_supports: bool = False
    ) -> None:
        """Reweight the cloud, which is at the end of a segment, by the readings on this segment.

        `plan_supports`: whether echoes confirm the cloud by the plan.
        """
        if not self._is_of(cloud):
            self._forget()
            cloud.carried = ()
        length = math.hypot(segment.dx_m, segment.dy_m)
        if length > 0.0 and readings:
            propose_heading_jumps(cloud.turn_rad, cloud.log_weight, length, self._model, self._rng)
        for reading in readings:
            self._make_room(cloud, reading.slot)
            self._heard_s[reading.slot] = reading.t_s
            self._reach_m[reading.slot] = max(self._reach_m[reading.slot], reading.range_m)
            self.heard_s = reading.t_s
            self._reweight(cloud, segment, reading, plan_supports)
            cloud.resample_if_needed()
        if self._health.known.any():
            self._note_unexpected(cloud, segment.t1_s)

    def places(self, cloud: Particles, t_s: float) -> list[BeaconPlace]:
        """Every beacon with a place, by slot. A moved beacon has none until it is located again, and none has one once another cloud is tracked."""
        if not self._is_of(cloud):
            return []
        beacons = moments(_beliefs(cloud), cloud.weight)
        placed = np.flatnonzero(self._health.known & (self._health.each[:, SUSPECT] == 0.0)).tolist()
        return [self._place(cloud, slot, beacons[slot].tolist(), t_s) for slot in placed]

    def covariance(self, cloud: Particles, slot: int) -> Floats:
        """Covariance (2, 2) of a placed beacon's place (m2), the cloud's own error included."""
        return place_covariance(_beliefs(cloud), slot, cloud.weight)

    def _place(self, cloud: Particles, slot: int, moments_of_it: list[float], t_s: float) -> BeaconPlace:
        x, y, sd, axis = moments_of_it
        state = BeaconState.MOVED if self._health.each[slot, TIMES_MOVED] else BeaconState.WELL
        any_heard = self.heard_s is not None and t_s - self.heard_s < SILENT_S
        if any_heard and t_s - max(self._heard_s[slot], self._unexpected_s[slot]) > SILENT_S:
            state = BeaconState.SILENT
        level = 0 if cloud.sheet is None else int(level_of(np.array([x]), cloud.sheet)[0])
        return BeaconPlace(slot, x - level * cloud.pitch_m, y, sd, axis, level, state, self._heard_s[slot])

    def _note_unexpected(self, cloud: Cloud, t_s: float) -> None:
        """Note the time for each beacon whose reception is not expected at the cloud's mean place."""
        weight = cloud.weight
        x, y = dot(weight, cloud.x_m), dot(weight, cloud.y_m)
        beacons = moments(_beliefs(cloud), weight)
        index = self._walls.index
        for slot in np.flatnonzero(self._health.known).tolist():
            bx, by = float(beacons[slot, 0]), float(beacons[slot, 1])
            far = math.hypot(bx - x, by - y) > EXPECTED_SHARE * self._reach_m[slot]
            if far or (len(index.walls) and crosses_wall(bx, by, x, y, index)):
                self._unexpected_s[slot] = t_s

    def _reweight(self, cloud: Cloud, segment: PathSegment, reading: BeaconReading, plan_supports: bool) -> None:
        """Update the cloud by one reading on the segment; particles that the update moves keep their path since then."""
        x, y = _places_at(cloud, segment, reading.t_s)
        since_x, since_y = cloud.x_m - x, cloud.y_m - y
        index = self._walls.near(cloud.x_m, cloud.y_m, reading.range_m)
        measurement = BeaconMeasurement(reading.slot, reading.range_m, reading.bearing_rad)
        beacons = Beacons(_beliefs(cloud), self._health, self._waiting)
        particles = cloud.arrays._replace(x_m=x, y_m=y)
        update_by_reading(particles, beacons, measurement, self._model, index, plan_supports, self._rng)
        cloud.x_m, cloud.y_m = x + since_x, y + since_y

    def _is_of(self, cloud: Particles) -> bool:
        """Whether this cloud has placed the beacons: a search that is followed, or a cloud about a teammate, has placed none."""
        return _beliefs(cloud).mean.shape[1] == len(self._heard_s)

    def _forget(self) -> None:
        """Forget the places, which came from a wrong cloud, and when each beacon was last received."""
        self._health, self._waiting = initial_health(0), no_waiting(0)
        self._heard_s: list[float] = []
        self._reach_m: list[float] = []  # greatest range at which each was received
        self._unexpected_s: list[float] = []  # when each was last too far away or behind a wall

    def _make_room(self, cloud: Cloud, slot: int) -> None:
        """Extend the cloud's beliefs and the lists here, so that they hold this slot."""
        known = len(self._heard_s)
        if slot < known:
            return
        more = slot + 1 - known
        beliefs = zip(_beliefs(cloud), empty_beliefs(len(cloud.x_m), more), strict=True)
        cloud.carried = tuple(np.concatenate(both, axis=1) for both in beliefs)
        fresh, health = initial_health(more), self._health
        self._waiting = Waiting(*(np.concatenate(both) for both in zip(self._waiting, no_waiting(more), strict=True)))
        self._health = BeaconHealth(
            np.concatenate([health.each, fresh.each]), health.all, np.concatenate([health.known, fresh.known])
        )
        self._heard_s += [-math.inf] * more
        self._reach_m += [0.0] * more
        self._unexpected_s += [-math.inf] * more


def _beliefs(cloud: Particles) -> BeaconBeliefs:
    """Each particle's beliefs of the beacons' places; views, not copies."""
    return BeaconBeliefs(*cloud.carried) if cloud.carried else empty_beliefs(len(cloud.x_m), 0)


def _places_at(cloud: Cloud, segment: PathSegment, t_s: float) -> tuple[Floats, Floats]:
    """Places x (n,), y (n,) of the particles at a time on the last segment."""
    span_s = segment.t1_s - segment.t0_s
    back = min(max((segment.t1_s - t_s) / span_s, 0.0), 1.0) if span_s > 0.0 else 0.0
    c, s = cos(cloud.turn_rad), sin(cloud.turn_rad)
    x = cloud.x_m - back * cloud.scale * (c * segment.dx_m - s * segment.dy_m)
    y = cloud.y_m - back * cloud.scale * (s * segment.dx_m + c * segment.dy_m)
    return x, y
