# SPDX-License-Identifier: MIT
"""Whether the walls of a building have two directions at right angles, and the heading's error if so.

In: nodes and fragments. Out: `Directions`. Owns the filter. A fragment has a direction of the building, or any; or its echoes are of a person, and
it has the path's direction. The one state is the direction of the building against the heading by odometry, modulo a right angle: at first it may be
any, then it diffuses as the heading drifts. Its distribution is kept on a circle of cells, forward and backward along the path [Rabiner 1989], so
that a few walls askew at the beginning do not decide. The evidence is the likelihood of all fragments against walls of any direction.
Shelves, niches and machines stand before walls, so what seems one straight piece is several. A piece's residuals are in its own standard deviations
already; echoes come from the parts that stand out, so only other pieces show the rest. The relief is the one by which the directions of all
fragments are most probable.
Echoes of people beside the wearer, at the same pace, resemble a piece of wall along the path, whichever way that leads: on a way that is walked
again and again across a hall, these pieces agree with each other like a wall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.jit import kernel, part
from echostep_app.mapping.graph.fragments import SLOPE, Fragments
from echostep_app.mapping.graph.nodes import Nodes

PEOPLE = 0.05  # share of the path with echoes of a person beside a ranger, assumed
MOST_PEOPLE = 0.8  # of the echoes in the barest hall: there are columns too
ALONG_SD_RAD = math.radians(5.0)  # of such a fragment's direction from the path's direction, assumed
COUNTED_M = 10.0  # of path to either side of a fragment, over which echoes are counted
LEAST_HALF_M = 0.3  # least path to either side of a fragment's middle over which its direction is taken


def people_share(nodes: Nodes, fragments: Fragments) -> Floats:
    """Prior probability (f,) that a fragment's echoes are of a person: people's echoes come on the same share of any path, walls' do not."""
    way_m = nodes.way_m[fragments.node]
    order = np.argsort(way_m, kind="stable")
    heard_m = np.concatenate([[0.0], np.cumsum(2.0 * fragments.half_m[order])])
    low, high = (np.searchsorted(way_m[order], way_m + side * COUNTED_M) for side in (-1.0, 1.0))
    path_m = np.minimum(way_m + COUNTED_M, nodes.way_m[-1]) - np.maximum(way_m - COUNTED_M, 0.0)
    share: Floats = np.minimum(PEOPLE * 2.0 * path_m / (heard_m[high] - heard_m[low]), MOST_PEOPLE)
    return share


def density_along_path(nodes: Nodes, fragments: Fragments) -> Floats:
    """Density (f,) of each fragment's direction, per radian, if its echoes are of a person: about the path's direction beside it."""
    half_m = np.maximum(fragments.half_m, LEAST_HALF_M)
    course = course_of(nodes.pose, nodes.way_m, nodes.way_m[fragments.node], half_m)  # from its beginning to its end
    off = (nodes.pose[fragments.node, 2] + fragments.normal_rad - course) % math.pi - 0.5 * math.pi
    sd = np.hypot(fragments.sd_rad, ALONG_SD_RAD)
    density: Floats = np.exp(-0.5 * (off / sd) ** 2) / (math.sqrt(2.0 * math.pi) * sd)
    return density


def course_of(pose: Floats, way_m: Floats, middle_m: Floats, half_m: Floats | float = LEAST_HALF_M) -> Floats:
    """Direction (k,) of a path (n, 3), whose length so far is `way_m` (n,), over `half_m` to either side of each place `middle_m` (k,) along it."""
    dx, dy = (
        np.interp(middle_m + half_m, way_m, pose[:, k]) - np.interp(middle_m - half_m, way_m, pose[:, k])
        for k in (0, 1)
    )
    course: Floats = np.arctan2(dy, dx)
    return course


RIGHT_RAD = 0.5 * math.pi
ALIGNED = 0.7  # share of fragments along the building's directions, at first, assumed
DIRECTION_SD_RAD = math.radians(0.7)  # of a wall from the building's direction (6 cm on 5 m)
LEAST_EVIDENCE = math.log(1000.0)  # odds from which the building is thought to have such directions
CELLS = 180  # of a right angle, half a degree each: less than DIRECTION_SD_RAD
CELL_RAD = RIGHT_RAD / CELLS


@dataclass(frozen=True, slots=True)
class Directions:
    """`base_rad`: one of the directions; `drift_rad` (n,): turn of the heading at each node that aligns walls with them; `evidence`: logarithm of the
    odds that the building has them.
    """

    base_rad: float
    drift_rad: Floats
    evidence: float


