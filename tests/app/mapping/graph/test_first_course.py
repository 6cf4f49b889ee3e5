# SPDX-License-Identifier: MIT
"""How a drawing lies to the recorded heading of the start."""

from __future__ import annotations

import math

import numpy as np
import pytest

from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose
from echostep_app.mapping.mapper import map_walk
from echostep_app.mapping.plan import plan_of

# Of the heading at the beginnings of the first strides from their course, as simulated feet have it
TOE_DEG = (-8.0, -7.0, -3.0)


def walk(straight_m: int) -> list[MeasuredSegment]:
    """So many strides of a metre straight on, then a corridor of 40 m to the left."""
    found: list[MeasuredSegment] = []
    courses = [0.0] * straight_m + [0.5 * math.pi] * 40
    for k, course in enumerate(courses):
        after = courses[min(k + 1, len(courses) - 1)]
        toe, next_toe = (math.radians(TOE_DEG[j]) if j < len(TOE_DEG) else 0.0 for j in (k, k + 1))
        t_s = k + np.arange(0.0, 1.0, 0.04)
        heard = np.full(len(t_s), 1.0 if course else math.nan)
        segment = PathSegment(
            k, k + 1.0, math.cos(course), math.sin(course), course + toe, after + next_toe, 0.02, math.radians(0.6), k
        )
        found.append(MeasuredSegment(segment, t_s, np.arange(len(t_s)) % 2, heard))
    return found


@pytest.mark.parametrize("straight_m", [1, 2, 3, 6])
def test_the_drawing_is_turned_by_the_first_strides(straight_m: int) -> None:
    """However soon the wearer turns, the corridor leads north when the first stride is said to lead east, though the toe points 8 degrees off."""
    mapped = map_walk(walk(straight_m))
    plan, _ = plan_of(mapped, Pose(0.0, 0.0, 0.0), "turned")
    x0, y0, x1, y1 = max(plan.levels[0].walls.tolist(), key=lambda w: math.hypot(w[2] - w[0], w[3] - w[1]))
    off = math.atan2(y1 - y0, x1 - x0) % math.pi - 0.5 * math.pi
    assert abs(math.degrees(off)) < 0.5
