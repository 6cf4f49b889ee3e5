# SPDX-License-Identifier: MIT
"""Whether the walls of a building have two directions at right angles, and the heading's error if so.

In: nodes and fragments. Out: `Directions`. Owns the filter. A fragment has a direction of the building, or any: the filter of one state, the error
of the heading, weighs each by the probability of the former (probabilistic data association [Bar-Shalom 1975]). The evidence is the likelihood of
all directions by this mixture against that of any.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.mapping.fragments import Fragments
from echostep.mapping.nodes import Nodes

RIGHT_RAD = 0.5 * math.pi
FIRST_SD_RAD = math.radians(2.0)  # of the first heading against the first direction
ALIGNED = 0.7  # share of fragments along the building's directions, at first; by reason
FIRST_M = 25.0  # of path, from which the first direction is taken
DIRECTION_SD_RAD = math.radians(0.7)  # of a wall from the building's direction [by reason: 6 cm on 5 m]
LEAST_EVIDENCE = math.log(1000.0)  # odds from which the building is thought to have such directions


@dataclass(frozen=True, slots=True)
class Directions:
    """`base_rad`: one of the directions; `drift_rad` (n,): error of the heading at each node; `aligned` (f,): probability of each fragment to
    have one of them; `evidence`: logarithm of the odds that the building has them.
    """

    base_rad: float
    drift_rad: Floats
    aligned: Floats
    evidence: float


def find_directions(nodes: Nodes, fragments: Fragments) -> Directions:
    """The filter over all fragments in order of the path, and back from its end; the mean of both by their variances."""
    angle = nodes.pose[fragments.node, 2] + fragments.normal_rad
    base = _first_direction(nodes, fragments, angle)
    order = np.argsort(fragments.node, kind="stable")
    seen = Seen(fragments.node[order], angle[order], fragments.sd_rad[order])
    ahead = _filtered(seen, nodes.turn_sd_rad, base, FIRST_SD_RAD**2)
    reverse = Seen(len(nodes) - 1 - seen.node[::-1], seen.angle_rad[::-1] + ahead.drift_rad[-1], seen.sd_rad[::-1])
    back = _filtered(reverse, nodes.turn_sd_rad[::-1], base, ahead.variance[-1])
    share = back.variance[::-1] / (ahead.variance + back.variance[::-1])
    drift = share * ahead.drift_rad + (1.0 - share) * (back.drift_rad[::-1] + ahead.drift_rad[-1])
    aligned = np.empty(len(order))
    aligned[order] = np.minimum(ahead.aligned, back.aligned[::-1])
    return Directions(base, drift, aligned, ahead.evidence)


class Seen(NamedTuple):
    """Fragments (f,) in order of their nodes: node, direction of the normal by odometry, its standard deviation."""

    node: Ints
    angle_rad: Floats
    sd_rad: Floats


class Filtered(NamedTuple):
    """`drift_rad`, `variance` (n,) after each node; `aligned` (f,); `evidence` of all fragments together."""

    drift_rad: Floats
    variance: Floats
    aligned: Floats
    evidence: float


@kernel
def _filtered(seen: Seen, turn_sd_rad: Floats, base_rad: float, first_variance: float) -> Filtered:
    """The filter along the nodes; `turn_sd_rad` (n - 1,): growth of the heading's error from each to the next."""
    count = len(turn_sd_rad) + 1
    drifts, variances, aligned = np.zeros(count), np.zeros(count), np.zeros(len(seen.node))
    drift, variance, evidence, f = 0.0, first_variance, 0.0, 0
    for node in range(count):
        if node:
            variance += turn_sd_rad[node - 1] ** 2
        while f < len(seen.node) and seen.node[f] == node:
            r = right_angles_off(seen.angle_rad[f] + drift - base_rad)
            total = variance + seen.sd_rad[f] ** 2 + DIRECTION_SD_RAD**2
            fits = ALIGNED * math.exp(-0.5 * r * r / total) / math.sqrt(2.0 * math.pi * total)
            either = fits + (1.0 - ALIGNED) / RIGHT_RAD
            p, gain = fits / either, variance / total
            aligned[f] = p
            evidence += math.log(either * RIGHT_RAD)
            drift -= p * gain * r
            variance += p * (1.0 - p) * (gain * r) ** 2 - p * gain * variance
            f += 1
        drifts[node], variances[node] = drift, variance
    return Filtered(drifts, variances, aligned, evidence)


@kernel
def right_angles_off(angle_rad: float) -> float:
    """The angle less the nearest multiple of a right angle."""
    return (angle_rad + 0.5 * RIGHT_RAD) % RIGHT_RAD - 0.5 * RIGHT_RAD


def _first_direction(nodes: Nodes, fragments: Fragments, angle: Floats) -> float:
    """The direction that most of the first fragments have, by length, of a kernel density over the right angle."""
    first = nodes.way_m[fragments.node] <= FIRST_M
    if not first.any():
        return 0.0
    tried = np.arange(0.0, RIGHT_RAD, math.radians(0.5))
    off = (angle[first][:, None] - tried + 0.5 * RIGHT_RAD) % RIGHT_RAD - 0.5 * RIGHT_RAD
    sd = np.hypot(fragments.sd_rad[first], math.radians(2.0))[:, None]
    weight = (fragments.half_m[first][:, None] * np.exp(-0.5 * (off / sd) ** 2)).sum(0)
    return float(tried[int(np.argmax(weight))])
