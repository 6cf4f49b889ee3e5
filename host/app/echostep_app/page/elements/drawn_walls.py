# SPDX-License-Identifier: MIT
"""The walls and the floor that a walk without a plan has shown so far, laid where the page shows the wearer.

In: a drawing in the frame of the walk, and the estimate at its newest place. Out: `ShownDrawing` in map metres. Owns how much of it a page gets.
The tracker's own path drifts, the drawing's is corrected by its returns: they meet at the wearer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.localization import Estimate
from echostep_app.mapping.graph.levels import BETWEEN

if TYPE_CHECKING:
    from echostep_app.mapping.mapper import Mapped

MOST_WALLS, MOST_POINTS = 2000, 4000  # in a message; of more walls those nearest to the wearer: 72 KB


@dataclass(frozen=True, slots=True)
class WalkDrawing:
    """The newest level in the frame of the walk: `walls` (n, 5) of x0, y0, x1, y1 and the standard deviation across, `path_m` (k, 2), NaN where it
    leaves the level, the last `pose` (3,) of the walk.
    """

    walls: Floats
    path_m: Floats
    pose: Floats


@dataclass(frozen=True, slots=True)
class ShownDrawing:
    """A drawing up to `t_s`: `walls` (n, 5) and `path` (k, 2), map metres. `trail_count`: points of the trail up to then."""

    t_s: float
    walls: NDArray[np.float32]
    path: NDArray[np.float32]
    trail_count: int


NO_DRAWING = ShownDrawing(0.0, np.zeros((0, 5), np.float32), np.zeros((0, 2), np.float32), 0)


def walk_drawing(mapped: Mapped) -> WalkDrawing:
    """The part of a drawing that a page shows."""
    pose = mapped.graph.pose
    level = mapped.graph.level_of(np.arange(len(pose)))
    newest = int(level[level != BETWEEN][-1])
    drawing = mapped.drawings[newest]
    walls = drawing.all_walls
    middle = 0.5 * (walls[:, 0:2] + walls[:, 2:4]) - pose[-1, :2]
    nearest = np.argsort(np.hypot(*middle.T), kind="stable")[:MOST_WALLS]
    thinned = np.linspace(0, len(pose) - 1, min(len(pose), MOST_POINTS)).round().astype(np.int64)
    path = np.where((level == newest)[thinned, None], pose[thinned, :2], np.nan)
    return WalkDrawing(walls[np.sort(nearest)], path, pose[-1].copy())


def shown_drawing(drawing: WalkDrawing, estimate: Estimate, trail_count: int) -> ShownDrawing:
    """The drawing, moved and turned so that its last pose is the estimate."""
    turn = estimate.heading_rad - float(drawing.pose[2])
    c, s = math.cos(turn), math.sin(turn)
    turned, place = np.array([[c, s], [-s, c]]), np.array([estimate.x_m, estimate.y_m])

    def moved(points: Floats) -> Floats:
        moved_m: Floats = (points - drawing.pose[:2]) @ turned + place
        return moved_m

    ends = moved(drawing.walls[:, :4].reshape(-1, 2)).reshape(-1, 4)
    walls = np.column_stack([ends, drawing.walls[:, 4]]).astype(np.float32)
    return ShownDrawing(estimate.t_s, walls, moved(drawing.path_m).astype(np.float32), trail_count)
