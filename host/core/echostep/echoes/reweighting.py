# SPDX-License-Identifier: MIT
"""Reweighting by pings, where each was triggered on the way.

In: `ParticleArrays`, a `Move` with its `PingBatch`, the walls. Out: the same arrays, changed in place; how well the cloud predicted the pings.
Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import (
    SURE_COS,
    EchoModel,
    after_source,
    exponential,
    logarithm,
    outlier_density,
    planned_density,
)
from echostep.jit import inline_part, kernel, lean_kernel, lean_part
from echostep.particles.arrays import Move, ParticleArrays, PingBatch
from echostep.particles.kernels import SegmentArrays, begin_segment, end_segment, piece_of, propagate, weight_sums
from echostep.walls.echo_sources import are_tabulated, list_sources, unit_at
from echostep.walls.index import WallIndex
from echostep.walls.source_blocks import BLOCK, DISTANCE, FREE, KIND, OFF_AXIS, new_block, set_receiver

# Of the greatest, below which no likelihood is computed: the next resampling drops such particles
NEGLIGIBLE_WEIGHT = 1e-9
LEAST_TOP = 1e-100  # greatest weight below which all are rescaled: far from the least number
# Places for particles of one unit that wait, shared by units; a factor that gives neighbouring tiles different ones
CROWDS, SPREAD = 64, 11
HIDDEN, UNHEARD, HIT, LIKELIHOOD = range(FREE, FREE + 4 * BLOCK, BLOCK)  # more columns of a block
LEAST_DENSITY = 1e-12  # of a range, so that its logarithm exists; at 1e-9 a ping weighs 2e-4 nats otherwise, at most 0.16 (simulated)


class CloudModel(NamedTuple):
    """Settings that the kernels need: log-weight that crossing a wall costs, effective share that asks for resampling, the echo model."""

    wall_cost: float
    resample_below: float
    echo: EchoModel


class MoveProgress(NamedTuple):
    """How far a move has been processed: share of its length, and index of the next ping."""

    share: float
    ping: int


@kernel
def propagate_and_reweight(
    particles: ParticleArrays, move: Move, noise: Floats, progress: MoveProgress, pings: PingBatch,
    model: CloudModel, walls: WallIndex, hidden: Floats, log_evidence: Floats,
) -> tuple[MoveProgress, float, float]:  # fmt: skip
    """Continue from `progress` until the cloud needs to be resampled or a table (`Walls.near`), or the move is over; `noise` (5, n) is for its rest.

    `hidden` (2, n): probability by ranger and particle that its view is hidden, changed in place. Writes to `log_evidence` (k,) the log of each
    ping's mean likelihood under the cloud before it. Returns the new progress, the lowest log of the share that a piece of the move left of the
    greatest weight, and the log of the weight that the walls left.
    """
    crowds, block = no_crowds(), new_block()
    arrays, wall_factor = begin_segment(particles), math.exp(-model.wall_cost)
    done, k = progress.share, progress.ping
    rest, lowest, passed = 1.0 - done, 1.0, 0.0
    total, squares, top = weight_sums(arrays.weight)
    while done < 1.0 or k < len(pings.share):
        until = max(pings.share[k], done) if k < len(pings.share) else 1.0
        if until > done:
            piece, before, top_before = piece_of(move, done, until), total, top
            if propagate(particles, arrays, piece, (until - done) / rest, noise, wall_factor, walls):
                total, squares, top = weight_sums(arrays.weight)
                lowest = min(lowest, top / top_before)
                crossed = (1.0 - total / before) / max(1.0 - wall_factor, LEAST_DENSITY)
                passed += math.log(max(1.0 - crossed, wall_factor))
            done = until
        if k < len(pings.share):
            if not are_tabulated(particles.x_m, particles.y_m, walls):
                break
            before, of_ranger = total, hidden[pings.ranger[k]]
            reweight_by_ping(particles, arrays, of_ranger, pings, k, model.echo, top, walls, crowds, block)
            total, squares, top = weight_sums(arrays.weight)
            log_evidence[k] = math.log(total / before)
            k += 1
        size = total * total / squares
        if top < LEAST_TOP:
            for i in range(len(arrays.weight)):
                arrays.weight[i] /= top
            total, squares, top = weight_sums(arrays.weight)
        if size < model.resample_below * len(particles.x_m):
            break
    end_segment(particles, arrays.weight)
    return MoveProgress(done, k), math.log(lowest), passed


@kernel
def no_crowds() -> Ints:
    """Room for the particles that wait until BLOCK of one unit are together (CROWDS, 2 + BLOCK): the unit, their number, their indices."""
    return np.zeros((CROWDS, 2 + BLOCK), np.int64)


@lean_kernel
def reweight_by_ping(
    particles: ParticleArrays, arrays: SegmentArrays, hidden: Floats, pings: PingBatch, k: int, model: EchoModel, top: float,
    walls: WallIndex, crowds: Ints, block: Floats,
) -> None:  # fmt: skip
    """Multiply each particle's weight by its likelihood of the k-th ping; `top`: the greatest weight before.

    `hidden` (n,): of this ranger, the probability that the particle's view is hidden, so that the plan gives no information. Along the path it
    returns to `model.hidden` within `model.hidden_m`; the ping corrects it. Densities of ranges are raised to the ping's power, for successive errors
    are alike; probabilities of the view and of an outlier are not.
    """
    for i in range(len(arrays.weight)):
        if arrays.weight[i] < NEGLIGIBLE_WEIGHT * top:
            continue
        unit = unit_at(particles.x_m[i], particles.y_m[i], pings.axis_rad[k] + particles.turn_rad[i], walls)
        crowd = crowds[(unit * SPREAD) % CROWDS]
        if crowd[1] == BLOCK or (crowd[1] > 0 and crowd[0] != unit):
            _reweight_crowd(particles, arrays, hidden, pings, k, model, walls, crowd, block)
        crowd[0], crowd[1] = unit, crowd[1] + 1
        crowd[1 + crowd[1]] = i
    for slot in range(CROWDS):
        if crowds[slot, 1] > 0:
            _reweight_crowd(particles, arrays, hidden, pings, k, model, walls, crowds[slot], block)


@lean_part
def _reweight_crowd(
    particles: ParticleArrays, arrays: SegmentArrays, hidden: Floats, pings: PingBatch, k: int, model: EchoModel,
    walls: WallIndex, crowd: Ints, block: Floats,
) -> None:  # fmt: skip
    """Reweight the particles of a crowd, and empty it."""
    unit, count, members = crowd[0], crowd[1], crowd[2:]
    crowd[1] = 0
    ax, ay = math.cos(pings.axis_rad[k]), math.sin(pings.axis_rad[k])
    for i in range(count):
        p = members[i]
        c, s, block[HIDDEN + i] = arrays.cos[p], arrays.sin[p], hidden[p]
        set_receiver(block, i, particles.x_m[p], particles.y_m[p], ax * c - ay * s, ax * s + ay * c)
    longest = list_sources(count, unit, walls, (model.sure_m, SURE_COS, model.edge_m), block)
    _weigh(count, longest, pings, k, model, block)
    for i in range(count):
        arrays.weight[members[i]] *= block[LIKELIHOOD + i]
        hidden[members[i]] = block[HIDDEN + i]


@inline_part
def _weigh(count: int, longest: int, pings: PingBatch, k: int, model: EchoModel, block: Floats) -> None:
    """Likelihood of the k-th ping for each receiver of a block, and the probability that its view is hidden."""
    range_m, power, stray = pings.range_m[k], pings.power[k], pings.stray[k]
    missed, unplanned = pings.missed[k], pings.unplanned[k]
    persists = math.exp(-pings.travel_m[k] / model.hidden_m)
    outlier = model.outlier * (outlier_density(range_m, model) + missed) ** power
    strays = 0.5 * (pings.alike[k] + 1.0 / (model.maximum_m - model.minimum_m))
    for i in range(count):
        block[UNHEARD + i], block[HIT + i] = 1.0, 0.0
    for source in range(longest):
        for i in range(count):
            at = source * BLOCK + i
            block[UNHEARD + i], block[HIT + i] = after_source(
                range_m, block[UNHEARD + i], block[HIT + i], block[DISTANCE + at], block[OFF_AXIS + at], block[KIND + at], model
            )  # fmt: skip
    for i in range(count):
        density = planned_density(range_m, block[UNHEARD + i], block[HIT + i], stray, strays) + missed
        planned = (1.0 - model.outlier) * exponential(power * logarithm(max(density, LEAST_DENSITY))) + outlier
        before = model.hidden + persists * (block[HIDDEN + i] - model.hidden)
        by_hidden = before * unplanned
        block[LIKELIHOOD + i] = by_hidden + (1.0 - before) * planned
        block[HIDDEN + i] = by_hidden / block[LIKELIHOOD + i]
