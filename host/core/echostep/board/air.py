# SPDX-License-Identifier: MIT
"""Speed of sound between the rangers and the walls, by the temperature that the board's barometer measures.

In: rows of `Pressure`. Out: speeds in m/s. Owns the temperature in force. It changes in steps: noise, and a part that warms itself by a degree
or two, change nothing, and an error of one step is 1 cm in 3 m. In dry air; humid air is up to 0.3 % faster.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats, Ints
from echostep.board.calibration import SPEED_OF_SOUND_M_S

CELSIUS = 0.05  # per count of `Pressure`
USUAL_C = 20.0  # before the first sample
STEP_C = 2.0  # of the mean temperature; assumed
WEIGHT = 1.0 / 16.0  # of a sample in that mean: about 2 s
COLDEST_C, WARMEST_C = -40.0, 85.0  # in which the barometers work [BST-BMP390-DS002, table 2]


def sound_m_s(celsius: float) -> float:
    """Speed of sound in dry air, an ideal gas."""
    return 331.3 * math.sqrt(1.0 + celsius / 273.15)


class Air:
    """Call `speeds` with the barometer's samples in order; a speed above zero as setting overrides them."""

    def __init__(self, fixed_m_s: float) -> None:
        self._fixed = fixed_m_s > 0.0
        self._celsius = USUAL_C
        self._mean_c = math.nan
        self.speed_m_s = fixed_m_s if self._fixed else SPEED_OF_SOUND_M_S  # newest

    def speeds(self, at: Ints, row: Ints, samples: NDArray[np.void]) -> Floats:
        """Speeds (n,) at messages with the row numbers `at` (n,), of samples (m,) with the row numbers `row` (m,), both ascending."""
        after = [self.speed_m_s, *map(self._take, (CELSIUS * samples["temperature"]).tolist())]
        return np.array(after)[np.searchsorted(row, at)]

    def _take(self, celsius: float) -> float:
        """The speed in force after a sample of the temperature."""
        if not self._fixed and COLDEST_C <= celsius <= WARMEST_C:
            old = celsius if math.isnan(self._mean_c) else self._mean_c
            self._mean_c = old + WEIGHT * (celsius - old)
            if abs(self._mean_c - self._celsius) > STEP_C:
                self._celsius = self._mean_c
                self.speed_m_s = sound_m_s(self._celsius)
        return self.speed_m_s
