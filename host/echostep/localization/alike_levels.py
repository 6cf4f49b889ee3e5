# SPDX-License-Identifier: MIT
"""How probable each level is where a search has found a place: storeys of a building are often alike.

In: the last moves with their pings, and the place as a few particles. Out: the log-odds of each level against that of the place. Owns the moves.

A coarse cloud has a particle or two about each true pose, so which of two storeys that are alike gets the weight is chance. The same way on each
level, against the same echoes, tells them apart as far as echoes do.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.localization.echo_likelihood import EchoModel
from echostep.localization.particle_kernels import (
    CloudModel,
    EchoMemory,
    Move,
    MoveProgress,
    ParticleArrays,
    PingBatch,
    propagate_and_reweight,
    systematic,
)
from echostep.localization.particles import Cloud
from echostep.localization.plausibility import UNPLANNED_DOOR
from echostep.walls.echo_sources import Walls

PAST_M = 40.0  # path that is looked back on, by reason: that on which a place is found
SAMPLED = 300  # ways that are tried on each level, by reason
CLIMBED_M = 0.2  # rise of the foot in a stride that is on stairs, by reason: twice a door sill and more


class RecentWay:
    """The last PAST_M of the path on one level, with the pings on them."""

    def __init__(self) -> None:
        self._pieces: deque[tuple[Move, PingBatch]] = deque()
        self._length_m = 0.0

    def add(self, move: Move, pings: PingBatch, rise_m: float) -> None:
        """One more move; one on stairs begins a new way."""
        if abs(rise_m) > CLIMBED_M:
            self._pieces.clear()
            self._length_m = 0.0
            return
        self._pieces.append((move, pings))
        self._length_m += math.hypot(move.dx_m, move.dy_m)
        while self._length_m > PAST_M:
            first, _ = self._pieces.popleft()
            self._length_m -= math.hypot(first.dx_m, first.dy_m)

    def log_odds(self, cloud: Cloud, model: EchoModel, walls: Walls) -> Floats:
        """Of each level (k,) against the cloud's likeliest: how well its way there would foretell the pings."""
        assert cloud.sheet is not None
        own = cloud.likeliest_level
        ends = systematic(np.where(cloud.level == own, cloud.weight, 0.0), 0.5, SAMPLED)
        found = np.array(
            [
                self._log_evidence(cloud, ends, model, walls, (k - own) * cloud.sheet.pitch_m)
                for k in range(len(cloud.sheet.height_m))
            ]
        )
        return np.asarray(found - found[own])

    def _log_evidence(self, cloud: Cloud, ends: Ints, model: EchoModel, walls: Walls, east_m: float) -> float:
        """Log of the mean likelihood of the ways that end with these particles, each moved east by so much."""
        particles = self._begins(cloud, ends, east_m)
        hidden, noise, total = np.zeros((2, len(ends))), np.zeros((4, len(ends))), 0.0
        for move, pings in self._pieces:
            log_evidence = np.zeros(len(pings.share))
            index = walls.near(
                particles.x_m, particles.y_m, math.hypot(move.dx_m, move.dy_m, move.bend_x_m, move.bend_y_m)
            )
            _, _, passed = propagate_and_reweight(
                particles, move, noise, MoveProgress(0.0, 0), pings, CloudModel(-UNPLANNED_DOOR, 0.0, model), index,
                EchoMemory(hidden, log_evidence),
            )  # fmt: skip
            total += passed + float(log_evidence.sum())
        return total

    def _begins(self, cloud: Cloud, ends: Ints, east_m: float) -> ParticleArrays:
        """Where the ways began, by the rotation and scale of their ends."""
        dx = sum(move.dx_m for move, _ in self._pieces)
        dy = sum(move.dy_m for move, _ in self._pieces)
        turn, scale = cloud.turn_rad[ends], cloud.scale[ends]
        c, s = scale * np.cos(turn), scale * np.sin(turn)
        x, y = cloud.x_m[ends] + east_m - (c * dx - s * dy), cloud.y_m[ends] - (s * dx + c * dy)
        return ParticleArrays(x, y, turn, scale, np.zeros(len(ends)))
