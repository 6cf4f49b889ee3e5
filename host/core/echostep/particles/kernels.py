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
from echostep.jit import kernel, lean_kernel, lean_part
from echostep.particles.arrays import Move, ParticleArrays
from echostep.walls.index import WallIndex, crossings

LEAST_WEIGHT = 1e-300  # of a particle, so that its logarithm exists
SMALL_RAD = 0.05  # rotation up to which the series of `_rotate` are exact to 1e-12
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
def end_segment(particles: ParticleArrays, weight: Floats) -> None:
    """Write the log-weights, 0 for the greatest."""
    _, _, top = weight_sums(weight)
    for i in range(len(weight)):
        particles.log_weight[i] = math.log(max(weight[i] / top, LEAST_WEIGHT))


@kernel
def piece_of(move: Move, begin: float, end: float) -> MovePiece:
    """The piece of a move between two shares of it: of a parabola [`PathSegment.way_m`]."""
    part, bend = end - begin, (end - begin) * (1.0 - begin - end)
    bend_x, bend_y = bend * move.bend_x_m, bend * move.bend_y_m
    return MovePiece(part * move.dx_m + bend_x, part * move.dy_m + bend_y, bend_x, bend_y)


@kernel
def propagate(
    particles: ParticleArrays, arrays: SegmentArrays, piece: MovePiece, share: float, noise: Floats, wall_factor: float,
    walls: WallIndex,
) -> int:  # fmt: skip
    """Move every particle by a piece, with this share of its noise (5, n) but all of its bend's; one that crosses a wall keeps `wall_factor`.

    Returns the number of those.
    """
    x, y, turn, scale, _ = particles
    to_x, to_y = np.empty(len(x)), np.empty(len(x))
    _rotate(turn, arrays, share, noise[NOISE_TURN])
    for i in range(len(x)):
        scale[i] += share * noise[NOISE_SCALE, i]
        dx, dy = piece.dx_m + noise[NOISE_BEND, i] * piece.bend_x_m, piece.dy_m + noise[NOISE_BEND, i] * piece.bend_y_m
        to_x[i] = x[i] + scale[i] * (arrays.cos[i] * dx - arrays.sin[i] * dy) + share * noise[0, i]
        to_y[i] = y[i] + scale[i] * (arrays.sin[i] * dx + arrays.cos[i] * dy) + share * noise[1, i]
    crosses = crossings(x, y, to_x, to_y, walls)
    crossed = 0
    for i in range(len(x)):
        x[i], y[i] = to_x[i], to_y[i]
        arrays.weight[i] *= wall_factor if crosses[i] else 1.0
        crossed += crosses[i]
    return crossed


@lean_part
def _rotate(turn: Floats, arrays: SegmentArrays, share: float, noise: Floats) -> None:
    """Turn every particle by this share of its noise (n,): cosine and sine to 1e-12 by series, exactly if one turns far."""
    cos, sin, far = arrays.cos, arrays.sin, 0
    for i in range(len(turn)):
        turn[i] += share * noise[i]
        far += abs(share * noise[i]) > SMALL_RAD
    if far:
        for i in range(len(turn)):
            cos[i], sin[i] = math.cos(turn[i]), math.sin(turn[i])
        return
    for i in range(len(turn)):
        by, c, s = share * noise[i], cos[i], sin[i]
        b2 = by * by
        cb = 1.0 - b2 * (0.5 - b2 * (1.0 / 24.0 - b2 / 720.0))
        sb = by * (1.0 - b2 * (1.0 / 6.0 - b2 * (1.0 / 120.0)))
        cos[i], sin[i] = c * cb - s * sb, s * cb + c * sb


@lean_kernel
def effective_size(weight: Floats) -> float:
    """Effective number of particles, (sum w)^2 / sum w^2."""
    total, squares, _ = weight_sums(weight)
    return total * total / squares if squares > 0.0 else 0.0


@lean_kernel
def weight_sums(weight: Floats) -> tuple[float, float, float]:
    """Sum of weights (n,), sum of their squares, and the greatest."""
    total, squares, top = 0.0, 0.0, 0.0
    for w in weight:
        total += w
        squares += w * w
        top = max(top, w)
    return total, squares, top


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
