# SPDX-License-Identifier: MIT
"""Wall segments from occupied places: straight pieces first, in order of decreasing length, then the rest in small pieces.

In: places (n, 2). Out: segments (k, 4): x0, y0, x1, y1. Owns nothing. A straight piece is grown from a place whose neighbours lie on a line: the
places near that line without a gap are refitted by least squares, until they stay the same.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from echostep.arrays import Bools, Floats, Ints

# Assumed, all of them.
NEIGHBOURS_M = 0.35  # places so near tell the direction at a place
ASIDE_M = 0.07  # greatest distance of a place from its line
DOUBLE_M = 0.12  # places so near to an accepted line are not used again: a wall seen by scans that do not quite agree
GAP_M = 0.35  # greatest gap along a piece
SHORTEST_M = 0.3  # straight piece
FEWEST = 4  # places of a straight piece
ROUNDS = 4  # of fitting a line
CLUTTER_M = 0.25  # places so near to one another are one piece of clutter
LEAST_M = 0.1  # length of a piece of clutter, at least
JOIN_M = 0.3  # the end of a straight piece is moved so far at most, to where it meets another one
PARALLEL = 0.3  # sine of the angle below which two pieces do not meet


def wall_segments(places: Floats) -> Floats:
    """Segments (k, 4) through all places (n, 2)."""
    if len(places) < 2:
        return np.zeros((0, 4))
    tree, unused = cKDTree(places), np.ones(len(places), np.bool_)
    direction, straightness = _directions(places, tree)
    segments = []
    for seed in np.argsort(-straightness).tolist():
        if unused[seed]:
            piece = _grown(places, unused, seed, direction[seed])
            if piece is not None:
                segments.append(piece)
    straight = _joined(np.array(segments).reshape(-1, 4))
    return np.vstack([straight, *_clutter(places[unused])])


def straight_pieces(segments: Floats, least_m: float) -> Floats:
    """The segments (k, 4) of at least this length."""
    return segments[np.hypot(segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]) >= least_m]


def _directions(places: Floats, tree: cKDTree) -> tuple[Floats, Floats]:
    """Unit vectors (n, 2) along the neighbours of each place, and how far these extend along it rather than across (n,)."""
    direction, straightness = np.zeros((len(places), 2)), np.zeros(len(places))
    for k, near in enumerate(tree.query_ball_point(places, NEIGHBOURS_M)):
        direction[k], along, across = _line(places[near])
        straightness[k] = len(near) * (along - across)
    return direction, straightness


def _line(points: Floats) -> tuple[Floats, float, float]:
    """Direction of the line through points (n, 2) by least squares, and their variances along it and across."""
    away = points - points.mean(0)
    values, vectors = np.linalg.eigh(away.T @ away / len(points))
    return np.asarray(vectors[:, 1]), float(values[1]), float(values[0])


def _grown(places: Floats, unused: Bools, seed: int, direction: Floats) -> Floats | None:
    """The longest piece through a place in about this direction, whose places are used up by it; None where it is too short."""
    middle, members = places[seed], np.zeros(0, np.int64)
    for _ in range(ROUNDS):
        inliers = _run(places, unused, seed, middle, direction, ASIDE_M)
        if len(inliers) < FEWEST or np.array_equal(inliers, members):
            break
        members = inliers
        middle = places[members].mean(0)
        direction, _, _ = _line(places[members])
    if len(members) < FEWEST:
        return None
    along = (places[members] - middle) @ direction
    if np.ptp(along) < SHORTEST_M:
        return None
    unused[_run(places, unused, seed, middle, direction, DOUBLE_M)] = False
    unused[members] = False
    return np.concatenate([middle + along.min() * direction, middle + along.max() * direction])


def _run(places: Floats, unused: Bools, seed: int, middle: Floats, direction: Floats, aside_m: float) -> Ints:
    """Unused places near a line that follow one another without a gap, the seed among them; ascending numbers."""
    away = places - middle
    near = np.flatnonzero(unused & (np.abs(away[:, 0] * direction[1] - away[:, 1] * direction[0]) < aside_m))
    along = away[near] @ direction
    order = np.argsort(along)
    at = np.flatnonzero(near[order] == seed)
    if not len(at):
        return np.zeros(0, np.int64)
    breaks = np.flatnonzero(np.diff(along[order]) > GAP_M)
    first = breaks[breaks < at[0]].max(initial=-1) + 1
    beyond = breaks[breaks >= at[0]].min(initial=len(order) - 1) + 1
    return np.sort(near[order[first:beyond]])


def _clutter(places: Floats) -> list[Floats]:
    """A short segment along each group of places that are near to one another."""
    if not len(places):
        return []
    tree, left, pieces = cKDTree(places), set(range(len(places))), []
    while left:
        seed = min(left)
        group = sorted(left & set(tree.query_ball_point(places[seed], CLUTTER_M)))
        left -= set(group)
        middle = places[group].mean(0)
        direction, _, _ = _line(places[group]) if len(group) > 1 else (np.array([1.0, 0.0]), 0.0, 0.0)
        along = (places[group] - middle) @ direction
        half = max(0.5 * float(np.ptp(along)), 0.5 * LEAST_M)
        pieces.append(np.concatenate([middle - half * direction, middle + half * direction]))
    return pieces


def _joined(pieces: Floats) -> Floats:
    """The pieces (k, 4), each end moved to the nearest place within JOIN_M where its line meets another piece or the prolongation of one."""
    joined = pieces.copy()
    along = pieces[:, 2:] - pieces[:, :2]
    length = np.hypot(along[:, 0], along[:, 1])
    unit = along / length[:, None]
    for k in range(len(pieces)):
        sine = unit[k, 0] * unit[:, 1] - unit[k, 1] * unit[:, 0]
        away = pieces[:, :2] - pieces[k, :2]
        with np.errstate(divide="ignore", invalid="ignore"):
            here = (away[:, 0] * unit[:, 1] - away[:, 1] * unit[:, 0]) / sine  # of the meeting place along this piece
            there = (away[:, 0] * unit[k, 1] - away[:, 1] * unit[k, 0]) / sine  # and along the other one
        meets = (np.abs(sine) > PARALLEL) & (there > -JOIN_M) & (there < length + JOIN_M)
        for end, at in ((0, 0.0), (2, length[k])):
            moved = np.where(meets, np.abs(here - at), np.inf)
            other = int(moved.argmin())
            if moved[other] < JOIN_M:
                joined[k, end : end + 2] = pieces[k, :2] + here[other] * unit[k]
    return joined
