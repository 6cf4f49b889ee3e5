"""The magnetic field inside a building: the earth's, disturbed from place to place.

In: places, a seeded generator. Out: field vectors in the map frame, in units of the earth's field. Owns the disturbance.
Map north is magnetic north. The disturbance is a sum of plane waves a few metres long, enough to turn a compass by several degrees, as
steel in floors and machinery does [Fischer 2008].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

INCLINATION_RAD = math.radians(66.0)  # central Europe
EARTH = np.array([0.0, math.cos(INCLINATION_RAD), -math.sin(INCLINATION_RAD)])  # east, north, up
WAVES = 12
WAVELENGTH_M = (3.0, 15.0)
DISTURBANCE = 0.05  # rms of each component: 7 degrees of heading


class Magnetism:
    """One building's field."""

    def __init__(self, rng: np.random.Generator) -> None:
        angle, phase = rng.uniform(0.0, 2.0 * math.pi, (2, WAVES))
        number = 2.0 * math.pi / rng.uniform(*WAVELENGTH_M, WAVES)
        self._waves = number * np.stack([np.cos(angle), np.sin(angle)])
        self._phase = phase
        self._size = DISTURBANCE * math.sqrt(2.0 / WAVES) * rng.standard_normal((WAVES, 3))

    def field(self, xy_m: Floats) -> Floats:
        """Field (n, 3) east, north, up at places (n, 2)."""
        found: Floats = EARTH + np.sin(xy_m @ self._waves + self._phase) @ self._size
        return found
