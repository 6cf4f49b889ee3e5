# SPDX-License-Identifier: MIT
"""Courses of a rigid foot for tests (`rolling_foot`), and mountings of a sensor on it.

Walks and comparisons of the foot.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Stance, Step, Track
from echostep_simulation.people.rolling_foot import MANNERS, Course, FootManner, course, felt, pitched, samples

__all__ = ["MANNERS", "Course", "FootManner", "any_rotation", "course", "felt", "pitched", "samples"]


def any_rotation(rng: np.random.Generator) -> Floats:
    """A random rotation matrix (3, 3)."""
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))


Samples = tuple[Floats, Floats, Floats]


def bent(gyro: Floats, limit_rad_s: float) -> Floats:
    """A reading that follows the rate and bends off within a few percent of the limit, never twice at one value."""
    return np.asarray(gyro * (1.0 + (np.abs(gyro) / limit_rad_s) ** 24) ** (-1 / 24))


def doubts_of(track: Track) -> str:
    return "; ".join(track.steps[-1].doubts())


def moves(track: Track) -> Floats:
    return np.array([step.move_m for step in track.steps])


def same(a: list[Step | Stance], b: list[Step | Stance]) -> bool:
    """Whether two lists of events are equal in every bit."""
    return [repr(event) for event in a] == [repr(event) for event in b]


def walking(steps: int = 5, rate_hz: int = 100, seed: int = 1) -> Samples:
    return samples(course(MANNERS["walking"], steps), rate_hz, rng=np.random.default_rng(seed))
