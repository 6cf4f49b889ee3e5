# SPDX-License-Identifier: MIT
"""The steps of the particle filter on plain arrays: propagate, reweight by a ping, normalise, select survivors.

In: `ParticleArrays`, a `Move` in the walk frame, a `PingBatch`, the walls. Out: the same arrays, changed in place. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel, lean_kernel
from echostep.localization.echoes.likelihood import EchoModel, outlier_density, planned_density
from echostep.localization.particle_arrays import Move, ParticleArrays, PingBatch
from echostep.walls.echo_sources import MOST_SOURCES, echo_sources
from echostep.walls.index import WallIndex, crosses_wall

NEGLIGIBLE_WEIGHT = 1e-9  # weight below which no likelihood is computed: the next resampling drops such particles
LEAST_DENSITY = 1e-12  # of a range, so that its logarithm exists
NOISE_TURN, NOISE_SCALE, NOISE_BEND = 2, 3, 4  # rows of the noise (5, n); rows 0 and 1 are x and y


class MovePiece(NamedTuple):
    """Chord of a piece of a move, and what of it its bend is (m, walk frame)."""

    dx_m: float
    dy_m: float
    bend_x_m: float
    bend_y_m: float


class WeightedPing(NamedTuple):
    """One ping of a `PingBatch`."""

    axis_rad: float
    range_m: float
    power: float
    travel_m: float
    missed: float
    alike: float
    unplanned: float


class EchoMemory(NamedTuple):
    """`hidden` (2, n): probability by ranger and particle that its view is hidden. `log_evidence` (k,): output, see `propagate_and_reweight`."""

    hidden: Floats
    log_evidence: Floats


class CloudModel(NamedTuple):
    """What the kernels need of the settings: log-weight that crossing a wall costs, effective share that asks for resampling, the echo model."""

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
    """Continue from `progress` until the cloud needs to be resampled or the move is over; `noise` (5, n) is for the rest of the move.

    Writes to `memory.log_evidence` (k,) the log of each ping's mean likelihood under the cloud before it. Returns the new progress, the lowest
    best log-weight before renormalising, and the log of the weight that the walls left.
    """
    done, k = progress.share, progress.ping
    rest, lowest, passed = 1.0 - done, 0.0, 0.0
    while done < 1.0 or k < len(pings.share):
        until = max(pings.share[k], done) if k < len(pings.share) else 1.0
        if until > done:
            piece = piece_of(move, done, until)
            best, left = propagate(particles, piece, (until - done) / rest, noise, model.wall_cost, walls)
            lowest = min(lowest, best)
            passed += left
            done = until
        if k < len(pings.share):
            ping = WeightedPing(
                pings.axis_rad[k],
                pings.range_m[k],
                pings.power[k],
                pings.travel_m[k],
                pings.missed[k],
                pings.alike[k],
                pings.unplanned[k],
            )
            memory.log_evidence[k], size = reweight_by_ping(
                particles, memory.hidden[pings.ranger[k]], ping, model.echo, walls
            )
            k += 1
        else:
            size = effective_size(particles.log_weight)
        if size < model.resample_below * len(particles.x_m):
            break
    return MoveProgress(done, k), lowest, passed


@kernel
def piece_of(move: Move, begin: float, end: float) -> MovePiece:
    """The piece of a move between two shares of it: of a parabola [`PathSegment.way_m`]."""
    part, bend = end - begin, (end - begin) * (1.0 - begin - end)
    bend_x, bend_y = bend * move.bend_x_m, bend * move.bend_y_m
    return MovePiece(part * move.dx_m + bend_x, part * move.dy_m + bend_y, bend_x, bend_y)


@lean_kernel
def propagate(
    particles: ParticleArrays, piece: MovePiece, share: float, noise: Floats, wall_cost: float, walls: WallIndex
) -> tuple[float, float]:
    """Move every particle by a piece, with this share of its noise but all of that of its bend, and make the greatest log-weight 0 again.

    Returns what that was, and the log of the share of the weight that crossed no wall.
    """
    x, y, turn, scale, log_weight = particles
    top, total, crossed = -np.inf, 0.0, 0.0
    for i in range(len(x)):
        turn[i] += share * noise[NOISE_TURN, i]
        scale[i] += share * noise[NOISE_SCALE, i]
        dx, dy = piece.dx_m + noise[NOISE_BEND, i] * piece.bend_x_m, piece.dy_m + noise[NOISE_BEND, i] * piece.bend_y_m
        c, s = math.cos(turn[i]), math.sin(turn[i])
        to_x = x[i] + scale[i] * (c * dx - s * dy) + share * noise[0, i]
        to_y = y[i] + scale[i] * (s * dx + c * dy) + share * noise[1, i]
        weight = math.exp(log_weight[i])
        total += weight
        if crosses_wall(x[i], y[i], to_x, to_y, walls):
            crossed += weight
            log_weight[i] -= wall_cost
        top = max(top, log_weight[i])
        x[i], y[i] = to_x, to_y
    if top != 0.0:
        for i in range(len(x)):
            log_weight[i] -= top
    return top, math.log(max(1.0 - crossed / total, math.exp(-wall_cost)))


@kernel
def propagate_without_walls(particles: ParticleArrays, move: Move, rng: np.random.Generator) -> None:
    """Move every particle on open ground, without walls."""
    x, y, turn, scale, _ = particles
    for i in range(len(x)):
        turn[i] += move.turn_sd_rad * rng.standard_normal()
        scale[i] += move.scale_sd * rng.standard_normal()
        c, s = math.cos(turn[i]), math.sin(turn[i])
        x[i] += scale[i] * (c * move.dx_m - s * move.dy_m) + move.sd_m * rng.standard_normal()
        y[i] += scale[i] * (s * move.dx_m + c * move.dy_m) + move.sd_m * rng.standard_normal()


@kernel
def reweight_by_ping(
    particles: ParticleArrays, hidden: Floats, ping: WeightedPing, model: EchoModel, walls: WallIndex
) -> tuple[float, float]:
    """Add each particle's log-likelihood, and make the greatest log-weight 0.

    `hidden` (n,): of this ranger, the probability that the particle's view is hidden, so that the plan gives no information. Along the path it
    returns to `model.hidden` within `model.hidden_m`; the ping corrects it. Densities of ranges are raised to the ping's power, for successive errors
    are alike; probabilities of the view and of an outlier are not. Returns the log of the mean likelihood before, and the effective size after.
    """
    x, y, turn, _, log_weight = particles
    distance_m, off_axis_rad, kind = np.empty(MOST_SOURCES), np.empty(MOST_SOURCES), np.empty(MOST_SOURCES)
    persists = math.exp(-ping.travel_m / model.hidden_m)
    outlier = model.outlier * (outlier_density(ping.range_m, model) + ping.missed) ** ping.power
    stray = 0.5 * (ping.alike + 1.0 / (model.maximum_m - model.minimum_m))
    top = -np.inf
    weight, evidence, total, squares = 0.0, 0.0, 0.0, 0.0
    for i in range(len(x)):
        w = math.exp(log_weight[i])
        if w < NEGLIGIBLE_WEIGHT:
            continue
        count = echo_sources(x[i], y[i], ping.axis_rad + turn[i], walls, distance_m, off_axis_rad, kind)
        density = planned_density(ping.range_m, count, distance_m, off_axis_rad, kind, stray, model) + ping.missed
        planned = (1.0 - model.outlier) * math.exp(ping.power * math.log(max(density, LEAST_DENSITY))) + outlier
        before = model.hidden + persists * (hidden[i] - model.hidden)
        by_hidden = before * ping.unplanned
        likelihood = by_hidden + (1.0 - before) * planned
        hidden[i] = by_hidden / likelihood
        weight += w
        w *= likelihood
        evidence += w
        log_weight[i] += math.log(likelihood)
        top = max(top, log_weight[i])
        total += w
        squares += w * w
    for i in range(len(x)):
        log_weight[i] -= top
    return math.log(evidence / weight), total * total / squares


@lean_kernel
def effective_size(log_weight: Floats) -> float:
    """Effective number of particles, (sum w)^2 / sum w^2."""
    total, squares = 0.0, 0.0
    for v in log_weight:
        w = math.exp(v)
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


@kernel
def keep_chosen(particles: ParticleArrays, chosen: Ints) -> None:
    """Replace the particles by the chosen ones (n,) in place, with equal weights; their number stays."""
    x, y, turn, scale, log_weight = particles
    x[:], y[:], turn[:], scale[:] = x[chosen], y[chosen], turn[chosen], scale[chosen]
    log_weight[:] = 0.0
