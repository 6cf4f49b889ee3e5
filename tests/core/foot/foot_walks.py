# SPDX-License-Identifier: MIT
"""Courses of a rigid foot for tests (`rolling_foot`), and mountings of a sensor on it."""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep_studies.simulation.rolling_foot import MANNERS, Course, FootManner, course, felt, pitched, samples

__all__ = ["MANNERS", "Course", "FootManner", "any_rotation", "course", "felt", "pitched", "samples"]


def any_rotation(rng: np.random.Generator) -> Floats:
    """A random rotation matrix (3, 3)."""
    q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    return np.asarray(q * np.sign(np.linalg.det(q)))
