"""Guidance: which way to a destination.

In: an estimate and a place. Out: `Guidance` for people. Owns nothing. This is the straight way; a router over the plan can take its place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from echostep.estimate import Estimate

ARRIVED_M = 1.0


@dataclass(frozen=True, slots=True)
class Guidance:
    """What to do, in words; `arrow_rad` is the direction to go now in the map, `path` the way there as points, the destination last."""

    text: str
    arrow_rad: float | None
    distance_m: float
    path: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Place:
    """A destination: metres in the map, an index into Plan.levels."""

    x_m: float
    y_m: float
    level: int


def straight(told: Estimate, goal: Place) -> Guidance:
    """The straight line to a place."""
    dx, dy, levels = goal.x_m - told.x_m, goal.y_m - told.y_m, goal.level - told.level
    distance_m = math.hypot(dx, dy)
    path = ((told.x_m, told.y_m), (goal.x_m, goal.y_m))
    if distance_m <= ARRIVED_M and not levels:
        return Guidance("you are there", None, distance_m, path)
    climb = f", {abs(levels)} level{'s' if abs(levels) > 1 else ''} {'up' if levels > 0 else 'down'}" if levels else ""
    return Guidance(f"{distance_m:.0f} m in a straight line{climb}", math.atan2(dy, dx), distance_m, path)
