# SPDX-License-Identifier: MIT
"""The steps of the particle filter on plain arrays: propagate, select survivors.

In: `ParticleArrays`, a `Move` in the walk frame, the walls. Out: the same arrays, changed in place. Owns nothing.

While a segment is processed, weights are not logarithms and each particle's rotation is kept as its cosine and sine (`SegmentArrays`): a segment has
many pings, and between two of them a particle turns by little.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import inline_part, kernel, lean_kernel
from echostep.particles.arrays import Move, ParticleArrays
from echostep.walls.index import WallIndex, crosses_wall

LEAST_WEIGHT = 1e-300  # of a particle, so that its logarithm exists
SMALL_RAD = 0.05  # rotation up to which the series of `rotated` are exact to 1e-12
NOISE_TURN, NOISE_SCALE, NOISE_BEND = 2, 3, 4  # rows of the noise (5, n); rows 0 and 1 are x and y


class MovePiece(NamedTuple):
    """Chord of a piece of a move, and the part of it due to the bend (m, walk frame)."""

    dx_m: float
    dy_m: float
    bend_x_m: float
    bend_y_m: float


class SegmentArrays(NamedTuple):
    """Of n particles, each array (n,), while a segment is processed: weight (no logarithm), cosine and sine of the rotation."""

    weight: Floats
    cos: Floats
    sin: Floats


@kernel
def begin_segment(particles: ParticleArrays) -> SegmentArrays:
    """The weights and rotations of the particles; the greatest weight is 1."""
    return SegmentArrays(np.exp(particles.log_weight), np.cos(particles.turn_rad), np.sin(particles.turn_rad))


@lean_kernel
def end_segment(particles: ParticleArrays, arrays: SegmentArrays, top: float) -> None:
    """Write the log-weights, 0 where the weight is `top`, the greatest."""
    for i in range(len(arrays.weight)):
        particles.log_weight[i] = math.log(max(arrays.weight[i] / top, LEAST_WEIGHT))


@kernel
def piece_of(move: Move, begin: float, end: float) -> MovePiece:
    """The piece of a move between two shares of it: of a parabola [`PathSegment.way_m`]."""
    part, bend = end - begin, (end - begin) * (1.0 - begin - end)
    bend_x, bend_y = bend * move.bend_x_m, bend * move.bend_y_m
    return MovePiece(part * move.dx_m + bend_x, part * move.dy_m + bend_y, bend_x, bend_y)


@lean_kernel
def propagate(
    particles: ParticleArrays, arrays: SegmentArrays, piece: MovePiece, share: float, noise: Floats, wall_factor: float,
    walls: WallIndex,
) -> tuple[float, float]:  # fmt: skip
    """Move every particle by a piece, with this share of its noise (5, n) but all of its bend's; one that crosses a wall keeps `wall_factor`.

    Returns the greatest weight afterwards, and the share of the weight that crossed no wall.
    """
    x, y, turn, scale, _ = particles
    weight, cos, sin = arrays
    top, total, crossed = 0.0, 0.0, 0.0
    for i in range(len(x)):
        by_rad = share * noise[NOISE_TURN, i]
        turn[i] += by_rad
        scale[i] += share * noise[NOISE_SCALE, i]
        dx, dy = piece.dx_m + noise[NOISE_BEND, i] * piece.bend_x_m, piece.dy_m + noise[NOISE_BEND, i] * piece.bend_y_m
        c, s = rotated(cos[i], sin[i], by_rad, turn[i])
        to_x = x[i] + scale[i] * (c * dx - s * dy) + share * noise[0, i]
        to_y = y[i] + scale[i] * (s * dx + c * dy) + share * noise[1, i]
        total += weight[i]
        if crosses_wall(x[i], y[i], to_x, to_y, walls):
            crossed += weight[i]
            weight[i] *= wall_factor
        top = max(top, weight[i])
        x[i], y[i], cos[i], sin[i] = to_x, to_y, c, s
    return top, 1.0 - crossed / total


@inline_part
def rotated(c: float, s: float, by_rad: float, to_rad: float) -> tuple[float, float]:
    """Cosine and sine of `to_rad` from the values before a turn by `by_rad`: to 1e-12 by series, exactly for a large turn."""
    if abs(by_rad) > SMALL_RAD:
        return math.cos(to_rad), math.sin(to_rad)
    b2 = by_rad * by_rad
    cb = 1.0 - b2 * (0.5 - b2 * (1.0 / 24.0 - b2 / 720.0))
    sb = by_rad * (1.0 - b2 * (1.0 / 6.0 - b2 * (1.0 / 120.0)))
    return c * cb - s * sb, s * cb + c * sb


@lean_kernel
def effective_size(weight: Floats) -> float:
    """Effective number of particles, (sum w)^2 / sum w^2."""
    total, squares = 0.0, 0.0
    for w in weight:
        total += w
        squares += w * w
    return total * total / squares if squares > 0.0 else 0.0


@kernel
def systematic(weight: Floats, draw: float, count: int) -> Ints:
    """`count` indices of systematic resampling [Kitagawa 1996] for weights (n,) and one uniform draw in [0, 1)."""
    step = weight.sum() / count
    chosen = np.empty(count, np.int64)
    reach, k = weight[0], 0
    for i in range(count):
        mark = (i + draw) * step
        while reach < mark and k < len(weight) - 1:
            k += 1
            reach += weight[k]
        chosen[i] = k
    return chosen
