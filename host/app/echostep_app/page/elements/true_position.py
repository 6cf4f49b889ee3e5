# SPDX-License-Identifier: MIT
"""The true position beside the estimate, where it is known: in a simulation, or measured otherwise.

In: rows of the truth. Out: `TruePosition` at a time. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Plan


@dataclass(frozen=True, slots=True)
class TruePosition:
    """Map metres, and the index of a level."""

    x_m: float
    y_m: float
    level: int


@dataclass(frozen=True, slots=True)
class TruePath:
    """`rows` (n, 4): t_s, x, y, height of the floor; `heights_m` (k,) of the plan's levels."""

    rows: Floats
    heights_m: Floats

    @classmethod
    def of(cls, truth: Floats, plan: Plan) -> TruePath:
        """From rows (n, 5) of t_s, x, y, heading_rad, height."""
        return cls(truth[:, [0, 1, 2, 4]], np.array([level.height_m for level in plan.levels]))

    def at(self, t_s: float) -> TruePosition:
        """The position at a time, linear between the rows."""
        t, x, y, z = self.rows.T
        level = int(np.argmin(np.abs(self.heights_m - np.interp(t_s, t, z))))
        return TruePosition(float(np.interp(t_s, t, x)), float(np.interp(t_s, t, y)), level)
