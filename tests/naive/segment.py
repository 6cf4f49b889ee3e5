# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of a segment with its pings: one particle after the other, all sources, weights as logarithms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.echoes.likelihood import EchoModel
from echostep.particles.arrays import Move, PingBatch
from naive.walls import crosses, echo_sources


class Particle:
    """One particle, with the probability that each ranger's view is hidden."""

    def __init__(
        self, x: float, y: float, turn: float, scale: float, log_weight: float, left: float, right: float
    ) -> None:
        self.x, self.y, self.turn, self.scale, self.log_weight = x, y, turn, scale, log_weight
        self.hidden = [left, right]


@dataclass
class Followed:
    """Log of each ping's mean likelihood, and log of the weight that crossed no wall."""

    log_evidence: list[float]
    log_passed: float


def follow(
    cloud: list[Particle],
    move: Move,
    noise: Floats,
    pings: PingBatch,
    model: EchoModel,
    walls: Floats,
    wall_cost: float,
) -> Followed:
    """Move to each trigger and weigh there, then move to the end."""
    followed, done = Followed([], 0.0), 0.0
    for k, share in enumerate([*pings.share.tolist(), 1.0]):
        before = [p.log_weight for p in cloud]
        crossed = [_moves(p, move, noise[:, i], done, share, walls) for i, p in enumerate(cloud)]
        for p, is_crossed in zip(cloud, crossed, strict=True):
            p.log_weight -= wall_cost * is_crossed
        left = 1.0 - sum(np.exp(before) * crossed) / sum(np.exp(before))
        followed.log_passed += math.log(max(left, math.exp(-wall_cost)))
        done = share
        if k < len(pings.share):
            weights = np.exp([p.log_weight for p in cloud])
            likelihood = np.array([_likelihood(p, pings, k, model, walls) for p in cloud])
            followed.log_evidence.append(math.log(weights @ likelihood / weights.sum()))
            for p, each in zip(cloud, likelihood.tolist(), strict=True):
                p.log_weight += math.log(each)
    top = max(p.log_weight for p in cloud)
    for p in cloud:
        p.log_weight -= top
    return followed


def _moves(p: Particle, move: Move, noise: Floats, begin: float, end: float, walls: Floats) -> bool:
    """Move from one share of the move to another; whether that crosses a wall."""
    share = end - begin
    way = [
        _at(end, chord, (1.0 + noise[4]) * bend) - _at(begin, chord, (1.0 + noise[4]) * bend)
        for chord, bend in ((move.dx_m, move.bend_x_m), (move.dy_m, move.bend_y_m))
    ]
    p.turn, p.scale = p.turn + share * noise[2], p.scale + share * noise[3]
    c, s = math.cos(p.turn), math.sin(p.turn)
    x = p.x + p.scale * (c * way[0] - s * way[1]) + share * noise[0]
    y = p.y + p.scale * (s * way[0] + c * way[1]) + share * noise[1]
    was, p.x, p.y = (p.x, p.y), x, y
    return share > 0.0 and crosses(*was, x, y, walls)


def _at(share: float, chord_m: float, bend_m: float) -> float:
    """Where a parabola of this chord is after a share of it, along one axis."""
    return share * chord_m + share * (1.0 - share) * bend_m


def _likelihood(p: Particle, pings: PingBatch, k: int, m: EchoModel, walls: Floats) -> float:
    """Likelihood of a ping with an echo, and the update of the view."""
    range_m, power, ranger = float(pings.range_m[k]), float(pings.power[k]), int(pings.ranger[k])
    unheard, density, span_m = 1.0, 0.0, m.maximum_m - m.minimum_m
    for away, off, kind in echo_sources(p.x, p.y, float(pings.axis_rad[k]) + p.turn, walls):
        answers = unheard * _detected(away, off, kind, m)
        sd = m.sd_m + m.slant_m * off
        density += answers * math.exp(-0.5 * ((range_m - away) / sd) ** 2) / (sd * math.sqrt(2.0 * math.pi))
        unheard -= answers
    density += unheard * float(pings.stray[k]) * 0.5 * (float(pings.alike[k]) + 1.0 / span_m)
    planned = (1.0 - m.outlier) * max(density, 1e-12) ** power + m.outlier * (0.8 / span_m) ** power
    before = m.hidden + math.exp(-float(pings.travel_m[k]) / m.hidden_m) * (p.hidden[ranger] - m.hidden)
    likelihood = before * float(pings.unplanned[k]) + (1.0 - before) * planned
    p.hidden[ranger] = before * float(pings.unplanned[k]) / likelihood
    return likelihood


def _detected(away: float, off: float, kind: float, m: EchoModel) -> float:
    """Probability of detection: spreading, absorption, beam, and the weaker echo of a corner (2) or an edge (1), which fades sooner."""
    spreading = 20.0 * math.log10(away)
    margin = m.reach - m.per_db * (spreading + 2.6 * away) - m.beam * off**2
    margin -= {0.0: 0.0, 1.0: m.edge + 0.5 * m.per_db * spreading, 2.0: m.corner}[kind]
    return 1.0 / (1.0 + math.exp(-margin)) if away >= 0.5 * m.minimum_m else 0.0
