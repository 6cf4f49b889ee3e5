# SPDX-License-Identifier: MIT
"""Simulated returns without a plan: people who obey with 15 degrees of error and a second of delay, on a track that drifts (simulated).

Open ground: no wall holds the walker in a corridor. Drift of the track: a heading that turns by a bias and at random, a scale error, as of a foot
that is 0.7 % off after 50 m.
"""

from __future__ import annotations

import math
from collections import deque
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from echostep.localization import Estimate, TrackStatus
from echostep.path import MeasuredSegment, PathSegment
from echostep.tracker import Tracker
from echostep_app.guidance.guided_return import GuidedReturn

RETURNS = 100
SPEED_M_S, PERIOD_S = 0.8, 0.5
OBEYS_RAD, DELAY = math.radians(15.0), 2  # error of a turn; periods until a cue is followed
# A metre of drift, per root of a metre, of the lengths
BIAS_RAD_M, NOISE_RAD, SCALE = (math.radians(0.02), math.radians(0.1), 0.007)
CLOSE_M = 2.0  # from the door
MOST_TIMES = 3  # the length of the way in that a return may take
MEASURED = MeasuredSegment(PathSegment(0.0, 1.0, 0.4, 0.0, 0.0, 0.0, 0.02, 0.0, 1), *np.empty((3, 0)))


class Walker:
    """A walker with a true pose and the track's, which drifts, both from the origin."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.true, self.track = np.zeros(2), np.zeros(2)
        self.heading_rad = self.drift_rad = 0.0
        self.bias_rad_m, self.scale = BIAS_RAD_M * rng.standard_normal(), 1.0 + SCALE * rng.standard_normal()
        self.t_s = self.gone_m = 0.0
        tracker = SimpleNamespace(watchers=[], state=SimpleNamespace(beacon_heard_s=None))
        self.guided = GuidedReturn(cast("Tracker", tracker))

    def step(self, heading_rad: float) -> None:
        """Walk for a period in a true direction; the track and the guidance follow."""
        length = SPEED_M_S * PERIOD_S
        self.heading_rad = heading_rad
        self.drift_rad += self.bias_rad_m * length + NOISE_RAD * math.sqrt(length) * self.rng.standard_normal()
        seen_rad = heading_rad + self.drift_rad
        self.true += length * np.array([math.cos(heading_rad), math.sin(heading_rad)])
        self.track += self.scale * length * np.array([math.cos(seen_rad), math.sin(seen_rad)])
        self.t_s += PERIOD_S
        self.gone_m += length
        variance = (0.1 + 0.01 * self.gone_m) ** 2
        x, y = self.track.tolist()
        e = Estimate(self.t_s, x, y, variance, 0.0, variance, seen_rad, 0.1, 1, TrackStatus.UNCERTAIN)
        self.guided._watch(MEASURED, e)


def walk_in(walker: Walker) -> None:
    """Five to ten corridors of 4 to 16 m, at right angles."""
    rng = walker.rng
    heading_rad = 0.0
    for _ in range(int(rng.integers(5, 11))):
        for _ in range(int(rng.uniform(4.0, 16.0) / (SPEED_M_S * PERIOD_S))):
            walker.step(heading_rad + 0.05 * rng.standard_normal())
        heading_rad += 0.5 * math.pi * float(rng.choice([-1.0, 1.0]))


def comes_back(seed: int) -> bool:
    """Whether a walker who turns round, and then does what the arrow shows, comes to the door."""
    walker = Walker(np.random.default_rng([seed, 17]))
    walk_in(walker)
    most_s = walker.t_s + MOST_TIMES * walker.t_s
    heading_rad = walker.heading_rad + math.pi
    arrows: deque[float] = deque()
    while walker.t_s < most_s:
        walker.step(heading_rad)
        if np.hypot(*walker.true) < CLOSE_M:
            return True
        if (arrow_rad := walker.guided.cues[-1].arrow_rad) is not None:
            arrows.append(heading_rad + arrow_rad)
        if len(arrows) > DELAY:
            heading_rad = arrows.popleft() + OBEYS_RAD * walker.rng.standard_normal()
    return False


@pytest.mark.slow
def test_nearly_all_come_back_to_the_door() -> None:
    assert sum(comes_back(seed) for seed in range(RETURNS)) >= 0.97 * RETURNS
