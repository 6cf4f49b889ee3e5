# SPDX-License-Identifier: MIT
"""What is wrong with a plan: one finding of its check, and storeys of a drawing whose places are not known to a room.

In: a plan. Out: `PlanFinding`; a sentence for each storey that is refused. Owns the words.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.plan import Plan

Lines = tuple[tuple[float, float, float, float], ...]


@dataclass(frozen=True, slots=True)
class PlanFinding:
    """One error in a plan: its kind, level (index), position, description, and the lines that it concerns."""

    kind: str
    level: int
    position_m: tuple[float, float]
    text: str
    lines_m: Lines = ()
    number: int = 0


def refusals(plan: Plan) -> list[str]:
    """A sentence for each storey that is refused as a plan; none for a plan that was not drawn by a walk."""
    return [
        f"floor {level.name} of {plan.name} is refused as a plan: the places of its walls are known to "
        f"{float(np.median(level.place_sd[:, 2])):.1f} m only (1 sd); draw it again by a walk that comes back to known places"
        for level in plan.levels
        if level.is_refused
    ]
