# SPDX-License-Identifier: MIT
"""The scorecard of one track: every metric that its columns, the truth and the plan allow.

In: a track, the truth, a plan. Out: `Matched`, `Scorecard`. Owns the zones and definitions; `definitions.py` has their names and sources.

The numbers in brackets are clauses of [ISO/IEC 18305:2016]. Its coverage and availability are shares of places and of time for which the system gives
a position; here a position is at most GAP_S old and not marked lost by the track itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from echostep.arrays import Bools, Floats, Ints
from echostep.errors import EchostepError
from echostep.particles.ellipse import in_ellipse95
from echostep.plan import Plan
from echostep_app.plan.places.faces import OUTSIDE
from echostep_app.plan.places.spaces import PlanSpaces, Spaces
from echostep_app.scorecard.error_statistics import ErrorStatistics, error_statistics, quantile
from echostep_app.scorecard.track_columns import ScoredPath, other_unit

FLOOR_PENALTY_M = 15.0  # per floor [Potorti et al. 2017]
CELL_M = 1.0  # side of the squares that coverage counts: a person's room
TICK_S = 0.1  # between the moments that availability counts, assumed


@dataclass(frozen=True, slots=True)
class Scorecard:
    """The metrics of a track; None where its files lack a metric's data. Shares are from 0 to 1."""

    track: str
    points: int
    span_s: float
    horizontal: ErrorStatistics
    vertical: ErrorStatistics | None
    spherical: ErrorStatistics | None
    bias_m: float
    covariance_m2: tuple[float, float, float]
    ce50_m: float
    ce95_m: float
    ve95_m: float | None
    se95_m: float | None
    floor_probability: float | None
    zone_probability: float | None
    coverage: float
    availability: float
    latency_mean_s: float | None
    latency_p95_s: float | None
    evaal_m: float
    evaal_knows_floors: bool
    ellipse95_holds: float | None
    radius95_holds: float | None
    protection_holds: float | None


def score(track: ScoredPath, truth: ScoredPath, plan: Plan | None = None) -> Scorecard:
    """Compare a track with the truth; raises EchostepError where they have no moment in common."""
    at = match(track, truth)
    error = at.xy_m - at.true_xy_m
    off_m = at.error_m
    height = None if at.height_m is None or at.true_height_m is None else at.height_m - at.true_height_m
    horizontal = error_statistics(off_m)
    vertical = None if height is None else _statistics(np.abs(height))
    spherical = None if height is None else _statistics(np.hypot(off_m, height))
    xx, xy, _, yy = np.cov(error.T, bias=True).ravel().tolist()
    floors = _floors_off(at)
    latency = None if track.latency_s is None else _statistics(track.latency_s[at.row])
    radius, protection = (None if r is None else r[at.row] for r in (track.radius95_m, track.protection_m))
    covered, available = _coverage(track, truth)
    return Scorecard(
        track=str(track.path), points=horizontal.count, span_s=float(at.t_s[-1] - at.t_s[0]),
        horizontal=horizontal, vertical=vertical, spherical=spherical,
        bias_m=float(np.hypot(*error.mean(0))), covariance_m2=(xx, xy, yy),
        ce50_m=horizontal.median_m, ce95_m=horizontal.p95_m,
        ve95_m=vertical.p95_m if vertical else None, se95_m=spherical.p95_m if spherical else None,
        floor_probability=None if floors is None else _share(floors == 0.0, np.isfinite(floors)),
        zone_probability=None if plan is None else _zone_probability(at, plan),
        coverage=covered, availability=available,
        latency_mean_s=latency.mean_m if latency else None, latency_p95_s=latency.p95_m if latency else None,
        evaal_m=quantile(off_m + FLOOR_PENALTY_M * (0.0 if floors is None else np.nan_to_num(floors)), 0.75),
        evaal_knows_floors=floors is not None,
        ellipse95_holds=_ellipse_holds(track, at, error), radius95_holds=_holds(radius, off_m),
        protection_holds=_holds(protection, off_m),
    )  # fmt: skip


