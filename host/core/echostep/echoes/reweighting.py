# SPDX-License-Identifier: MIT
"""Reweighting by pings, where each was triggered on the way.

In: `ParticleArrays`, a `Move` with its `PingBatch`, the walls. Out: the same arrays, changed in place; how well the cloud predicted the pings.
Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import SURE_COS, EchoModel, outlier_density, planned_density
from echostep.jit import kernel, lean_kernel
from echostep.particles.arrays import Move, ParticleArrays, PingBatch
from echostep.particles.kernels import (
    SegmentArrays,
    begin_segment,
    effective_size,
    end_segment,
    piece_of,
    propagate,
)
from echostep.walls.echo_sources import MOST_SOURCES, Limits, Receiver, SourceList, are_tabulated, first_sources
from echostep.walls.index import WallIndex

# Of the greatest, below which no likelihood is computed: the next resampling drops such particles
NEGLIGIBLE_WEIGHT = 1e-9
LEAST_TOP = 1e-100  # greatest weight below which all are rescaled: far from the least number
LEAST_DENSITY = 1e-12  # of a range, so that its logarithm exists


class EchoMemory(NamedTuple):
    """`hidden` (2, n): probability by ranger and particle that its view is hidden. `log_evidence` (k,): output, see `propagate_and_reweight`."""

    hidden: Floats
    log_evidence: Floats


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
    model: CloudModel, walls: WallIndex, memory: EchoMemory,
) -> tuple[MoveProgress, float, float]:  # fmt: skip
    """Continue from `progress` until the cloud needs to be resampled or a table (`Walls.near`), or the move is over; `noise` (5, n) is for its rest.

    Writes to `memory.log_evidence` (k,) the log of each ping's mean likelihood under the cloud before it. Returns the new progress, the lowest
    log of the share that a piece of the move left of the greatest weight, and the log of the weight that the walls left.
    """
    sources = SourceList(np.empty(MOST_SOURCES), np.empty(MOST_SOURCES), np.empty(MOST_SOURCES))
    arrays, wall_factor = begin_segment(particles), math.exp(-model.wall_cost)
    done, k = progress.share, progress.ping
    rest, top, lowest, passed = 1.0 - done, 1.0, 1.0, 0.0
    while done < 1.0 or k < len(pings.share):
        until = max(pings.share[k], done) if k < len(pings.share) else 1.0
        if until > done:
            piece, before = piece_of(move, done, until), top
            top, left = propagate(particles, arrays, piece, (until - done) / rest, noise, wall_factor, walls)
            lowest = min(lowest, top / before)
            passed += math.log(max(left, wall_factor))
            done = until
        if k < len(pings.share):
            if not are_tabulated(particles.x_m, particles.y_m, walls):
                break
            memory.log_evidence[k], size, top = reweight_by_ping(
                particles, arrays, memory.hidden[pings.ranger[k]], pings, k, model.echo, top, walls, sources
            )
            k += 1
        else:
            size = effective_size(arrays.weight)
        if top < LEAST_TOP:
            for i in range(len(arrays.weight)):
                arrays.weight[i] /= top
            top = 1.0
        if size < model.resample_below * len(particles.x_m):
            break
    end_segment(particles, arrays, top)
    return MoveProgress(done, k), math.log(lowest), passed


@lean_kernel
def reweight_by_ping(
    particles: ParticleArrays, arrays: SegmentArrays, hidden: Floats, pings: PingBatch, k: int, model: EchoModel, top: float,
    walls: WallIndex, sources: SourceList,
) -> tuple[float, float, float]:  # fmt: skip
    """Multiply each particle's weight by its likelihood of the k-th ping; `top`: the greatest weight before.

    `hidden` (n,): of this ranger, the probability that the particle's view is hidden, so that the plan gives no information. Along the path it
    returns to `model.hidden` within `model.hidden_m`; the ping corrects it. Densities of ranges are raised to the ping's power, for successive errors
    are alike; probabilities of the view and of an outlier are not. Returns the log of the mean likelihood before, the effective size after, and the
    greatest weight after.
    """
    x, y, turn, _, _ = particles
    weight, cos, sin = arrays
    distance_m, off_axis_rad, kind = sources
    axis_rad, range_m, power = pings.axis_rad[k], pings.range_m[k], pings.power[k]
    stray, missed, unplanned = pings.stray[k], pings.missed[k], pings.unplanned[k]
    ax, ay = math.cos(axis_rad), math.sin(axis_rad)
    persists = math.exp(-pings.travel_m[k] / model.hidden_m)
    outlier = model.outlier * (outlier_density(range_m, model) + missed) ** power
    strays = 0.5 * (pings.alike[k] + 1.0 / (model.maximum_m - model.minimum_m))
    limits = Limits(model.sure_m, SURE_COS, model.edge_m)
    least, best = NEGLIGIBLE_WEIGHT * top, 0.0
    total_before, total, squares = 0.0, 0.0, 0.0
    for i in range(len(x)):
        w = weight[i]
        if w < least:
            continue
        receiver = Receiver(x[i], y[i], ax * cos[i] - ay * sin[i], ax * sin[i] + ay * cos[i])
        count = first_sources(receiver, axis_rad + turn[i], walls, limits, sources)
        density = planned_density(range_m, count, distance_m, off_axis_rad, kind, stray, strays, model)
        density += missed
        planned = (1.0 - model.outlier) * math.exp(power * math.log(max(density, LEAST_DENSITY))) + outlier
        before = model.hidden + persists * (hidden[i] - model.hidden)
        by_hidden = before * unplanned
        likelihood = by_hidden + (1.0 - before) * planned
        hidden[i] = by_hidden / likelihood
        total_before += w
        w *= likelihood
        weight[i] = w
        best = max(best, w)
        total += w
        squares += w * w
    return math.log(total / total_before), total * total / squares, best
