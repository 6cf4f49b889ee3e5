# SPDX-License-Identifier: MIT
"""Walks and comparisons for tests of the foot."""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Stance, Step, Track
from foot import foot_walks as fw

Samples = tuple[Floats, Floats, Floats]


def moves(track: Track) -> Floats:
    return np.array([step.move_m for step in track.steps])


def same(a: list[Step | Stance], b: list[Step | Stance]) -> bool:
    """Whether two lists of events are equal in every bit."""
    return [repr(event) for event in a] == [repr(event) for event in b]


def walking(steps: int = 5, rate_hz: int = 100, seed: int = 1) -> Samples:
    return fw.samples(fw.course(fw.MANNERS["walking"], steps), rate_hz, rng=np.random.default_rng(seed))