def _floors_off(at: Matched) -> Floats | None:
    """Number of floors by which each point is off; NaN where either does not state it."""
    if at.level is None or at.true_level is None:
        return None
    off = np.abs(at.level - at.true_level)
    return off if np.isfinite(off).any() else None


def _zone_probability(at: Matched, plan: Plan) -> float | None:
    """Share of the points in the right zone, among the points whose truth is in one."""
    if at.level is None or at.true_level is None:
        return None
    zones = Zones(plan)
    true, by_track = zones.of(at.true_xy_m, at.true_level), zones.of(at.xy_m, at.level)
    return _share(by_track == true, true != NO_ZONE)


def _coverage(track: ScoredPath, truth: ScoredPath) -> tuple[float, float]:
    """Share of the places of the truth, and of its time, for which the track gives a position."""
    if is_surveyed(truth):
        t_s, xy_m = truth.t_s, truth.xy_m
    else:
        t_s = np.arange(truth.t_s[0], truth.t_s[-1] + 0.5 * TICK_S, TICK_S)
        xy_m = np.column_stack([np.interp(t_s, truth.t_s, truth.xy_m[:, k]) for k in (0, 1)])
    has = known(track, t_s)
    row = np.maximum(np.searchsorted(truth.t_s, t_s, side="right") - 1, 0)
    level = np.zeros(len(t_s)) if truth.level is None else np.nan_to_num(truth.level[row], nan=-1.0)
    cells = np.column_stack([np.floor(xy_m / CELL_M), level])
    visited, cell = np.unique(cells, axis=0, return_inverse=True)
    reached = np.bincount(cell.ravel(), has, len(visited)) > 0.0
    return float(reached.mean()), float(has.mean())


def _ellipse_holds(track: ScoredPath, at: Matched, error_m: Floats) -> float | None:
    """Share of the points whose 95 % ellipse holds the truth."""
    if track.covariance_m2 is None:
        return None
    covariance_m2 = track.covariance_m2[at.row]
    return _share(in_ellipse95(error_m, covariance_m2), np.isfinite(covariance_m2.sum(1)))


def _holds(radius_m: Floats | None, error_m: Floats) -> float | None:
    return None if radius_m is None else _share(error_m <= radius_m, ~np.isnan(radius_m))


def _share(right: Bools, of: Bools) -> float | None:
    return float(right[of].mean()) if of.any() else None


def _statistics(values: Floats) -> ErrorStatistics | None:
    """Of the finite values, in their unit; None without one."""
    finite = values[np.isfinite(values)]
    return error_statistics(finite) if len(finite) else None


NO_ZONE = -1


class Zones:
    """Numbers of the zones of a plan, different on each level: stairs and lifts, else the smallest outline of a room, else what walls enclose."""

    def __init__(self, plan: Plan) -> None:
        self._levels = len(plan.levels)
        self._spaces = PlanSpaces(plan)

    def of(self, xy_m: Floats, level: Floats) -> Ints:
        """Places (n, 2), their levels (n,), NaN where unknown -> (n,) number of the zone, or NO_ZONE."""
        number = np.full(len(xy_m), NO_ZONE, dtype=np.int64)
        for k in range(self._levels):
            here = np.flatnonzero(level == k)
            spaces = self._spaces.on(k) if len(here) else None
            if spaces is not None:
                zone = _zones(spaces, xy_m[here])
                number[here] = np.where(zone == NO_ZONE, NO_ZONE, zone * self._levels + k)
        return number


def _zones(spaces: Spaces, xy_m: Floats) -> Ints:
    """Number of the zone around each place of one level: ways first, then outlines of rooms, then faces."""
    face = spaces.faces.indices_of(xy_m)
    areas = (*spaces.way_areas, *spaces.outlines)
    zone = np.where(face == OUTSIDE, NO_ZONE, face + len(areas)).astype(np.int64)
    size = np.full(len(xy_m), math.inf)
    for k, area in enumerate(areas):
        smaller = 0.0 if k < len(spaces.way_areas) else float(area.area)
        inside = shapely.contains_xy(area, *xy_m.T) & (smaller < size)
        zone[inside], size[inside] = k, smaller
    return zone


PATH_S = 0.5  # median distance of a path's rows, above which they are surveyed points: less than a step
# Time without a row after which a track has no position: rows come at each step, and twice a second while standing
GAP_S = 2.5


