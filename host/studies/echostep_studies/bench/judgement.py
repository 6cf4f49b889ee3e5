# SPDX-License-Identifier: MIT
"""Evaluation of the claims of one run against the truth.

In: claims, true places. Out: `JudgedRun`: arrays of one entry a claim, and the questions that the columns ask. Owns the definitions.

A claim on a wrong floor is at least FLOOR_M off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from echostep.arrays import Bools, Floats, Ints
from echostep.localization import TrackStatus
from echostep.particles.ellipse import in_ellipse95
from echostep.plan import Plan
from echostep_studies.bench.filtering import Claim
from echostep_studies.bench.walks import T, X, Y, Z
from echostep_studies.frame.truth import at_times

FOUND_M = 1.0  # a wearer is found within this error
SEARCH_M = 40.0  # of the way, after which a wearer must be found
LISTED_M = 2.5  # a hypothesis is right within this error: a room
FLOOR_M = 3.5  # least error on a wrong floor: the height of a storey
TIE_M = 0.5  # within so much of the middle between two floors both are right
FALSE_TRACKING_M = 1.0  # error above which "tracking" is false
FALSE_LOST_M = 0.5  # error below which "lost" is false
ALARM_M = 3.0  # error above which a claim must not say "tracking"
FARTHEST_M = 1000.0  # greatest protection radius in the rows: JSON has no infinity
TRACKING, UNCERTAIN, LOST = range(3)
CODES = {TrackStatus.TRACKING: TRACKING, TrackStatus.UNCERTAIN: UNCERTAIN, TrackStatus.LOST: LOST}


@dataclass(frozen=True, slots=True)
class TruePlaces:
    """True places `xy_m` (n, 2), and which levels are right there, `level_right` (n, levels)."""

    xy_m: Floats
    level_right: Bools

    def right(self, level: Ints) -> Bools:
        """Whether levels (n,) are right."""
        return self.level_right[np.arange(len(level)), level]


@dataclass(frozen=True, slots=True)
class JudgedRun:
    """Of n claims, each (n,): time (s), true way walked since the search began (m), error (m), status (a code above), protection radius (m).

    `in_ellipse` (m,): of the claims that say "tracking" with a covariance, whether the 95 % ellipse holds the true place, on its floor. `listed`:
    whether the last claim has the true place, at least among its hypotheses. `search_m`: way after which the wearer must be found.
    """

    t_s: Floats
    walked_m: Floats
    error_m: Floats
    status: Floats
    protection_m: Floats
    in_ellipse: Bools
    listed: bool = True
    search_m: float = SEARCH_M

    @property
    def found_m(self) -> float | None:
        """Way after which every claim is within FOUND_M; None where that is not so within `search_m`, or where the last claim is off."""
        off = np.flatnonzero(self.error_m > FOUND_M)
        first = int(off[-1]) + 1 if len(off) else 0
        if first >= len(self.t_s) or self.walked_m[first] > self.search_m:
            return None
        return float(self.walked_m[first])

    @property
    def false_tracking(self) -> Bools:
        """Claims that say "tracking" and are off by more than FALSE_TRACKING_M."""
        return (self.status == TRACKING) & (self.error_m > FALSE_TRACKING_M)

    @property
    def false_lost(self) -> Bools:
        """Claims that say "lost" and are off by less than FALSE_LOST_M."""
        return (self.status == LOST) & (self.error_m < FALSE_LOST_M)

    @property
    def beyond_protection(self) -> Bools:
        """Claims whose error is greater than their protection radius."""
        return self.error_m > self.protection_m

    @property
    def alarm_delays_s(self) -> list[float]:
        """For each time that the error exceeds ALARM_M: how long until a claim does not say "tracking", or the error is small again."""
        delays, since_s, flagged = [], None, False
        for t_s, off, claims_tracking in zip(
            self.t_s.tolist(), (self.error_m > ALARM_M).tolist(), (self.status != TRACKING).tolist(), strict=True
        ):
            if since_s is not None and not flagged and (claims_tracking or not off):
                delays.append(t_s - since_s)
                flagged = True
            if not off:
                since_s, flagged = None, False
            elif since_s is None:
                since_s = t_s
                if claims_tracking:
                    delays.append(0.0)
                    flagged = True
        if since_s is not None and not flagged:
            delays.append(float(self.t_s[-1]) - since_s)
        return delays

    @property
    def false_alarms(self) -> int:
        """How often the status becomes "lost", after it was "tracking", while the error is below FALSE_LOST_M."""
        count, tracked = 0, False
        for status, false in zip(self.status.tolist(), self.false_lost.tolist(), strict=True):
            if status == LOST:
                count += tracked and false
                tracked = False
            tracked = tracked or status == TRACKING
        return count

    @property
    def span_s(self) -> float:
        """Time from the first claim to the last."""
        return float(self.t_s[-1] - self.t_s[0]) if len(self.t_s) else 0.0


def true_places(truth: Floats, t_s: Floats, plan: Plan) -> TruePlaces:
    """What is true at the times t_s (n,) by the truth (m, 5) of a `SimulatedWalk`."""
    at = at_times(t_s, truth[:, T], truth[:, [X, Y, Z]])
    return TruePlaces(at[:, :2], true_levels(at[:, :2], at[:, 2], plan))


def true_levels(xy_m: Floats, z_m: Floats, plan: Plan) -> Bools:
    """Which levels of a plan are right (n, levels) at true places (n, 2) and heights of the floor (n,).

    The nearest one; in a lift also the nearest of those at which it stops, for it passes the others.
    """
    away_m = np.abs(z_m[:, None] - [level.height_m for level in plan.levels])
    right = _nearest(away_m)
    for lift in (c for c in plan.connectors if c.kind == "lift"):
        inside = shapely.contains_xy(shapely.Polygon(lift.outline_m), xy_m[:, 0], xy_m[:, 1])
        stops = np.ix_(inside, np.isin(np.arange(len(plan.levels)), lift.levels))
        right[stops] |= _nearest(away_m[stops])
    return right


def _nearest(away_m: Floats) -> Bools:
    """The levels that are nearest, of distances (n, levels), and those that are as near but for a tie."""
    return np.asarray(away_m <= away_m.min(1, keepdims=True) + 2.0 * TIE_M)


def errors_m(place_m: Floats, level: Ints, true: TruePlaces) -> Floats:
    """Errors (n,) of places (n, 2) on levels (n,); on a wrong floor at least FLOOR_M."""
    away = place_m - true.xy_m
    error_m = np.hypot(away[:, 0], away[:, 1])
    return np.asarray(np.where(true.right(level), error_m, np.maximum(error_m, FLOOR_M)))


def judge(claims: Sequence[Claim], true: TruePlaces, walked_m: Floats, search_m: float = SEARCH_M) -> JudgedRun:
    """Claims (n,) against the truth at their times; `walked_m` (n,) since the search began."""
    place = np.array([(c.x_m, c.y_m) for c in claims]).reshape(-1, 2)
    level, status = np.array([c.level for c in claims]), np.array([float(CODES[c.status]) for c in claims])
    error_m, covariance_m2 = errors_m(place, level, true), np.array([c.covariance_m2 for c in claims]).reshape(-1, 3)
    held = in_ellipse95(place - true.xy_m, covariance_m2) & true.right(level)
    stated = (status == TRACKING) & ~np.isnan(covariance_m2).any(1)
    return JudgedRun(
        np.array([c.t_s for c in claims]), walked_m, error_m, status,
        np.minimum([c.protection_m for c in claims], FARTHEST_M), held[stated], _listed(claims[-1], error_m[-1], true), search_m,
    )  # fmt: skip


def _listed(claim: Claim, error_m: float, true: TruePlaces) -> bool:
    """Whether the true place is a claim's own or one of its hypotheses."""
    x, y = true.xy_m[-1].tolist()
    near = any(math.hypot(px - x, py - y) < LISTED_M and true.level_right[-1, level] for px, py, level in claim.places)
    return near or bool(error_m < FOUND_M)
