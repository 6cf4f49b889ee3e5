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
from echostep.jit import inline_part, lean_kernel
from echostep.localization.estimate import TAIL, Estimate, TrackStatus
from echostep.localization.particles.particles import Particles
from echostep.localization.particles.places import LikelyPlace, hypotheses
from echostep.particles.ellipse import CHI2_95, ellipse95
from echostep.particles.limits import BELIEVED, HALF_STOREY_M, LOST_M, PROBABLE, RISK, SURE, TRACKING_M

# Times the weight near the mean of a cloud of several places, with which the likeliest of them is its position, assumed
MUCH_LIKELIER = 2.0
SPREAD_M = 0.75  # standard deviation of a cloud above which its hypotheses are listed, assumed


class Moments(NamedTuple):
    """Weighted mean (m), covariance (m2), mean unit vector of the headings, and weight within two distances of the mean."""

    x_m: float
    y_m: float
    xx_m2: float
    xy_m2: float
    yy_m2: float
    east: float
    north: float
    near: float
    about: float


@lean_kernel
def moments(x_m: Floats, y_m: Floats, heading_rad: Floats, weight: Floats, near_m: float, about_m: float) -> Moments:
    """Weighted moments of particles (n,) in the map."""
    x, y, east, north = 0.0, 0.0, 0.0, 0.0
    for i in range(len(weight)):
        w = weight[i]
        x += w * x_m[i]
        y += w * y_m[i]
        east += w * math.cos(heading_rad[i])
        north += w * math.sin(heading_rad[i])
    xx, xy, yy, near, about = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(len(weight)):
        w, dx, dy = weight[i], x_m[i] - x, y_m[i] - y
        square = dx * dx + dy * dy
        xx += w * dx * dx
        xy += w * dx * dy
        yy += w * dy * dy
        near += w if square < near_m * near_m else 0.0
        about += w if square < about_m * about_m else 0.0
    return Moments(x, y, xx, xy, yy, east, north, near, about)


@lean_kernel
def weight_about(
    x_m: Floats, y_m: Floats, z_m: Floats, weight: Floats, place_m: tuple[float, float, float], limit_m: tuple[float, float],
    map_sd_m: float = 0.0,
) -> tuple[float, float]:  # fmt: skip
    """Weight of the particles (n,) within each of two distances of a place in the map, and within HALF_STOREY_M of its height.

    `map_sd_m`: standard deviation per axis of the map itself there. A particle then counts by the probability that the map is off by less than the
    rest of the limit: a lower bound for the sum of both errors.
    """
    near, about = 0.0, 0.0
    for i in range(len(weight)):
        if abs(z_m[i] - place_m[2]) < HALF_STOREY_M:
            distance = math.hypot(x_m[i] - place_m[0], y_m[i] - place_m[1])
            near += weight[i] * _within(limit_m[0] - distance, map_sd_m)
            about += weight[i] * _within(limit_m[1] - distance, map_sd_m)
    return near, about


@inline_part
def _within(left_m: float, sd_m: float) -> float:
    """Probability that a place in two dimensions is off by less than `left_m`."""
    if left_m <= 0.0:
        return 0.0
    return 1.0 if sd_m <= 0.0 else 1.0 - math.exp(-0.5 * (left_m / sd_m) ** 2)


# The tracked cloud and its rivals, each with the probability that the trunk is in it
Mixture = Sequence[tuple[Particles, float]]


