# SPDX-License-Identifier: MIT
"""Stanford diagrams: the error of each claim against its protection radius [Tossaint et al. 2007, The Stanford-ESA integrity diagram].

In: rows of runs. Out: a PNG file with a diagram a row of the table. Owns nothing. Claims above the diagonal (error below radius) are safe.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echostep.arrays import Floats
from echostep_studies.bench.columns import ClaimsRow, JudgedRow
from echostep_studies.frame.pictures import BLACK, BLUE, ORANGE, RED, axes_of, save
from echostep_studies.frame.report import rows_by_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RANGE_M = (0.01, 100.0)  # of both axes
ACROSS = 4  # diagrams side by side
INCHES = 3.2


def draw_stanford(folder: Path, rows: Sequence[ClaimsRow]) -> None:
    """`stanford.png` in a folder: a diagram for each name of the rows of runs that were judged."""
    groups = [group for group in rows_by_name(row for row in rows if isinstance(row, JudgedRow)) if group[0].error_m]
    if not groups:
        return
    down = -(-len(groups) // ACROSS)
    figure, axes = axes_of(down, ACROSS, (INCHES * ACROSS, INCHES * down))
    for k, ax in enumerate(ax for line in axes for ax in line):
        if k >= len(groups):
            ax.set_axis_off()
            continue
        error, radius = (
            np.concatenate([getattr(run, key) for run in groups[k]]) for key in ("error_m", "protection_m")
        )
        beyond = error > radius
        _draw_claims(ax, error, radius)
        ax.axvline(1.0, color=ORANGE, lw=0.8)
        ax.set_title(f"{groups[k][0].name}: {100.0 * beyond.mean():.2f} % beyond", fontsize=8)
        ax.set_xlabel("error (m)", fontsize=7)
        ax.set_ylabel("protection radius (m)", fontsize=7)
        ax.tick_params(labelsize=6)
    save(figure, folder / "stanford.png")


def _draw_claims(axes: Axes, error_m: Floats, radius_m: Floats) -> None:
    """Errors (n,) against stated radii (n,): above the diagonal the radius holds."""
    beyond = error_m > radius_m
    for which, colour, mark in ((~beyond, BLUE, "."), (beyond, RED, "x")):
        x, y = error_m[which].clip(*RANGE_M), radius_m[which].clip(*RANGE_M)
        axes.plot(x, y, mark, ms=2.0, alpha=0.4, color=colour, zorder=2)
    axes.plot(RANGE_M, RANGE_M, color=BLACK, lw=1.0)
    axes.set(xscale="log", yscale="log", xlim=RANGE_M, ylim=RANGE_M)
