# SPDX-License-Identifier: MIT
"""A picture of a drawing: the plan as `plan show` draws it, and the path on it.

In: a plan, a path. Out: a file. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from echostep.arrays import Floats
from echostep.plan import Level, Plan
from echostep_app.plan.pictures.drawing import Layer, plan_figure, texts_of
from echostep_app.plan.pictures.labels import fonts_for
from echostep_app.printing.picture_files import check_picture, save_picture

PATH, TRUE = "#0072b2", "#e69f00"


def draw_picture(path: Path, plan: Plan, walked_m: Sequence[Sequence[Floats]], built: Sequence[Level] = ()) -> None:
    """Draw each level and the paths (n, 2) on it, over the true walls of the level where they are known. Raises EchostepError."""
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    def draw(axes: Any, level: int) -> None:
        for path_m in walked_m[level]:
            axes.plot(*path_m.T, color=PATH, linewidth=0.7)
        if built:
            axes.add_collection(LineCollection(list(built[level].walls.reshape(-1, 2, 2)), colors=TRUE, linewidths=3.0))

    check_picture(path)
    legend = [Line2D([], [], color=PATH, label="path"), *[Line2D([], [], color=TRUE, label="true wall")] * bool(built)]
    levels = range(len(plan.levels))
    with fonts_for(texts_of(plan, levels)):
        save_picture(plan_figure(plan, levels, layer=Layer(draw, legend, plan.name)), path)