def estimate_of(
    mixture: Mixture, t_s: float, walk_heading_rad: float, step: int, sd_m: float = 0.0, map_sd_m: float = 0.0,
    elsewhere: Elsewhere | None = None, height: tuple[float, float] | None = None, plan_fits: float = 1.0, outside: float = 0.0,
) -> Estimate:  # fmt: skip
    """Weighted moments of the tracked cloud [Girard 2011, eq. 2 for the mean], and how likely small errors are by all clouds.

    The mean of a cloud with several likely places may lie in none of them: the position is then the likeliest place, if it has more than
    half of the weight, and MUCH_LIKELIER times the weight near the mean. A place with more than SURE of the belief is alone: all else is elsewhere.
    The 95 % ellipse of the covariance is the region of 95 % of the belief, as long as one place has more; below that, the covariance is that of the
    mixture with `elsewhere`, where the trunk is if all clouds are wrong, about the position. `sd_m`: standard deviation per axis to add. `map_sd_m`:
    of the map itself there, as a drawing states it; it is part of `sd_m`, and makes small errors less likely. `height`: mean and standard deviation
    (m), if not the cloud's.
    """
    (cloud, right), *rivals = mixture
    weight, shares = cloud.weight, _shares(mixture)
    levels = tuple((shares @ np.array([each.level_shares for each, _ in mixture])).tolist())
    z = float(weight @ cloud.z_m)
    height = height or (z, math.sqrt(float(weight @ (cloud.z_m - z) ** 2)))
    m = region = _moments(cloud, weight, walk_heading_rad)
    places: tuple[LikelyPlace, ...] = ()
    if rivals or m.xx_m2 + m.yy_m2 > SPREAD_M**2 or max(levels) < BELIEVED or right <= SURE:
        places = _places(mixture, walk_heading_rad)
    share = 1.0
    if not rivals and places and places[0].probability > PROBABLE * right:
        m, region, share = _at_likeliest(places[0], m, cloud, walk_heading_rad, right)
    x, y, xx, xy, yy, east, north, near, about = m
    spread = math.sqrt(max(-2.0 * math.log(min(math.hypot(east, north), 1.0)), 0.0))
    limits_m = (TRACKING_M, LOST_M)
    if map_sd_m > 0.0:
        near, about = weight_about(cloud.map_x_m, cloud.y_m, cloud.z_m, weight, (x, y, z), limits_m, map_sd_m)
    near, about = right * near, right * about
    for each, probability in rivals:
        beside = weight_about(each.map_x_m, each.y_m, each.z_m, each.weight, (x, y, z), limits_m, map_sd_m)
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
        xx, xy, yy = elsewhere.mixed((x, y), (xx, xy, yy), right)
    return Estimate(
        t_s, x, y, xx, xy, yy, math.atan2(north, east), spread, step, status, levels.index(max(levels)), levels, *height,
        protection_m, right, places, plan_fits, outside,
    )  # fmt: skip


def _shares(mixture: Mixture) -> Floats:
    """Probability (n,) of each cloud, if the trunk is in one of them."""
    probability = np.array([probability for _, probability in mixture])
    return probability / probability.sum() if probability.any() else np.full(len(mixture), 1.0 / len(mixture))


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
    distance_m = np.hypot(cloud.map_x_m - place.x_m, cloud.y_m - place.y_m)
    inside = cloud.weight * ((cloud.level == place.level) & (distance_m < LOST_M))
    share = float(inside.sum())
    if right * share > SURE:
        region = _moments(cloud, inside / share, walk_heading_rad)
        near, about, east, north = share * region.near, share * region.about, region.east, region.north
        return _about(mean, region.x_m, region.y_m, (east, north, near, about)), region, share
    near, about = (float(cloud.weight[distance_m < limit_m].sum()) for limit_m in (TRACKING_M, LOST_M))
    if near < MUCH_LIKELIER * mean.near:
        return mean, mean, 1.0
    length = math.hypot(mean.east, mean.north)
    east, north = length * math.cos(place.heading_rad), length * math.sin(place.heading_rad)
    whole = _about(mean, place.x_m, place.y_m, (east, north, near, about))
    return whole, whole, 1.0


def _about(mean: Moments, x_m: float, y_m: float, rest: tuple[float, float, float, float]) -> Moments:
    """The moments about another place than the mean, with the `rest`: mean unit vector and weights near there."""
    dx, dy = mean.x_m - x_m, mean.y_m - y_m
    return Moments(x_m, y_m, mean.xx_m2 + dx * dx, mean.xy_m2 + dx * dy, mean.yy_m2 + dy * dy, *rest)


def _moments(cloud: Particles, weight: Floats, walk_heading_rad: float) -> Moments:
    """Moments of a cloud with these weights (n,)."""
    return moments(cloud.map_x_m, cloud.y_m, cloud.turn_rad + walk_heading_rad, weight, TRACKING_M, LOST_M)


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


class Elsewhere(NamedTuple):
    """Mean (m) and covariance (m2) of the places in a building where the trunk may be if the cloud is wrong."""

    x_m: float
    y_m: float
    xx_m2: float
    xy_m2: float
    yy_m2: float

    def mixed(
        self, at_m: tuple[float, float], covariance_m2: tuple[float, float, float], right: float
    ) -> tuple[float, float, float]:
        """Second moments xx, xy, yy (m2) about `at_m` of the mixture of a cloud there and of these places."""
        dx, dy = self.x_m - at_m[0], self.y_m - at_m[1]
        away = (self.xx_m2 + dx * dx, self.xy_m2 + dx * dy, self.yy_m2 + dy * dy)
        xx, xy, yy = (right * c + (1.0 - right) * a for c, a in zip(covariance_m2, away, strict=True))
        return xx, xy, yy
