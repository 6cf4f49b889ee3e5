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


def straight(told: Estimate, x_m: float, y_m: float) -> Guidance:
    """The straight line to a place."""
    dx, dy = x_m - told.x_m, y_m - told.y_m
    distance_m = math.hypot(dx, dy)
    path = ((told.x_m, told.y_m), (x_m, y_m))
    if distance_m <= ARRIVED_M:
        return Guidance("you are there", None, distance_m, path)
    return Guidance(f"straight line: {distance_m:.0f} m", math.atan2(dy, dx), distance_m, path)
