# SPDX-License-Identifier: MIT
"""One finding of the check of a plan.

In: nothing. Out: `PlanFinding`. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

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