def find_directions(nodes: Nodes, fragments: Fragments) -> Directions:
    """The mean direction at each fragment, given all of them; between two of them as the mean of a random walk."""
    if not len(fragments.node):
        return Directions(0.0, np.zeros(len(nodes)), 0.0)
    order = np.argsort(fragments.node, kind="stable")
    node = fragments.node[order]
    angle = nodes.pose[node, 2] + fragments.normal_rad[order]
    variance = np.concatenate([[0.0], np.cumsum(nodes.turn_sd_rad**2)])
    person = people_share(nodes, fragments)
    along_path = density_along_path(nodes, fragments)
    seen = Seen(
        angle,
        fragments.sd_rad[order],
        np.diff(variance[node], prepend=variance[node[0]]),
        person[order],
        along_path[order],
    )
    smoothed, evidence = _smoothed(seen)
    direction = np.unwrap(smoothed, period=RIGHT_RAD)
    base = float(direction[0])
    drift = base - np.interp(variance, variance[node], direction)
    return Directions(base, drift, evidence)


class Seen(NamedTuple):
    """Fragments (f,) in order of their nodes: direction of the normal by odometry, its standard deviation, growth of the heading's variance since
    the one before; probability that its echoes are of a person, and the density of its direction if so.
    """

    angle_rad: Floats
    sd_rad: Floats
    variance: Floats
    person: Floats
    along_path: Floats


@kernel
def _smoothed(seen: Seen) -> tuple[Floats, float]:
    """Forward and backward over the fragments: the mean direction (f,) of the building by odometry, modulo a right angle, at each; the evidence."""
    count = len(seen.angle_rad)
    forward, likely = np.zeros((count, CELLS)), np.zeros((count, CELLS))
    belief, evidence = np.full(CELLS, 1.0 / CELLS), 0.0
    for f in range(count):
        _diffuse(belief, seen.variance[f])
        person = seen.person[f]
        for cell in range(CELLS):
            still = _likelihood(seen.angle_rad[f] - cell * CELL_RAD, seen.sd_rad[f])
            likely[f, cell] = person * seen.along_path[f] + (1.0 - person) * still
        belief *= likely[f]
        total = belief.sum()
        belief /= total
        evidence += math.log(total / (person * seen.along_path[f] + (1.0 - person) / RIGHT_RAD))
        forward[f] = belief
    direction, back = np.zeros(count), np.ones(CELLS)
    for f in range(count - 1, -1, -1):
        x, y = 0.0, 0.0
        for cell in range(CELLS):
            p = forward[f, cell] * back[cell]
            x += p * math.cos(4.0 * cell * CELL_RAD)
            y += p * math.sin(4.0 * cell * CELL_RAD)
        direction[f] = 0.25 * math.atan2(y, x)
        back *= likely[f]
        back /= back.sum()
        _diffuse(back, seen.variance[f])
    return direction, evidence


@part
def _likelihood(off_rad: float, sd_rad: float) -> float:
    """Density of a fragment's direction at `off_rad` from one of the building's: along it, or any."""
    r = right_angles_off(off_rad)
    variance = sd_rad * sd_rad + DIRECTION_SD_RAD**2
    return (
        ALIGNED * math.exp(-0.5 * r * r / variance) / math.sqrt(2.0 * math.pi * variance) + (1.0 - ALIGNED) / RIGHT_RAD
    )


@part
def _diffuse(belief: Floats, variance: float) -> None:
    """Spread a distribution on the circle (CELLS,) by this variance: steps to the two neighbours, which keep it exactly."""
    steps = math.ceil(variance / (0.5 * CELL_RAD**2))
    share = 0.5 * variance / (max(steps, 1) * CELL_RAD**2)
    for _ in range(min(steps, CELLS * CELLS)):
        first, before = belief[0], belief[CELLS - 1]
        for cell in range(CELLS):
            here, after = belief[cell], belief[cell + 1] if cell + 1 < CELLS else first
            belief[cell] = here + share * (before + after - 2.0 * here)
            before = here


@kernel
def right_angles_off(angle_rad: float) -> float:
    """The angle less the nearest multiple of a right angle."""
    return (angle_rad + 0.5 * RIGHT_RAD) % RIGHT_RAD - 0.5 * RIGHT_RAD


# Standard deviation of the surface along a piece, beyond its residuals. In three real buildings, by laser: 0.01 to 0.10 m in all
RELIEFS_M = (0.01, 0.02, 0.03, 0.045, 0.065)


def find_relief(nodes: Nodes, fragments: Fragments) -> tuple[Fragments, Directions]:
    """The walls are flat unless another relief has the odds that two directions of the building need."""
    flat = best = fragments, find_directions(nodes, fragments)
    for relief_m in RELIEFS_M:
        tried = with_relief(fragments, relief_m)
        directions = find_directions(nodes, tried)
        if directions.evidence > max(best[1].evidence, flat[1].evidence + LEAST_EVIDENCE):
            best = tried, directions
    return best


def with_relief(fragments: Fragments, relief_m: float) -> Fragments:
    """The fragments of a surface with this standard deviation: it shifts a piece, and turns it the more the shorter it is."""
    turned_rad = SLOPE * relief_m / np.maximum(fragments.half_m, 0.5 * relief_m)
    return fragments._replace(
        sd_m=np.hypot(fragments.sd_m, relief_m), sd_rad=np.minimum(np.hypot(fragments.sd_rad, turned_rad), math.pi)
    )
