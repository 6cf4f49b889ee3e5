# SPDX-License-Identifier: MIT
"""The magnetic field inside a building: the earth's, disturbed from place to place.

In: places, a seeded generator, machines. Out: field vectors in the map frame, in units of the earth's field. Owns the disturbance.
Map north is magnetic north. The disturbance is a sum of plane waves a few metres long, enough to turn a compass by several degrees, as
steel in floors does; a machine nearby is a dipole, and can turn it right round [Fischer 2008].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats

INCLINATION_RAD = math.radians(66.0)  # central Europe
EARTH = np.array([0.0, math.cos(INCLINATION_RAD), -math.sin(INCLINATION_RAD)])  # east, north, up
WAVES = 12
WAVELENGTH_M = (3.0, 15.0)
DISTURBANCE = 0.05  # rms of each component: 7 degrees of heading
EARTH_T = 49e-6  # the unit, in central Europe
DIPOLE_T_M3_A_M2 = 1e-7  # mu0 / 4 pi
SIZE_M = 0.5  # of a machine: nearer than that it is not a dipole


@dataclass(frozen=True, slots=True)
class MagneticDipole:
    """A magnetic dipole: the middle of a machine, `at_m` x, y, z, and its `moment_a_m2` east, north, up; tonnes of steel have 100 to 1000."""

    at_m: tuple[float, float, float]
    moment_a_m2: tuple[float, float, float]


class MagneticField:
    """One building's field."""

    def __init__(self, rng: np.random.Generator, machines: Sequence[MagneticDipole] = ()) -> None:
        self._machines = machines
        angle, phase = rng.uniform(0.0, 2.0 * math.pi, (2, WAVES))
        number = 2.0 * math.pi / rng.uniform(*WAVELENGTH_M, WAVES)
        self._waves = number * np.stack([np.cos(angle), np.sin(angle)])
        self._phase = phase
        self._size = DISTURBANCE * math.sqrt(2.0 / WAVES) * rng.standard_normal((WAVES, 3))

    def field(self, xy_m: Floats, height_m: float = 0.1) -> Floats:
        """Field (n, 3) east, north, up at places (n, 2), at one height above the floor."""
        vectors: Floats = EARTH + np.sin(xy_m @ self._waves + self._phase) @ self._size
        for machine in self._machines:
            vectors += dipole(np.column_stack([xy_m, np.full(len(xy_m), height_m)]), machine)
        return vectors


def dipole(places_m: Floats, machine: MagneticDipole) -> Floats:
    """Field (n, 3) of a dipole at places (n, 3), in units of the earth's field [Jackson 1999, eq. 5.56]."""
    away = places_m - np.array(machine.at_m)
    distance = np.maximum(np.linalg.norm(away, axis=1), SIZE_M)[:, None]
    moment = np.array(machine.moment_a_m2)
    vectors: Floats = (
        DIPOLE_T_M3_A_M2 / EARTH_T * (3.0 * away * (away @ moment)[:, None] / distance**2 - moment) / distance**3
    )
    return vectors
