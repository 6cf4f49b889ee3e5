# SPDX-License-Identifier: MIT
"""A picture of a drawing: walls, openings, the floor that was walked.

In: a plan, a path. Out: a file. Owns the colours.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Level, Plan
from echostep_app.plan.pictures.drawing import DOOR, OBSTACLE, WALL
from echostep_app.printing.picture_files import check_picture, save_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PATH = "#0072b2"
TRUE = "#e69f00"
WIDE_IN, HIGHEST = 12.0, 1.4  # width in inches; greatest ratio of height to width
TRUNK_M = 0.5  # width of the floor that a person walks on


def draw_picture(path: Path, plan: Plan, walked_m: Sequence[Sequence[Floats]], built: Sequence[Level] = ()) -> None:
    """Draw each level and the paths (n, 2) on it, over the true walls of the level where they are known. Raises EchostepError."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    check_picture(path)
    points = [paths for paths_of in walked_m for paths in paths_of]
    points += [level.walls.reshape(-1, 2) for level in (*plan.levels, *built)]
    low, high = np.concatenate(points).min(0) - 0.5, np.concatenate(points).max(0) + 0.5
    count = len(plan.levels)
    shape = min(count * (high[1] - low[1]) / (high[0] - low[0]), HIGHEST)
    figure = Figure(figsize=(WIDE_IN, WIDE_IN * shape + 0.4), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    for k, level in enumerate(reversed(plan.levels)):
        axes = figure.add_subplot(count, 1, k + 1, aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        _draw_level(axes, level, walked_m[count - 1 - k], built[count - 1 - k] if built else None)
        if count > 1:
            axes.set_title(f"floor {level.name}, {level.height_m:+.1f} m", fontsize="small")
    save_picture(figure, path)


def _draw_level(axes: Axes, level: Level, walked_m: Sequence[Floats], built: Level | None) -> None:
    from matplotlib.collections import LineCollection

    low, high = axes.get_xlim()
    points_m = 72.0 * WIDE_IN / (high - low)
    for k, path_m in enumerate(walked_m):
        axes.plot(*path_m.T, color=PATH, alpha=0.12, linewidth=TRUNK_M * points_m, solid_capstyle="round")
        axes.plot(*path_m.T, color=PATH, linewidth=0.7, label="" if k else "path")
    if built is not None:
        axes.add_collection(LineCollection(_lines(built.walls), colors=TRUE, linewidths=3.0, label="true walls"))
        for outline in built.obstacles:
            axes.fill(*outline.T, color=OBSTACLE)
    axes.add_collection(LineCollection(_lines(level.walls), colors=WALL, linewidths=1.6, label="drawn"))
    if len(level.doubtful):
        doubtful = LineCollection(
            _lines(level.doubtful), colors=WALL, linewidths=0.8, linestyles="--", label="doubtful"
        )
        axes.add_collection(doubtful)
    doors = np.array([door.line for door in level.doors if door.state == "open"]).reshape(-1, 4)
    axes.add_collection(
        LineCollection(_lines(doors), colors=DOOR, linewidths=1.2, linestyles=":", label="walked through")
    )
    axes.legend(loc="upper right", fontsize="small")
    axes.set(xlabel="x / m", ylabel="y / m")


def _lines(segments: Floats) -> list[Floats]:
    """Segments (n, 4) as lines of two points."""
    return list(segments.reshape(-1, 2, 2))
