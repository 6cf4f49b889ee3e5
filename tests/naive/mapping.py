# SPDX-License-Identifier: MIT
"""Slow, obviously right twins of the mapping kernels: one fragment, one ping, one shift at a time.

In: the same arrays as the kernels. Out: what they should say. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep_app.mapping.graph import matching
from echostep_app.mapping.graph.matching import Pieces
from echostep_app.mapping.walls import evidence
from echostep_app.mapping.walls.lines import Lines


def match(new: Pieces, old: Pieces, pivot: Floats, shifts_m: Floats, turns_rad: Floats) -> Floats:
    """The log-ratio at every turn and shift, from the definition of its module."""
    score = np.zeros((len(turns_rad), len(shifts_m), len(shifts_m)))
    for (k, a, b), _ in np.ndenumerate(score):
        turn, shift = turns_rad[k], np.array([shifts_m[a], shifts_m[b]])
        rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
        for i in range(len(new.x_m)):
            at = pivot + rotation @ (np.array([new.x_m[i], new.y_m[i]]) - pivot) + shift
            said = [_said(at, new.normal_rad[i] + turn, new, i, old, j) for j in range(len(old.x_m))]
            fits, free = max([0.0, *(s[0] for s in said)]), min([0.0, *(s[1] for s in said)])
            score[k, a, b] += matching.POWER * min(2.0 * new.half_m[i], 2.0) * (fits or free)
    return score


def _said(at: Floats, normal_rad: float, new: Pieces, i: int, old: Pieces, j: int) -> tuple[float, float]:
    """What the older fragment j says: log-ratio if it explains, log-ratio if it contradicts."""
    n = np.array([math.cos(old.normal_rad[j]), math.sin(old.normal_rad[j])])
    off, along = n @ (at - [old.x_m[j], old.y_m[j]]), np.array([-n[1], n[0]]) @ (at - [old.x_m[j], old.y_m[j]])
    turned = math.remainder(normal_rad - old.normal_rad[j], 2.0 * math.pi)
    half = new.half_m[i] * abs(math.cos(turned))
    common = min(along + half, old.half_m[j]) - max(along - half, -old.half_m[j])
    if common <= 0.0:
        return 0.0, 0.0
    shared = min(common / max(2.0 * half, matching.LEAST_HALF_M), 1.0)
    ratio = 0.0
    if abs(turned) < matching.CHANCE_RAD and abs(off) < matching.CHANCE_M:
        sd = math.sqrt(matching.OFF_SD_RAD**2 + new.sd_rad[i] ** 2 + old.sd_rad[j] ** 2)
        by_angle = _normal(turned, sd) / (0.5 / matching.CHANCE_RAD)
        ratio = _normal(off, matching.OFF_SD_M) / (0.5 / matching.CHANCE_M) * by_angle
    fits = shared * math.log(matching.OUTLIER + (1.0 - matching.OUTLIER) * ratio)
    is_free = -old.range_m[j] + matching.FREE_M < off < -matching.FREE_M
    return fits, shared * matching.FREE_RATIO if is_free else 0.0


def _normal(x: float, sd: float) -> float:
    return math.exp(-0.5 * (x / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi))


def cell_counts(
    lines: Lines, poses: Floats, range_m: Floats
) -> tuple[dict[tuple[int, int], int], dict[tuple[int, int], int]]:
    """Pings that each (line, cell) explains, and pings that passed it."""
    heard: dict[tuple[int, int], int] = {}
    passed: dict[tuple[int, int], int] = {}
    for (x, y, axis), z in zip(poses, range_m, strict=True):
        explained = False
        for line in range(len(lines.rho_m)):
            n = np.array([math.cos(lines.normal_rad[line]), math.sin(lines.normal_rad[line])])
            signed = lines.rho_m[line] - n @ (x, y)
            foot = np.array([x, y]) + signed * n
            direction = math.atan2(foot[1] - y, foot[0] - x)
            off_axis = abs(math.remainder(direction - axis, 2.0 * math.pi))
            along = float(foot @ (-n[1], n[0]))
            low, high = lines.low_m[line], lines.high_m[line]
            cell = (line, math.floor((along - (low - evidence.MARGIN_M)) / evidence.CELL_M))
            inside = 0 <= cell[1] < math.ceil((high - low + 2.0 * evidence.MARGIN_M) / evidence.CELL_M)
            if off_axis > evidence.HALF_CONE_RAD or not inside:
                continue
            if abs(z - abs(signed)) < evidence.FITS_M:
                if not explained and low - evidence.BEYOND_M < along < high + evidence.BEYOND_M:
                    heard[cell], explained = heard.get(cell, 0) + 1, True
            elif (
                off_axis < evidence.SURE_RAD
                and abs(signed) < evidence.SURE_M
                and not z < abs(signed) + evidence.BEYOND_M
            ):
                passed[cell] = passed.get(cell, 0) + 1
    return heard, passed
