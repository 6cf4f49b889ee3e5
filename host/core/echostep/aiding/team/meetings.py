# SPDX-License-Identifier: MIT
"""The update of a filter's clouds by meetings with other wearers.

In: a cloud with its probability, a `Meeting`. Out: the same cloud, reweighted, and how well the meeting fits it. Owns the model.

The cloud is at the beginning of a segment, the meeting happened during it, up to a stride later: `on_the_way` gives it the displacement until
then, and each particle is reweighted at its place displaced by it.

If the meeting is right, the wearer is next to the teammate: the offset is N(0, SIDE_SD_M^2) per axis after a tap, and a radio range is N(distance,
range_sd_m^2); the teammate's own covariance is added to both. With probability `wrong` (another name was tapped, the teammate is sure of a wrong
place, the range is a reflection) the meeting carries no information: the teammate is then uniformly distributed over the floor.

The teammate's errors may be this wearer's own: both use one plan, and positions may have gone round the team in earlier meetings. The correlation is
not known, so the two are fused by covariance intersection [Julier and Uhlmann 1997, A Non-divergent Estimation Algorithm in the Presence of Unknown
Correlations], which is consistent for any: the inverse covariance becomes omega A + (1 - omega) B, A of the cloud, B of the meeting. Particles carry
the prior already, so their weights are multiplied by (meeting / prior)^(1 - omega), the prior taken as a normal distribution. omega minimises the
determinant; a cloud with more information than the meeting in every direction has omega = 1 and stays bit-identical. A coarse cloud, which is spread
over the building, has no information that could be the teammate's: there the meeting is a likelihood, and the cloud is reweighted even if it fits
badly.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.aiding.team.meeting import RANGE_BODY_SD_M, WRONG, Meeting, covariance
from echostep.arrays import Bools, Floats
from echostep.elementary import cos, determinant, dot, exp, inverse, log, product, sin, weighted_covariance
from echostep.localization.belief import CloudHypothesis
from echostep.localization.grid.search import Search
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.particles import Particles
from echostep.particles.limits import HALF_STOREY_M, PROBABLE

# Assumed, not measured.
MOST_DOUBT = math.log(WRONG["tracking"])  # of all ranges of one teammate: then this teammate is wrong
LEAST_WRONG = 1e-6  # probability that a range is wrong, at least, in a ratio
LEAST_SD_OF_CLOUD_M = 0.02  # of a cloud without spread
FARTHEST = -4.6  # log of the prior, relative to its peak, at which 99 % of a normal distribution lie inside: a far mode is not part of its tail
LEAST_FACTOR = -200.0  # log of the least weight that a meeting leaves


def log_density(meeting: Meeting, place: Floats, on_level: Bools, levels: int) -> Floats:
    """Log of the density (n,) of a right meeting for a wearer at `place` (n, 2): per m2 after a tap, per metre by radio."""
    away, spread = place - [meeting.x_m, meeting.y_m], covariance(meeting)
    other = (1.0 - meeting.level_probability) / max(levels - 1, 1)
    log_level = log(np.maximum(np.where(on_level, meeting.level_probability, other), 1e-12))
    if meeting.range_m is None:
        square = np.einsum("ni,ij,nj->n", away, inverse(spread), away)
        log_normal = -0.5 * square - math.log(2.0 * math.pi) - 0.5 * math.log(determinant(spread))
    else:
        distance = np.hypot(away[:, 0], away[:, 1])
        variance = _range_variance(meeting, away, spread)
        log_normal = -0.5 * (meeting.range_m - distance) ** 2 / variance - 0.5 * log(2.0 * math.pi * variance)
    return log_normal + log_level


def information(meeting: Meeting, mean: Floats) -> Floats:
    """Inverse covariance (2, 2) of the wearer's place by the meeting; for a radio range only along the line from the teammate to `mean` (2,)."""
    spread = covariance(meeting)
    if meeting.range_m is None:
        return inverse(spread)
    away = (mean - [meeting.x_m, meeting.y_m])[None]
    along = _along(away)[0]
    return np.outer(along, along) / _range_variance(meeting, away, spread)[0]


