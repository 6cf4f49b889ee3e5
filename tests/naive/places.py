# SPDX-License-Identifier: MIT
"""Slow, obviously right twin of the places of a cloud."""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.elementary import mean_angle
from echostep.localization.particles.places import LEAST_PROBABILITY, MOST_PLACES
from echostep.particles.limits import ROOM_M

Place = tuple[float, float, float, int, float, float]  # probability, x, y, level, standard deviation, heading


def places(x_m: Floats, y_m: Floats, level: Ints, heading_rad: Floats, weight: Floats) -> list[Place]:
    """The places about the heaviest square metres, one after the other, the likeliest first."""
    square = np.column_stack([np.floor(x_m), np.floor(y_m), level])
    left, found = weight.copy(), list[Place]()
    while len(found) < MOST_PLACES:
        each, member = np.unique(square, axis=0, return_inverse=True)
        heaviest = int(np.bincount(member.ravel(), left, len(each)).argmax())
        inside = (member.ravel() == heaviest) & (left > 0.0)
        if not inside.any():
            break
        at_x, at_y = np.average(x_m[inside], weights=left[inside]), np.average(y_m[inside], weights=left[inside])
        near = (np.hypot(x_m - at_x, y_m - at_y) < ROOM_M) & (level == level[inside][0]) & (left > 0.0)
        total = float(left[near].sum())
        if total < LEAST_PROBABILITY:
            break
        share = left[near] / total
        x, y = float(share @ x_m[near]), float(share @ y_m[near])
        square_m2 = float(share @ ((x_m[near] - x) ** 2 + (y_m[near] - y) ** 2))
        heading = mean_angle(heading_rad[near], share)
        found.append((total, x, y, int(level[inside][0]), float(np.sqrt(0.5 * square_m2)), heading))
        left[near] = 0.0
    return sorted(found, key=lambda place: -place[0])