@dataclass(frozen=True, slots=True)
class Matched:
    """A track and the truth at n points: places (n, 2) in metres, heights (n,), floors (n,); None where the file does not state them.

    `row` (n,): the track's row at the point, or the newest one before it.
    """

    t_s: Floats
    xy_m: Floats
    true_xy_m: Floats
    row: Ints
    height_m: Floats | None
    true_height_m: Floats | None
    level: Floats | None
    true_level: Floats | None

    @property
    def error_m(self) -> Floats:
        """Horizontal errors (n,)."""
        return np.asarray(np.hypot(*(self.xy_m - self.true_xy_m).T))


def is_surveyed(truth: ScoredPath) -> bool:
    """Whether the truth is surveyed points, not a path."""
    return len(truth.t_s) < 2 or float(np.median(np.diff(truth.t_s))) > PATH_S


def match(track: ScoredPath, truth: ScoredPath) -> Matched:
    """The evaluation points: of a path the track's rows, of surveyed points theirs; without those that the track marks as lost.

    Raises EchostepError where there is no moment in common.
    """
    surveyed = is_surveyed(truth)
    grid, other = (truth, track) if surveyed else (track, truth)
    chosen = np.flatnonzero((grid.t_s >= other.t_s[0]) & (grid.t_s <= other.t_s[-1]))
    if surveyed:
        chosen = chosen[_near(track.t_s, truth.t_s[chosen])]
    row = np.searchsorted(track.t_s, grid.t_s[chosen], side="right") - 1 if surveyed else chosen
    claimed = ~track.lost[row]
    if len(row) and not claimed.any():
        raise EchostepError(f"{track.path}: lost all the time: there is no place to score")
    chosen, row = chosen[claimed], row[claimed]
    if not len(chosen):
        raise EchostepError(
            f"{track.path}: no row within the time of {truth.path} ({truth.t_s[0]:g} to {truth.t_s[-1]:g} s; "
            f"the track's is {track.t_s[0]:g} to {track.t_s[-1]:g} s): both need the same clock"
            f"{other_unit(truth, track.t_s[0], track.t_s[-1]) or other_unit(track, truth.t_s[0], truth.t_s[-1])}"
        )
    t_s = grid.t_s[chosen]
    true_row = chosen if surveyed else np.searchsorted(truth.t_s, t_s, side="right") - 1
    xy_m, height_m, level = _at(track, t_s, row, exact=not surveyed)
    true_xy_m, true_height_m, true_level = _at(truth, t_s, true_row, exact=surveyed)
    return Matched(t_s, xy_m, true_xy_m, row, height_m, true_height_m, level, true_level)


def _at(path: ScoredPath, t_s: Floats, row: Ints, *, exact: bool) -> tuple[Floats, Floats | None, Floats | None]:
    """Places (m, 2), heights and floors (m,) of a path at times (m,): the rows' values if they are exact, else linear between, but the floors."""

    def at(values: Floats) -> Floats:
        return values[row] if exact else np.asarray(np.interp(t_s, path.t_s, values))

    height_m = None if path.height_m is None else at(path.height_m)
    level = None if path.level is None else path.level[row]
    return np.column_stack([at(axis_m) for axis_m in path.xy_m.T]), height_m, level


def _near(t_s: Floats, at: Floats) -> Bools:
    """Which times lie between two rows that are at most GAP_S apart."""
    after = np.clip(np.searchsorted(t_s, at, side="left"), 0, len(t_s) - 1)
    before = np.clip(np.searchsorted(t_s, at, side="right") - 1, 0, len(t_s) - 1)
    return np.asarray(t_s[after] - t_s[before] <= GAP_S)


def known(track: ScoredPath, t_s: Floats) -> Bools:
    """At which times (m,) a track has a row at most GAP_S old that is not marked lost."""
    row = np.searchsorted(track.t_s, t_s, side="right") - 1
    fresh = (row >= 0) & (t_s - track.t_s[np.maximum(row, 0)] <= GAP_S)
    return np.asarray(fresh & ~track.lost[np.maximum(row, 0)])