def best_omega(own: Floats, other: Floats) -> float:
    """The weight omega of the cloud's information (2, 2) that minimises the fused determinant: det(omega A + (1 - omega) B) is a parabola."""
    a, b = determinant(own), determinant(other)
    c = float(own[0, 0] * other[1, 1] + own[1, 1] * other[0, 0] - own[0, 1] * other[1, 0] - own[1, 0] * other[0, 1])
    curvature = a - c + b
    if curvature >= 0.0:
        return 1.0 if a >= b else 0.0
    return min(max((2.0 * b - c) / (2.0 * curvature), 0.0), 1.0)


def places_at(cloud: Particles, meeting: Meeting) -> Floats:
    """Places (n, 2) of the particles at the meeting, map frame."""
    c, s = cos(cloud.turn_rad), sin(cloud.turn_rad)
    x, y = meeting.way_x_m, meeting.way_y_m
    way = cloud.scale[:, None] * np.column_stack([c * x - s * y, s * x + c * y])
    return np.column_stack([cloud.map_x_m, cloud.y_m]) + way


def weigh(cloud: Cloud | Search, meeting: Meeting, area_m2: float) -> float:
    """Reweight a cloud by a meeting on a floor of this area; returns the probability that the meeting is right, given the cloud."""
    particles = cloud.states
    place = places_at(particles, meeting)
    if cloud.sheet is None:
        on_level, levels = np.full(len(place), meeting.level == 0), 1
    else:
        heights = cloud.sheet.height_m
        on_level, levels = np.abs(particles.z_m - heights[meeting.level]) < HALF_STOREY_M, len(heights)
    log_met, weight = log_density(meeting, place, on_level, levels), particles.weight
    wrong = WRONG[meeting.status]
    anywhere = 1.0 / (area_m2 if meeting.range_m is None else math.sqrt(area_m2))
    density = (1.0 - wrong) * dot(weight, exp(log_met))
    right = density / (density + wrong * anywhere)
    factor = log_met if cloud.is_searching else None
    if right >= PROBABLE and not cloud.is_searching:
        factor = _intersection(meeting, place, weight, log_met)
    if factor is not None:  # a cloud that is concentrated elsewhere is not changed
        factor = meeting.share * factor
        factor -= factor.max()
        factor -= math.log(dot(weight, exp(factor)))
        # Right or wrong, in these shares: a mixture of the reweighted cloud and the old one.
        cloud.reweight(log(np.maximum(right * exp(factor) + 1.0 - right, math.exp(LEAST_FACTOR))))
    return right


def _intersection(meeting: Meeting, place: Floats, weight: Floats, log_met: Floats) -> Floats | None:
    """Log-factors (n,) of covariance intersection for particles at `place` (n, 2); None where the cloud has more information in every direction."""
    mean = product(weight, place)
    spread = weighted_covariance(place, weight) + LEAST_SD_OF_CLOUD_M**2 * np.eye(2)
    own = inverse(spread)
    omega = best_omega(own, information(meeting, mean))
    if omega >= 1.0:
        return None
    away = place - mean
    log_prior = np.maximum(-0.5 * np.einsum("ni,ij,nj->n", away, own, away), FARTHEST)
    return (1.0 - omega) * (log_met - log_prior)


def _along(away: Floats) -> Floats:
    """Unit vectors (n, 2); east without a direction."""
    distance = np.hypot(away[:, 0], away[:, 1])[:, None]
    return np.where(distance > 0.0, away / np.maximum(distance, 1e-9), [1.0, 0.0])


def _range_variance(meeting: Meeting, away: Floats, spread: Floats) -> Floats:
    """Variance (n,) of a radio range, with the teammate's own along the line to each place."""
    along = _along(away)
    return np.einsum("ni,ij,nj->n", along, spread, along) + meeting.range_sd_m**2 + RANGE_BODY_SD_M**2


def weigh_by(each: CloudHypothesis, meeting: Meeting, area_m2: float) -> float:
    """Weigh a cloud by a meeting, or by a range to a teammate's beacon; returns the probability that it is right, given the cloud.

    A range that the cloud explains worse than chance casts doubt on it; one that it explains takes such doubt back, and gives nothing else.
    """
    right = weigh(each.cloud, meeting, area_m2)
    if meeting.beacon is not None and not each.cloud.is_searching:
        before = each.doubts.get(meeting.name, 0.0)
        after = before + meeting.share * math.log(WRONG[meeting.status] / max(1.0 - right, LEAST_WRONG))
        each.doubts[meeting.name] = min(max(after, MOST_DOUBT), 0.0)
        each.log_weight += each.doubts[meeting.name] - before
    return right
