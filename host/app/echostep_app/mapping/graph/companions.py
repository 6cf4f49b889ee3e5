# SPDX-License-Identifier: MIT
"""Which fragments may be echoes of people beside the wearer, at the same pace.

In: nodes and fragments. Out: the prior probability of that for each fragment, and the density of its direction if so; the course of the path. Owns
the share of people. Such echoes resemble a piece of wall along the path, whichever way that leads: on a way that is walked again and again across a
hall, these pieces agree with each other like a wall.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep_app.mapping.graph.fragments import Fragments
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
    off = (nodes.pose[fragments.node, 2] + fragments.normal_rad - _course(nodes, fragments)) % math.pi - 0.5 * math.pi
    sd = np.hypot(fragments.sd_rad, ALONG_SD_RAD)
    density: Floats = np.exp(-0.5 * (off / sd) ** 2) / (math.sqrt(2.0 * math.pi) * sd)
    return density


def _course(nodes: Nodes, fragments: Fragments) -> Floats:
    """Direction (f,) of the path by odometry from the beginning of each fragment to its end."""
    half_m = np.maximum(fragments.half_m, LEAST_HALF_M)
    return course_of(nodes.pose, nodes.way_m, nodes.way_m[fragments.node], half_m)


def course_of(pose: Floats, way_m: Floats, middle_m: Floats, half_m: Floats | float = LEAST_HALF_M) -> Floats:
    """Direction (k,) of a path (n, 3), whose length so far is `way_m` (n,), over `half_m` to either side of each place `middle_m` (k,) along it."""
    dx, dy = (
        np.interp(middle_m + half_m, way_m, pose[:, k]) - np.interp(middle_m - half_m, way_m, pose[:, k])
        for k in (0, 1)
    )
    course: Floats = np.arctan2(dy, dx)
    return course
