# SPDX-License-Identifier: MIT
"""A log as a building to be tracked in: two plans from its even scans, pings from its odd ones, and walks along its path.

In: a log's file and a seed. Out: `LogBuilding`, `LogWalk`. Owns nothing.
Beams that ended in or passed each cell are counted [the counting model of Haehnel 2003]: a cell is occupied, and no passer-by, where at least
STANDING of the beams that reached it ended in it.
The losses of pings are those of the simulated SRF02 (`acoustics`); scans end at 90 degrees, so the rear half of each cone is missing: the rangers
look AHEAD_RAD ahead of abeam; the filter's settings state this.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.errors import EchostepError
from echostep.jit import kernel
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Plan, Pose
from echostep_simulation.world.acoustics import SRF02, Acoustics, wall_db
from echostep_simulation.world.echoes import ranger_bias_m
from echostep_studies.bench.laser.carmen_log import CarmenLog, read_log
from echostep_studies.bench.laser.odometry import Odometry, odometry_of
from echostep_studies.bench.laser.wall_lines import straight_pieces, wall_segments
from echostep_studies.bench.sites import plan_of

HALF_CONE_RAD = math.radians(27.5)  # half of the 55 degree cone [Robot Electronics, sonar FAQ]
AHEAD_RAD = 0.5 * HALF_CONE_RAD  # middle of the half before abeam


def hear(log: CarmenLog, scans: Ints, rng: np.random.Generator, acoustics: Acoustics = SRF02) -> Floats:
    """Ranges (k, 2) of the left and the right ranger at these scans, NaN where no echo is received."""
    bias_m = ranger_bias_m(rng, acoustics)
    ranges_m = np.full((len(scans), 2), np.nan)
    for row, scan in enumerate(scans.tolist()):
        for ranger, side in enumerate((1.0, -1.0)):
            off_axis = np.abs(side * log.angles_rad - 0.5 * math.pi)
            inside = off_axis <= HALF_CONE_RAD
            threshold_db = acoustics.threshold_db + acoustics.threshold_sd_db * rng.standard_normal()
            nearest = nearest_return(log.range_m[scan, inside], off_axis[inside], threshold_db, acoustics)
            noisy = nearest + bias_m[ranger] + acoustics.noise_m * rng.standard_normal()
            ranges_m[row, ranger] = max(noisy, acoustics.minimum_m)
    return ranges_m


def nearest_return(range_m: Floats, off_axis_rad: Floats, threshold_db: float, acoustics: Acoustics) -> float:
    """The nearest of the returns (n,) that is louder than the threshold; NaN: none."""
    for k in np.argsort(range_m).tolist():
        if range_m[k] > acoustics.maximum_m:
            break
        if range_m[k] > 0.0 and wall_db(range_m[k], off_axis_rad[k], acoustics) >= threshold_db:
            return float(range_m[k])
    return math.nan


CELL_M = 0.1
STANDING = 0.25  # [GMapping's threshold of an occupied cell]
USED_M = 10.0  # longer beams are left out: half a degree of pose error is 9 cm there
NO_RETURN = 0.98  # a range above this share of the log's greatest is none
MOST_CELLS = 40_000_000


def standing_places(log: CarmenLog, scans: Ints) -> Floats:
    """Mean end point (n, 2) of the beams in each cell that stands, from the scans of these numbers."""
    pose, range_m = log.pose[scans], log.range_m[scans]
    bearing = pose[:, 2:] + log.angles_rad
    usable = (range_m > 0.0) & (range_m < min(USED_M, NO_RETURN * float(log.range_m.max())))
    ends = pose[:, None, :2] + range_m[..., None] * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
    begins = np.broadcast_to(pose[:, None, :2], ends.shape)[usable]
    ends = ends[usable]
    both = np.vstack([begins, ends]) if len(ends) else np.zeros((1, 2))
    low = both.min(0) - CELL_M
    columns, rows = (int(v) for v in np.ceil((both.max(0) + CELL_M - low) / CELL_M))
    if columns * rows > MOST_CELLS:
        raise EchostepError(f"{log.name}: scans over {columns * CELL_M:.0f} x {rows * CELL_M:.0f} m: too large a map")
    hits, passes, sums = np.zeros((rows, columns)), np.zeros((rows, columns)), np.zeros((rows, columns, 2))
    _count_beams((begins - low) / CELL_M, (ends - low) / CELL_M, hits, passes, sums)
    stands = hits > STANDING * (hits + passes)
    return np.asarray(low + CELL_M * sums[stands] / hits[stands, None])


@kernel
def _count_beams(begins: Floats, ends: Floats, hits: Floats, passes: Floats, sums: Floats) -> None:
    """Add beams (n, 2), in cells, to the counts; a beam passes each cell before its last once. `sums`: of the end points in each cell."""
    for k in range(len(ends)):
        dx, dy = ends[k, 0] - begins[k, 0], ends[k, 1] - begins[k, 1]
        last_row, last_column = int(ends[k, 1]), int(ends[k, 0])
        steps = 2 * int(math.hypot(dx, dy)) + 1
        row, column = -1, -1
        for i in range(steps):
            s = i / steps
            r, c = int(begins[k, 1] + s * dy), int(begins[k, 0] + s * dx)
            if (r != row or c != column) and (r != last_row or c != last_column):
                passes[r, c] += 1.0
            row, column = r, c
        hits[last_row, last_column] += 1.0
        sums[last_row, last_column, 0] += ends[k, 0]
        sums[last_row, last_column, 1] += ends[k, 1]


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
