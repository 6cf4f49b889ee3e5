# SPDX-License-Identifier: MIT
"""track.csv and track.png of a run.

In: a plan, estimates, the true path where it is known. Out: CSV files and pictures. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echostep.aiding import BeaconPlace, BeaconState
from echostep.arrays import Floats
from echostep.localization import Estimate
from echostep.plan import Level, Plan
from echostep_app.plan.routing import Route
from echostep_app.printing.picture_files import save_picture
from echostep_app.scorecard.track_columns import ScoredPath

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MAX_HEIGHT_INCHES = 40.0  # of the picture
NEARBY_S = 2.5  # of the truth from an estimate: they come at each step, and twice a second while standing
GAP_S = 5.0  # the line of the track is broken after so long on another level
MAX_ELLIPSES = 60  # drawn per level
ROUTE_COLOUR, BEACON_COLOUR = "#cc79a7", "#d55e00"
TRUTH_COLOUR, TRACK_COLOUR = "#009e73", "#0072b2"  # distinguishable with colour blindness [Okabe and Ito 2008]


def draw_track(
    path: Path, plan: Plan, estimates: Sequence[Estimate], truth: ScoredPath | None, title: str,
    route: Route | None = None, beacons: Sequence[BeaconPlace] = (),
) -> None:  # fmt: skip
    """Draw plan, true path, route, beacons, estimates and 95 % ellipses as PNG, SVG or PDF, by the ending of the name."""
    save_picture(track_figure(plan, estimates, truth, title, route, beacons), path)


def track_figure(
    plan: Plan, estimates: Sequence[Estimate], truth: ScoredPath | None, title: str,
    route: Route | None = None, beacons: Sequence[BeaconPlace] = (),
) -> Figure:  # fmt: skip
    """The picture: one panel for each visited level, the lowest at the bottom."""
    from matplotlib.figure import Figure

    visited = sorted({e.level for e in estimates}) or [0]
    inches = min(sum(_height(plan.levels[k]) for k in visited), MAX_HEIGHT_INCHES)
    figure = Figure(figsize=(10, inches), dpi=120, layout="constrained")
    figure.suptitle(title, parse_math=False)
    for axes, k in zip(figure.subplots(len(visited), squeeze=False)[::-1, 0], visited, strict=True):
        here = [e for e in estimates if e.level == k]
        _draw_level(axes, plan.levels[k], here, _near(truth, here) if truth else None)
        _draw_guidance(axes, k, route, [b for b in beacons if b.level == k])
        if len(plan.levels) > 1:
            axes.set_title(plan.levels[k].name, loc="left", fontsize=9, parse_math=False)
    return figure


def _near(truth: ScoredPath, estimates: Sequence[Estimate]) -> Floats:
    """True positions (n, 2) near the times of estimates; NaN where no estimate is within NEARBY_S."""
    t_s = np.array([-np.inf, *(e.t_s for e in estimates), np.inf])
    after = np.searchsorted(t_s[:-1], truth.t_s, side="right")
    off_s = np.minimum(truth.t_s - t_s[after - 1], t_s[after] - truth.t_s)
    return np.where((off_s < NEARBY_S)[:, None], truth.xy_m, np.nan)


def _draw_level(axes: Axes, level: Level, estimates: Sequence[Estimate], truth_m: Floats | None) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Ellipse as Patch

    axes.set(aspect="equal", xlabel="x / m", ylabel="y / m")
    axes.add_collection(LineCollection(list(level.solid.reshape(-1, 2, 2)), colors="#444444", linewidths=1.2))
    for room in level.rooms:
        axes.text(*room.at_m, room.name, ha="center", va="center", color="#888888", fontsize=8, parse_math=False)
    if truth_m is not None:
        axes.plot(*truth_m.T, color=TRUTH_COLOUR, linewidth=4, alpha=0.45, label="truth")
    for e in estimates[:: max(1, len(estimates) // MAX_ELLIPSES)]:
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
    track = _with_gaps([(e.t_s, e.x_m, e.y_m) for e in estimates])
    axes.plot(*track.T, color=TRACK_COLOUR, linewidth=1, marker=".", markersize=4, label="estimate, 95 % ellipses")
    axes.autoscale_view()
    axes.legend(loc="upper right", fontsize=8)


def _draw_guidance(axes: Axes, level: int, route: Route | None, beacons: Sequence[BeaconPlace]) -> None:
    """Draw the route, and each beacon with two standard deviations; moved and silent beacons are hollow."""
    from matplotlib.patches import Circle

    for stretch in route.stretches if route else ():
        if stretch.level == level:
            axes.plot(*stretch.line_m.T, color=ROUTE_COLOUR, linewidth=2, linestyle="--", label="route")
    for b in beacons:
        filled = b.state is BeaconState.WELL
        axes.plot(b.x_m, b.y_m, "^", color=BEACON_COLOUR, mfc=BEACON_COLOUR if filled else "none", markersize=6)
        axes.add_patch(Circle((b.x_m, b.y_m), 2.0 * b.sd_m, color=BEACON_COLOUR, alpha=0.15, lw=0))
    if beacons:
        axes.plot([], [], "^", color=BEACON_COLOUR, label="beacons (hollow: moved or silent)")
    if beacons or route:
        axes.legend(loc="upper right", fontsize=8)


def _with_gaps(rows: Sequence[tuple[float, float, float]]) -> Floats:
    """Positions (n, 2) of rows (t_s, x, y), with a row of NaN in each gap longer than GAP_S."""
    table = np.array(rows).reshape(-1, 3)
    breaks = np.flatnonzero(np.diff(table[:, 0]) > GAP_S) + 1
    positions: Floats = np.insert(table[:, 1:], breaks, np.nan, axis=0)
    return positions


def _height(level: Level) -> float:
    """Height (inches) of a panel that is ten inches wide, from the plan's aspect ratio."""
    if not len(level.solid):
        return 6.5
    width, height = np.ptp(level.solid.reshape(-1, 2), axis=0)
    return float(np.clip(1.0 + 9.2 * height / max(width, 1e-9), 4.0, 12.0))
