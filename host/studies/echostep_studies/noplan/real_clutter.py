# SPDX-License-Identifier: MIT
"""Real clutter: a robot's laser log as a walk by its raw odometry, with pings all along it.

In: a log. Out: `SimulatedWalk` in the building that the full laser shows. Owns the rate of the pings, and the drift that is stated. A ping hears like
those of the study `clutter`, but what the scans before and after it show: scans are half a metre to a metre apart, pings of a belt 4 cm.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import wrap
from echostep.path import MeasuredSegment
from echostep_simulation.world.acoustics import SRF02
from echostep_simulation.world.echoes import ranger_bias_m
from echostep_studies.bench.laser.building import HALF_CONE_RAD, building_of, nearest_return, walk_from
from echostep_studies.bench.laser.carmen_log import CarmenLog, logs_in, name_of
from echostep_studies.bench.walks import SimulatedWalk

FOLDER = "carmen"
# Of path, from one to the other of which the growth of the heading's error is stated; scans are 0.5 to 1 m apart
LAGS_M = (2.0, 20.0)
PING_S = 0.036  # from the ping of one ranger to that of the other, as the board triggers SRF02


def names_in(data: Path) -> dict[str, Path]:
    """The logs by name; none where there is no such folder."""
    folder = data / FOLDER
    return {name_of(path): path for path in logs_in(folder)} if folder.is_dir() else {}


def walked_log(path: Path, seed: int) -> SimulatedWalk:
    """The walk along a log, true at its corrected poses."""
    building = building_of(path, seed)
    walk = walk_from(building, 0)
    t_s = np.array([walk.segments[k].segment.t1_s for k in walk.at_scan])
    truth = np.column_stack([t_s, walk.true, np.zeros(len(t_s))])
    hearing = _Hearing(building.log, truth, np.random.default_rng([seed, 88]))
    segments = with_stated_drift(walk.segments, truth)
    return SimulatedWalk(building.plans["full"], tuple(hearing.heard(s) for s in segments), truth)


def with_stated_drift(segments: Sequence[MeasuredSegment], truth: Floats) -> list[MeasuredSegment]:
    """The segments with standard deviations of the turn that grow as the heading's error does from the one of LAGS_M to the other, about its mean.

    `truth` (k, 5) as of a walk. Odometry sums up turns, so its error grows; what is there at once and does not grow is jitter of the corrected poses:
    4 degrees over a metre of acapulco, and over forty.
    """
    pieces = [s.segment for s in segments]
    way_m = np.cumsum([math.hypot(s.dx_m, s.dy_m) for s in pieces])
    stated = np.cumsum([s.turn_sd_rad**2 for s in pieces])
    true = np.interp([s.t1_s for s in pieces], truth[:, 0], np.unwrap(truth[:, 3]))
    error = np.array([s.heading1_rad for s in pieces]) - true
    if way_m[-1] <= LAGS_M[1]:
        return list(segments)
    (near, stated_near), (far, stated_far) = (_grown(way_m, error, stated, lag_m) for lag_m in LAGS_M)
    share = math.sqrt(max(far - near, 0.0) / (stated_far - stated_near))
    return [
        replace(s, segment=replace(p, turn_sd_rad=share * p.turn_sd_rad)) for s, p in zip(segments, pieces, strict=True)
    ]


def _grown(way_m: Floats, error_rad: Floats, stated: Floats, lag_m: float) -> tuple[float, float]:
    """Variance of the heading's error over so much path, about its mean, and that which is stated; `stated` (n,): sum of variances so far."""
    later = np.searchsorted(way_m, way_m + lag_m)
    first = np.flatnonzero(later < len(way_m))
    return float(wrap(error_rad[later[first]] - error_rad[first]).var()), float(
        np.mean(stated[later[first]] - stated[first])
    )


class _Hearing:
    """What two rangers hear between the scans of a log; `truth` (k, 5): t_s, x, y, heading, height at each scan."""

    def __init__(self, log: CarmenLog, truth: Floats, rng: np.random.Generator) -> None:
        self._truth, self._rng, self._pings = truth, rng, 0
        self._heading = np.unwrap(truth[:, 3])
        self._bias_m = ranger_bias_m(rng)
        bearing = log.pose[:, 2:] + log.angles_rad
        ends = log.pose[:, None, :2] + log.range_m[..., None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        near = (log.range_m > 0.0) & (log.range_m < SRF02.maximum_m + 1.0)
        self._returns = [scan[seen] for scan, seen in zip(ends, near, strict=True)]

    def heard(self, measured: MeasuredSegment) -> MeasuredSegment:
        """The segment with its pings, whose cones are whole: the rangers look abeam."""
        s = measured.segment
        first, last = (int(np.ceil(t / PING_S)) for t in (s.t0_s, s.t1_s))
        number = np.arange(first, last)
        t_s, ranger = np.asarray(number * PING_S, np.float64), number % 2
        ranges = np.array([self._range_m(t, r) for t, r in zip(t_s.tolist(), ranger.tolist(), strict=True)])
        return replace(measured, t_s=t_s, ranger=ranger, range_m=ranges.reshape(-1), ahead_rad=0.0)

    def _range_m(self, t_s: float, ranger: int) -> float:
        scan = int(np.clip(np.searchsorted(self._truth[:, 0], t_s) - 1, 0, len(self._truth) - 2))
        x, y = (np.interp(t_s, self._truth[:, 0], self._truth[:, k]) for k in (1, 2))
        axis = np.interp(t_s, self._truth[:, 0], self._heading) + (-0.5 if ranger else 0.5) * math.pi
        ahead = np.concatenate(self._returns[scan : scan + 2]) - [x, y]
        away_m = np.hypot(*ahead.T)
        off_axis = np.abs(wrap(np.arctan2(ahead[:, 1], ahead[:, 0]) - axis))
        inside = off_axis <= HALF_CONE_RAD
        threshold_db = SRF02.threshold_db + SRF02.threshold_sd_db * self._rng.standard_normal()
        nearest = nearest_return(away_m[inside], off_axis[inside], threshold_db, SRF02)
        return max(nearest + self._bias_m[ranger] + SRF02.noise_m * self._rng.standard_normal(), SRF02.minimum_m)
