"""track.csv and track.png: a run to keep and to look at.

In: a plan, estimates, the truth where known. Out: two files. Owns nothing.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from echostep.estimate import Estimate
from echostep.foot import Track
from echostep.plan import Level
from echostep.truth import Truth

COLUMNS = ("t_s", "x_m", "y_m", "heading_rad", "xx_m2", "xy_m2", "yy_m2", "heading_sd_rad", "step", "status")
TRUTH_COLOUR, TRACK_COLOUR = "#009e73", "#0072b2"  # told apart by the colour-blind [Okabe and Ito 2008]


def write_track(path: Path, estimates: Sequence[Estimate]) -> None:
    """All estimates as CSV; numbers are written so that they read back to the same bits."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows([getattr(e, name) for name in COLUMNS] for e in estimates)


def draw_track(path: Path, level: Level, estimates: Sequence[Estimate], truth: Truth | None, title: str) -> None:
    """Plan, truth, estimate and 95 % ellipses as a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Ellipse as Patch

    figure = Figure(figsize=(10, _height(level)), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot(aspect="equal", title=title, xlabel="x / m", ylabel="y / m")
    axes.add_collection(LineCollection(list(level.walls.reshape(-1, 2, 2)), colors="#444444", linewidths=1.2))
    for room in level.rooms:
        axes.text(*room.at_m, room.name, ha="center", va="center", color="#888888", fontsize=8)
    if truth is not None:
        axes.plot(*truth.xy_m.T, color=TRUTH_COLOUR, linewidth=4, alpha=0.45, label="truth")
    for e in _spread(estimates, 60):
        ellipse = e.ellipse95
        patch = Patch(
            (e.x_m, e.y_m),
            2 * ellipse.major_m,
            2 * ellipse.minor_m,
            angle=math.degrees(ellipse.angle_rad),
            facecolor=TRACK_COLOUR,
            alpha=0.15,
        )
        axes.add_patch(patch)
    track = np.array([(e.x_m, e.y_m) for e in estimates]).reshape(-1, 2)
    axes.plot(*track.T, color=TRACK_COLOUR, linewidth=1, marker=".", markersize=4, label="estimate, 95 % ellipses")
    axes.autoscale_view()
    axes.legend(loc="upper right", fontsize=8)
    figure.savefig(path)


def draw_foot(path: Path, track: Track, title: str) -> None:
    """The foot's way from above and its height over time, stances as dots, as a PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    above, side = figure.subplots(2, 1, height_ratios=(3, 1))
    x, y, z = track.position_m.T
    above.plot(x, y, color=TRACK_COLOUR, linewidth=1)
    above.plot(x[track.stance], y[track.stance], ".", color=TRUTH_COLOUR, markersize=3, label="foot stands")
    above.plot(x[:1], y[:1], "k^", label="start")
    above.set(aspect="equal", title=title, xlabel="x / m", ylabel="y / m")
    above.legend(fontsize=8)
    side.plot(track.t_s, z, color=TRACK_COLOUR, linewidth=1)
    side.set(xlabel="t / s", ylabel="height / m")
    figure.savefig(path)


def _height(level: Level) -> float:
    """Inches that suit the plan's shape at a width of ten."""
    if not len(level.walls):
        return 6.5
    width, height = np.ptp(level.walls.reshape(-1, 2), axis=0)
    return float(np.clip(1.0 + 9.2 * height / max(width, 1e-9), 4.0, 12.0))


def _spread(estimates: Sequence[Estimate], most: int) -> Sequence[Estimate]:
    """At most so many of them, evenly."""
    return estimates[:: max(1, len(estimates) // most)]
