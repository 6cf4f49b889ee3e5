# SPDX-License-Identifier: MIT
"""A turn that odometry adds to each metre of path, the same throughout the walk: unequal wheels, the bias of a gyroscope.

In: nodes and pings. Out: the bias by the directions of the building, nodes and pings without it. Owns the search. The stated drift is a random walk,
which does not model that all errors have one sign: in two logs of carmen the heading errs by 3.2 and 1.0 degrees a metre, and by 10 and 6 degrees
about that in all. A bias is believed where the walls have two directions at right angles with it and not without it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep_app.mapping.graph.directions import LEAST_EVIDENCE, find_directions
from echostep_app.mapping.graph.fragments import find_fragments
from echostep_app.mapping.graph.nodes import Nodes, Pings, rotated

STEP_M = 10.0  # of path: a step of the search turns it by half of the drift over it
# Scales of the steps, and, down to 1, of the drift: a bias is far from the walk's own drift, and only near it there is evidence
SCALES = (4.0, 2.0, 1.0, 0.5, 0.25)
MOST_STEPS = 12


def find_bias(nodes: Nodes, pings: Pings, known_rad_m: float = 0.0) -> float:
    """The turn (rad/m) to be added so that the walls have two directions; `known_rad_m` unless another has the odds LEAST_EVIDENCE."""
    way_m = float(nodes.way_m[-1])
    step = 0.5 * math.sqrt(float(np.sum(nodes.turn_sd_rad**2)) / max(way_m * STEP_M, 1.0))
    bias = known_rad_m
    for scale in SCALES:
        wider = replace(nodes, turn_sd_rad=max(scale, 1.0) * nodes.turn_sd_rad)
        candidate = _climbed(wider, pings, bias, scale * step)
        if candidate == known_rad_m:
            break  # as for a foot
        bias = candidate
    if bias == known_rad_m:
        return known_rad_m
    gain = _evidence(nodes, pings, bias) - _evidence(nodes, pings, known_rad_m)
    return bias if gain > LEAST_EVIDENCE else known_rad_m


def _climbed(nodes: Nodes, pings: Pings, begin_rad_m: float, step: float) -> float:
    """The bias from which another step gains no evidence, on the side where the first step gains some."""
    begin = _evidence(nodes, pings, begin_rad_m)
    for way in (-step, step):
        best_rad_m, best = begin_rad_m, begin
        for _ in range(MOST_STEPS):
            tried = _evidence(nodes, pings, best_rad_m + way)
            if tried <= best:
                break
            best_rad_m, best = best_rad_m + way, tried
        if best > begin:
            return best_rad_m
    return begin_rad_m


def _evidence(nodes: Nodes, pings: Pings, bias_rad_m: float) -> float:
    """Evidence that the walls have two directions, with this bias."""
    turned, turned_pings = without_bias(nodes, pings, bias_rad_m)
    return find_directions(turned, find_fragments(turned, turned_pings)).evidence


def without_bias(nodes: Nodes, pings: Pings, bias_rad_m: float) -> tuple[Nodes, Pings]:
    """Path and pings with this turn added to each metre."""
    if bias_rad_m == 0.0:
        return nodes, pings
    turn = bias_rad_m * nodes.way_m
    pose = nodes.pose.copy()
    pose[1:, :2] = pose[0, :2] + np.cumsum(rotated(np.diff(pose[:, :2], axis=0), 0.5 * (turn[1:] + turn[:-1])), axis=0)
    pose[:, 2] += turn
    after = np.minimum(pings.node + 1, len(turn) - 1)
    off = rotated(pings.at_m - nodes.pose[pings.node, :2], 0.5 * (turn[pings.node] + turn[after]))
    at = pose[pings.node, :2] + off
    axis = pings.axis_rad + turn[pings.node] + pings.share * (turn[after] - turn[pings.node])
    return replace(nodes, pose=pose), replace(pings, at_m=at, axis_rad=axis)
