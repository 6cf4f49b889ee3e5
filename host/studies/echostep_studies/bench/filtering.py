# SPDX-License-Identifier: MIT
"""The filter of this project on a walk: the only module of the studies that calls it.

In: segments, a plan, a start. Out: `FilterRun`: estimates, number of particles, CPU time. Owns nothing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.localization import Building, Estimate, FilterSettings, MapFilter, Start, TrackStatus
from echostep.path import MeasuredSegment
from echostep.plan import Plan
from echostep.walls.level_sheet import lay_out_levels

WARM_UP = 3  # segments for which a throw-away filter runs first, so that no compilation is timed


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of a method at a time: a position with status and protection radius, how probable it is that the plan fits, and other `places`.

    `places`: x, y (m), level of each hypothesis that is listed. `covariance_m2`: xx, xy, yy; NaN of a method that states none.
    """

    t_s: float
    x_m: float
    y_m: float
    level: int
    z_m: float
    status: TrackStatus
    protection_m: float
    plan_fits: float = 1.0
    places: tuple[tuple[float, float, int], ...] = ()
    covariance_m2: tuple[float, float, float] = (math.nan, math.nan, math.nan)


@dataclass(frozen=True, slots=True)
class FilterRun:
    """A claim for each segment, the most particles at any time, and the CPU time of all updates."""

    claims: tuple[Claim, ...]
    most_particles: int
    cpu_s: float


def track(segments: Sequence[MeasuredSegment], plan: Plan, start: Start, seed: int) -> FilterRun:
    """The filter with its default settings, and the uncertainty that the plan states, from the first segment on.

    The CPU time is that of the updates, without the tables that a plan needs once.
    """
    laid_out = lay_out_levels(plan)
    building = Building.of(plan, laid_out)
    settings = FilterSettings(plan_sd_m=plan.uncertainty_m or 0.0)
    warm = _new_filter(building, start, segments, settings, seed)
    for segment in segments[:WARM_UP]:
        warm.update(segment)
    map_filter = _new_filter(building, start, segments, settings, seed)
    claims, most, cpu_s = [], 0, 0.0
    for segment in segments:
        begin_s = time.process_time()
        estimate = map_filter.update(segment)
        cpu_s += time.process_time() - begin_s
        claims.append(_claim(estimate))
        most = max(most, sum(len(each.cloud.particles.x_m) for each in map_filter.belief.clouds))
    return FilterRun(tuple(claims), most, cpu_s)


def _new_filter(
    building: Building, start: Start, segments: Sequence[MeasuredSegment], settings: FilterSettings, seed: int
) -> MapFilter:
    rng = np.random.default_rng([seed, 80])
    return MapFilter(building, start, segments[0].segment.heading0_rad, rng, settings)


def _claim(e: Estimate) -> Claim:
    places = tuple((h.x_m, h.y_m, h.level) for h in e.hypotheses)
    covariance_m2 = e.xx_m2, e.xy_m2, e.yy_m2
    return Claim(e.t_s, e.x_m, e.y_m, e.level, e.z_m, e.status, e.protection_m, e.plan_fits, places, covariance_m2)
