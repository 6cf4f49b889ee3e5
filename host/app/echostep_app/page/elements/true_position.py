# SPDX-License-Identifier: MIT
"""The true position beside the estimate, where it is known: in a simulation, or measured otherwise.

In: the truth. Out: `TruePosition` at a time. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Plan
from echostep_app.scorecard.track_columns import ScoredPath


@dataclass(frozen=True, slots=True)
class TruePosition:
    """Map metres, and the index of a level."""

    x_m: float
    y_m: float
    level: int


@dataclass(frozen=True, slots=True)
class TruePath:
    """`rows` (n, 4): t_s, x, y, index of the level."""

    rows: Floats

    @classmethod
    def of(cls, truth: ScoredPath | None, plan: Plan) -> TruePath | None:
        """Of a true path that was loaded with the plan; None without one, and where it is not known on which level it is."""
        if truth is None or truth.level is None or not np.isin(truth.level, np.arange(len(plan.levels))).all():
            return None
        return cls(np.column_stack([truth.t_s, truth.xy_m, truth.level]))

    def at(self, t_s: float) -> TruePosition:
        """The position at a time, linear between the rows."""
        t, x, y, level = self.rows.T
        row = max(int(np.searchsorted(t, t_s, side="right")) - 1, 0)
        return TruePosition(float(np.interp(t_s, t, x)), float(np.interp(t_s, t, y)), int(level[row]))
