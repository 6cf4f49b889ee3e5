# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of what becomes of a reading: where a beacon is placed, when it is doubted, when the cloud is lost.

In: readings, one at a time. Out: `Beacons` after each. Owns that state; constants are those of the kernels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from echostep.arrays import Floats
from echostep.beacons.beliefs import BeaconMeasurement
from echostep.beacons.initialisation import (
    APART_M,
    BEARING_SD_RAD,
    FEWEST,
    FINER,
    FITTING,
    GRID_M,
    MARGIN,
    PATH_M,
    READING_SD_M,
)
from echostep.beacons.model import BeaconModel
from echostep.beacons.slam import (
    ACQUITTED_FIT,
    FIT_SHARE,
    LOST_FIT,
    MISFIT,
    RECOVERED_FIT,
)
from echostep.beacons.step import FIRST, LOCATE_EVERY, LOCATED_SD_M, MOST_READINGS
from echostep.particles.limits import THREE_SD2
from naive.beacons import Belief, Particle, recover, reweight


def cost(readings: Floats, place: Floats) -> float:
    """Squared normalised residuals of ranges and bearings, none above THREE_SD2; the beacon's axis is the mean of what the bearings say."""
    away = readings[:, :2] - place
    off = (np.hypot(away[:, 0], away[:, 1]) - readings[:, 2]) / READING_SD_M
    axes = np.angle((away[:, 0] + 1j * away[:, 1]) * np.exp(-1j * readings[:, 3]))
    axes = axes[~np.isnan(axes)]
    turned = np.angle(np.exp(1j * (axes - np.angle(np.exp(1j * axes).sum())))) / BEARING_SD_RAD
    return float(np.minimum(off**2, THREE_SD2).sum() + np.minimum(turned**2, THREE_SD2).sum())


def grid(readings: Floats, about: Floats, cells: int, step_m: float) -> tuple[Floats, Floats]:
    """Places (n, 2) on a square grid about a place, and their costs (n,)."""
    axis = step_m * np.arange(-cells, cells + 1)
    places = about + np.array([(x, y) for x in axis for y in axis])
    return places, np.array([cost(readings, place) for place in places])


def locate(readings: Floats) -> tuple[Floats, bool]:
    """The place of least cost, and whether it is the only one and most ranges fit it."""
    if len(readings) < FEWEST or math.hypot(*np.ptp(readings[:, :2], axis=0)) < PATH_M:
        return np.full(2, np.nan), False
    reach = readings[:, 2].max() + 1.0
    places, costs = grid(readings, readings[:, :2].mean(axis=0), int(reach / GRID_M), GRID_M)
    best = places[costs.argmin()]
    rivals = costs[np.hypot(*(places - best).T) > APART_M + 1e-9]
    if (rivals < costs.min() + MARGIN).any():
        return best, False
    places, costs = grid(readings, best, int(2.0 * FINER), GRID_M / FINER)
    best = places[costs.argmin()]
    off = np.hypot(*(readings[:, :2] - best).T) - readings[:, 2]
    return best, bool(np.mean(np.abs(off) < 3.0 * READING_SD_M) >= FITTING)


@dataclass
class Known:
    """What is known of one beacon beyond the beliefs: how well its readings fit, and those that wait for a place."""

    placed: bool = False
    in_place: float = 1.0
    measurements: int = 0
    times_moved: int = 0
    suspect: bool = False
    waiting: list[tuple[float, float, float, float]] = field(default_factory=list)

    def place(self) -> None:
        """The beacon has a new place: nothing contradicts it."""
        self.placed, self.in_place, self.suspect, self.waiting = True, 1.0, False, []


class Beacons:
    """All that is known of so many beacons, and the cloud."""

    def __init__(self, cloud: list[Particle], count: int) -> None:
        self.cloud, self.known = cloud, [Known() for _ in range(count)]
        self.cloud_fit, self.recoveries = 1.0, 0

    def read(
        self, measurement: BeaconMeasurement, model: BeaconModel, walls: Floats, plan_supports: bool, rng: np.random.Generator
    ) -> float:  # fmt: skip
        """One reading; returns the effective size after it."""
        known = self.known[measurement.slot]
        if not known.placed:
            if len(known.waiting) < FIRST and measurement.range_m < 2.0 * math.sqrt(model.drop_var_m2):
                self._drop(measurement.slot, model)
            else:
                self._wait(measurement)
            return float(len(self.cloud))
        fit, size = reweight(self.cloud, measurement, model, walls)
        self._judge(known, fit)
        self.cloud_fit += 0.5 * FIT_SHARE * (fit - self.cloud_fit)
        if self.cloud_fit < LOST_FIT:
            self.cloud_fit, self.recoveries = RECOVERED_FIT, self.recoveries + 1
            recover(self.cloud, measurement, model, rng)
            for each in self.known:
                each.waiting = []
        if not known.suspect:
            known.waiting = []
        elif plan_supports:
            self._wait(measurement)
        return size

    def _judge(self, known: Known, fit: float) -> None:
        """The running fit of a beacon: it is suspect once it misfits while the cloud is not lost, until it fits again."""
        known.measurements += 1
        known.in_place += FIT_SHARE * (fit - known.in_place)
        if known.suspect:
            known.suspect = known.in_place <= ACQUITTED_FIT
        elif known.in_place < MISFIT:
            known.suspect, known.times_moved = True, known.times_moved + 1

    def _drop(self, slot: int, model: BeaconModel) -> None:
        """The beacon lies about each particle, turned anyhow."""
        variances = np.diag([model.drop_var_m2, model.drop_var_m2, math.pi**2])
        for p in self.cloud:
            p.beliefs[slot] = Belief(np.array([*p.place, 0.0]), variances)
        self.known[slot].place()

    def _wait(self, measurement: BeaconMeasurement) -> None:
        """Keep the reading with the cloud's mean place; every few readings look for the place that the newest allow."""
        weight = np.exp([p.log_weight for p in self.cloud])
        mean = np.average([p.place for p in self.cloud], axis=0, weights=weight)
        known = self.known[measurement.slot]
        known.waiting.append((*mean.tolist(), measurement.range_m, measurement.bearing_rad))
        if len(known.waiting) % LOCATE_EVERY:
            return
        place, sure = locate(np.array(known.waiting[-MOST_READINGS:]))
        if sure:
            variances = np.diag([LOCATED_SD_M**2, LOCATED_SD_M**2, math.pi**2])
            for p in self.cloud:
                p.beliefs[measurement.slot] = Belief(np.array([*(place + p.place - mean), 0.0]), variances)
            known.place()
