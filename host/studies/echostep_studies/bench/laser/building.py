# SPDX-License-Identifier: MIT
"""A log as a building to be tracked in: two plans from its even scans, pings from its odd ones, and walks along its path.

In: a log's file and a seed. Out: `LogBuilding`, `LogWalk`. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Plan, Pose
from echostep_studies.bench.laser.carmen_log import CarmenLog, read_log
from echostep_studies.bench.laser.occupancy import standing_places
from echostep_studies.bench.laser.odometry import Odometry, odometry_of
from echostep_studies.bench.laser.scan_pings import AHEAD_RAD, hear
from echostep_studies.bench.laser.wall_lines import straight_pieces, wall_segments
from echostep_studies.bench.sites import plan_of

WALL_M = 1.5  # shortest straight piece that an architect's plan shows
# Time is made up, for the logs' own is damaged in some: a slow walk, and turns on the spot.
SPEED_M_S, TURN_RAD_S, PING_S = 1.0, 1.5, 0.1
Pings = tuple[Floats, Ints, Floats]  # times, rangers, ranges
NO_PINGS: Pings = (np.empty(0), np.empty(0, np.int64), np.empty(0))


@dataclass(frozen=True, slots=True)
class LogBuilding:
    """A log, its plans by name (`full`: all that stands; `walls`: straight pieces of WALL_M), its odometry, and what is heard at each scan (k, 2)."""

    log: CarmenLog
    plans: dict[str, Plan]
    odometry: Odometry
    heard_m: Floats


@dataclass(frozen=True, slots=True)
class LogWalk:
    """`segments` of the path from a scan on; the filter is judged at the end of those in `at_scan` (n,), where the pose was `true` (n, 3) after
    `walked_m` (n,).
    """

    segments: tuple[MeasuredSegment, ...]
    at_scan: tuple[int, ...]
    true: Floats
    walked_m: Floats

    @property
    def start(self) -> Pose:
        """True pose at the first scan."""
        x, y, heading = self.true[0].tolist()
        return Pose(x, y, heading)


@lru_cache(maxsize=1)
def building_of(path: Path, seed: int) -> LogBuilding:
    """Read a log, draw its plans, simulate its pings; raises EchostepError that names file and line."""
    log = read_log(path)
    scans = np.arange(len(log.pose))
    segments = wall_segments(standing_places(log, scans[::2]))
    heard_m = np.full((len(scans), 2), np.nan)
    heard_m[1::2] = hear(log, scans[1::2], np.random.default_rng([seed, 60]))
    plans = {
        "full": plan_of(f"{log.name}/full", segments),
        "walls": plan_of(f"{log.name}/walls", straight_pieces(segments, WALL_M)),
    }
    return LogBuilding(log, plans, odometry_of(log, np.random.default_rng([seed, 61])), heard_m)


def walk_from(building: LogBuilding, first: int, length_m: float = math.inf) -> LogWalk:
    """The path from scan `first` on, to the end of the log or the first scan after `length_m`. Each scan is a pause, with a ping pair at odd ones."""
    pose = building.log.pose
    walked_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(pose[first:, :2], axis=0).T))])
    count = min(int(np.searchsorted(walked_m, length_m)) + 1, len(walked_m))
    builder = _SegmentBuilder(building)
    at_scan = [builder.pause(first)]
    for scan in range(first, first + count - 1):
        builder.move(building.odometry.steps[scan])
        at_scan.append(builder.pause(scan + 1))
    return LogWalk(tuple(builder.segments), tuple(at_scan), pose[first : first + count], walked_m[:count])


class _SegmentBuilder:
    """Segments in a walk frame that begins with the trunk looking along x."""

    def __init__(self, building: LogBuilding) -> None:
        self.segments: list[MeasuredSegment] = []
        self._building = building
        self._t_s, self._heading = 0.0, 0.0

    def pause(self, scan: int) -> int:
        """Stand at a scan; returns the number of the segment."""
        pings = NO_PINGS
        if scan % 2:
            t_s = self._t_s + PING_S
            pings = np.full(2, t_s), np.array([0, 1]), self._building.heard_m[scan]
        self._add(PING_S, np.zeros(3), 0.0, 0.0, pings)
        return len(self.segments) - 1

    def move(self, steps: Floats) -> None:
        """Walk the pieces (k, 3) between two scans."""
        odometry, share = self._building.odometry, math.sqrt(1.0 / max(len(steps), 1))
        for step in steps:
            span_s = math.hypot(step[0], step[1]) / SPEED_M_S + abs(step[2]) / TURN_RAD_S
            self._add(span_s, step, share * odometry.sd_m, share * odometry.turn_sd_rad, NO_PINGS)

    def _add(self, span_s: float, step: Floats, sd_m: float, turn_sd_rad: float, pings: Pings) -> None:
        c, s, (ahead, left, turn) = math.cos(self._heading), math.sin(self._heading), step.tolist()
        segment = PathSegment(
            self._t_s, self._t_s + span_s, c * ahead - s * left, s * ahead + c * left, self._heading, self._heading + turn,
            sd_m, turn_sd_rad, len(self.segments),
        )  # fmt: skip
        self.segments.append(MeasuredSegment(segment, *pings, ahead_rad=AHEAD_RAD))
        self._t_s, self._heading = segment.t1_s, segment.heading1_rad
