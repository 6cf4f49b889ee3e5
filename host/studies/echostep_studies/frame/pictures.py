# SPDX-License-Identifier: MIT
"""Pictures of the studies, for people: PNG, and PDF beside it; colours that the colour-blind can tell apart [Okabe and Ito 2008].

In: what a study has seen. Out: files. Owns nothing. matplotlib is loaded when a picture is drawn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echostep.arrays import Floats
from echostep_app.output.table import console
from echostep_app.printing.lines import as_error
from echostep_app.printing.picture_files import save_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


BLACK, ORANGE, BLUE, RED = "#000000", "#e69f00", "#0072b2", "#d55e00"


def draw_clouds(
    path: Path, walls: Floats, truth: Floats, clouds: Mapping[str, Mapping[int, Floats]], tracks: Mapping[str, Floats]
) -> None:
    """[Girard 2011, Figures 10-13]: a row a system, a column a number of steps.

    `clouds[system][step]` is (n, 2), `tracks[system]` and `truth` are (steps + 1, 2).
    """
    steps = sorted({step for seen in clouds.values() for step in seen})
    figure, axes = axes_of(len(clouds), len(steps), (4.6 * len(steps), 3.6 * len(clouds)))
    for row, (system, seen) in zip(axes, clouds.items(), strict=True):
        for ax, step in zip(row, steps, strict=True):
            _walls(ax, walls)
            ax.plot(*truth[: step + 1].T, color="0.6", lw=1.2, label="way walked")
            ax.plot(*tracks[system][: step + 1].T, color=BLUE, lw=1.0, marker="s", ms=2.5, label="estimates")
            ax.plot(*seen[step].T, ".", color=ORANGE, ms=2.5, label="cloud", zorder=3)
            ax.plot(*truth[step], "o", mfc="none", mec=RED, ms=11, mew=1.8, label="true place", zorder=4)
            off = float(np.hypot(*(tracks[system][step] - truth[step])))
            ax.set_title(f"{system}, {step} steps: {off:.2f} m off", fontsize=10)
    axes[0][0].legend(loc="upper left", fontsize=8, framealpha=0.9)
    figure.suptitle("Simulated: the experiment of Girard et al. 2011 (their Figures 10-13)")
    save(figure, path)


def _walls(ax: Axes, walls: Floats) -> None:
    """A plan, to scale."""
    from matplotlib.collections import LineCollection

    ax.add_collection(LineCollection(list(walls.reshape(-1, 2, 2)), colors=BLACK, linewidths=1.3))
    low, high = walls.reshape(-1, 2).min(0), walls.reshape(-1, 2).max(0)
    ax.set_xlim(low[0] - 0.7, high[0] + 0.7)
    ax.set_ylim(low[1] - 0.7, high[1] + 0.7)
    ax.set_aspect("equal")
    ax.set_xlabel("x / m", fontsize=7)
    ax.set_ylabel("y / m", fontsize=7)
    ax.tick_params(labelsize=7)


def axes_of(rows: int, columns: int, inches: tuple[float, float]) -> tuple[Figure, Sequence[Sequence[Axes]]]:
    """A figure of rows x columns axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=inches, dpi=110, layout="constrained")
    axes: Any = figure.subplots(rows, columns, squeeze=False)
    return figure, axes


def save(figure: Figure, path: Path) -> None:
    """Write a PNG, and a PDF beside it, and print where; raises EchostepError when that is not possible."""
    with as_error(f"{path}: cannot write the picture"):
        path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".pdf")
    for written in (path, beside):
        save_picture(figure, written, private=False)
    console.print(f"picture: {path}, {beside.name}", markup=False, highlight=False, soft_wrap=True)
