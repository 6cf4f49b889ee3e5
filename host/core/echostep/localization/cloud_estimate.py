# SPDX-License-Identifier: MIT
"""The estimate of a cloud: its moments, and how likely small errors are.

In: clouds, the probability of each. Out: `Estimate`. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import cos, dot, exp, product, sin
from echostep.localization.estimate import TAIL, Estimate, TrackStatus
from echostep.localization.particles.particles import Particles
from echostep.localization.particles.places import LikelyPlace, hypotheses
from echostep.particles.ellipse import CHI2_95, ellipse95
from echostep.particles.limits import BELIEVED, HALF_STOREY_M, LOST_M, PROBABLE, RISK, SURE, TRACKING_M
from echostep.plan import Pose

# Times the weight near the mean of a cloud of several places, with which the likeliest of them is its position, assumed
MUCH_LIKELIER = 2.0
EVEN = 1e-9  # length of the mean unit vector of headings that cancel, but for rounding
SPREAD_M = 0.75  # standard deviation of a cloud above which its hypotheses are listed, assumed


class Moments(NamedTuple):
    """Weighted mean (m), covariance (m2), and mean unit vector of the headings."""

    x_m: float
    y_m: float
    xx_m2: float
    xy_m2: float
    yy_m2: float
    east: float
    north: float


def moments(cloud: Particles, weight: Floats, walk_heading_rad: float) -> Moments:
    """Moments of a cloud with these weights (n,)."""
    heading_rad = cloud.turn_rad + walk_heading_rad
    x, y, east, north = (dot(weight, v) for v in (cloud.map_x_m, cloud.y_m, cos(heading_rad), sin(heading_rad)))
    dx, dy = cloud.map_x_m - x, cloud.y_m - y
    xx, xy, yy = (dot(weight, square) for square in (dx * dx, dx * dy, dy * dy))
    return Moments(x, y, xx, xy, yy, east, north)


def weight_about(cloud: Particles, at: Moments | Pose, z_m: float, map_sd_m: float = 0.0) -> tuple[float, float]:
    """Weight of a cloud within TRACKING_M and within LOST_M of a place in the map, and within HALF_STOREY_M of its height.

    `map_sd_m`: standard deviation per axis of the map itself there. A particle then counts by the probability that the map is off by less than the
    rest of the limit: a lower bound for the sum of both errors.
    """
    here = cloud.weight * (np.abs(cloud.z_m - z_m) < HALF_STOREY_M)
    near, about = (dot(here, _within(limit - _away_m(cloud, at), map_sd_m)) for limit in (TRACKING_M, LOST_M))
    return near, about


def _within(left_m: Floats, sd_m: float) -> Floats:
    """Probability (n,) that a place in two dimensions is off by less than `left_m`."""
    certain = np.asarray(left_m > 0.0, np.float64)
    return certain if sd_m <= 0.0 else certain * (1.0 - exp(-0.5 * (left_m / sd_m) ** 2))


# The tracked cloud and its rivals, each with the probability that the trunk is in it
Mixture = Sequence[tuple[Particles, float]]


def estimate_of(
    mixture: Mixture, t_s: float, walk_heading_rad: float, step: int, sd_m: float = 0.0, map_sd_m: float = 0.0,
    elsewhere: Moments | None = None, height: tuple[float, float] | None = None, plan_fits: float = 1.0, outside: float = 0.0,
    on_level: float = 1.0,
) -> Estimate:  # fmt: skip
    """Weighted moments of the tracked cloud [Girard 2011, eq. 2 for the mean], and how likely small errors are by all clouds.

    The mean of a cloud with several likely places may lie in none of them: the position is then the likeliest place, if it has more than
    half of the weight, and MUCH_LIKELIER times the weight near the mean. A place with more than SURE of the belief is alone: all else is elsewhere.
    The 95 % ellipse of the covariance is the region of 95 % of the belief, as long as one place has more; below that, the covariance is that of the
    mixture with `elsewhere`, where the trunk is if all clouds are wrong, about the position. `sd_m`: standard deviation per axis to add. `map_sd_m`:
    of the map itself there, as a drawing states it; it is part of `sd_m`, and makes small errors less likely. `height`: mean and standard deviation
    (m), if not the cloud's. `on_level`: probability that the plan has the trunk's level.
    """
    (cloud, right), *rivals = mixture
    weight, shares = cloud.weight, np.array([probability for _, probability in mixture])
    shares = shares / shares.sum() if shares.any() else np.full(len(mixture), 1.0 / len(mixture))
    levels = tuple((on_level * product(shares, np.array([each.level_shares for each, _ in mixture]))).tolist())
    z = dot(weight, cloud.z_m)
    height = height or (z, math.sqrt(dot(weight, (cloud.z_m - z) ** 2)))
    m = region = moments(cloud, weight, walk_heading_rad)
    places: tuple[LikelyPlace, ...] = ()
    if rivals or m.xx_m2 + m.yy_m2 > SPREAD_M**2 or max(levels) < BELIEVED or right <= SURE:
        places = _places(mixture, walk_heading_rad)
    share = 1.0
    if not rivals and places and places[0].probability > PROBABLE * right:
        m, region, share = _at_likeliest(places[0], m, cloud, walk_heading_rad, right)
    x, y, xx, xy, yy, east, north = m
    spread = math.sqrt(-2.0 * math.log(min(max(math.hypot(east, north), EVEN), 1.0)))
    away_m = _away_m(cloud, m)
    near, about = (right * dot(weight, _within(limit - away_m, map_sd_m)) for limit in (TRACKING_M, LOST_M))
    for each, probability in rivals:
        beside = weight_about(each, m, z, map_sd_m)
        near, about = near + probability * beside[0], about + probability * beside[1]
        right = min(right + probability * beside[0], 1.0)
    status = _status(near, about, max(levels))
    protection_m = _protection_m(xx + sd_m**2, xy, yy + sd_m**2, right * max(levels))
    right *= share
    if region is not m or (places and places[0].probability > SURE):
        places = ()
    xx, xy, yy = region.xx_m2 + sd_m**2, region.xy_m2, region.yy_m2 + sd_m**2
    if right > SURE:
        xx, xy, yy = (value * math.log(1.0 - SURE / right) / math.log(1.0 - SURE) for value in (xx, xy, yy))
    elif elsewhere is not None:
        away = _about(elsewhere, m, (0.0, 0.0))[2:5]
        xx, xy, yy = (right * here + (1.0 - right) * there for here, there in zip((xx, xy, yy), away, strict=True))
    return Estimate(
        t_s, x, y, xx, xy, yy, math.atan2(north, east), spread, step, status, levels.index(max(levels)), levels, *height,
        protection_m, right, places, plan_fits, outside,
    )  # fmt: skip


def _places(mixture: Mixture, walk_heading_rad: float) -> tuple[LikelyPlace, ...]:
    """The likely places of the trunk."""
    each = [
        (cloud.map_x_m, cloud.y_m, cloud.level, cloud.turn_rad + walk_heading_rad, probability * cloud.weight)
        for cloud, probability in mixture
    ]
    return hypotheses(*map(np.concatenate, zip(*each, strict=True)))


def _at_likeliest(
    place: LikelyPlace, mean: Moments, cloud: Particles, walk_heading_rad: float, right: float
) -> tuple[Moments, Moments, float]:
    """Moments of a cloud about its likeliest place, those of the place's region, and its share of the cloud.

    A place that is alone is all within LOST_M of it; of others the region is the whole cloud. The moments about the mean, and those, if half as
    much weight is near the mean.
    """
    inside = cloud.weight * ((cloud.level == place.level) & (_away_m(cloud, place) < LOST_M))
    share = float(inside.sum())
    if right * share > SURE:
        region = moments(cloud, inside / share, walk_heading_rad)
        return _about(mean, region, (region.east, region.north)), region, share
    near, near_mean = (dot(cloud.weight, _away_m(cloud, at) < TRACKING_M) for at in (place, mean))
    if near < MUCH_LIKELIER * near_mean:
        return mean, mean, 1.0
    length = math.hypot(mean.east, mean.north)
    whole = _about(mean, place, (length * math.cos(place.heading_rad), length * math.sin(place.heading_rad)))
    return whole, whole, 1.0


def _away_m(cloud: Particles, at: LikelyPlace | Moments | Pose) -> Floats:
    """Distance (n,) of the particles from a place."""
    return np.asarray(np.hypot(cloud.map_x_m - at.x_m, cloud.y_m - at.y_m))


def _about(mean: Moments, at: LikelyPlace | Moments, heading: tuple[float, float]) -> Moments:
    """The moments about another place than the mean, with a mean unit vector."""
    dx, dy = mean.x_m - at.x_m, mean.y_m - at.y_m
    return Moments(at.x_m, at.y_m, mean.xx_m2 + dx * dx, mean.xy_m2 + dx * dy, mean.yy_m2 + dy * dy, *heading)


def _status(near: float, about: float, level: float) -> TrackStatus:
    """Status from the probabilities of errors below TRACKING_M and below LOST_M, and of the likeliest level."""
    if near >= SURE and level >= BELIEVED:
        return TrackStatus.TRACKING
    return TrackStatus.UNCERTAIN if about >= PROBABLE else TrackStatus.LOST


def _protection_m(xx_m2: float, xy_m2: float, yy_m2: float, right: float) -> float:
    """Radius beyond which the error is with probability RISK: of a normal distribution along its longer axis.

    `right`: probability of the place and its level; being wrong takes part of the risk.
    """
    rest = RISK - (1.0 - right)
    if rest <= 0.0:
        return math.inf
    return TAIL * ellipse95(xx_m2, xy_m2, yy_m2).major_m * math.sqrt(-2.0 * math.log(rest) / CHI2_95)
