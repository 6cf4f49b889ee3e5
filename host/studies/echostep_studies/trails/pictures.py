# SPDX-License-Identifier: MIT
"""The trails as pictures, after Figures 3-6 of [Fischer 2008].

In: a seed. Out: `trail-<name>.png` for each trail and `trails.png` with all. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from echostep_studies.frame.pictures import save
from echostep_studies.simulation.fischer_trails import TRAILS, Trail, measure_trail, walk_trail
from echostep_studies.trails.walks import METHODS, RATES_HZ, JudgedTrack, judge, track

# Told apart by the colour-blind [Okabe and Ito 2008], and by their lines.
TRUTH = {"color": "#009e73", "linewidth": 5, "alpha": 0.35, "label": "the way"}
STYLES: dict[str, dict[str, Any]] = {
    "fischer2008": {
        "color": "#d55e00",
        "linewidth": 1.2,
        "marker": ".",
        "markersize": 4,
        "label": "fischer2008 (end: dot)",
    },
    "default": {"color": "#0072b2", "linewidth": 1.2, "linestyle": "--", "label": "default, ours (end: dot)"},
}
MACHINES = {"color": "black", "marker": "X", "markersize": 7, "linestyle": "none", "label": "machine"}
TITLES = {
    "line": "Straight line, 88 m (Figure 3)",
    "l": "L, 54 m (Figure 4)",
    "rectangle": "Rectangle, 11.5 m",
    "offices": "Corridor with offices, 140 m (Figure 5)",
    "workshop": "Workshop, 200 m",
    "machinery": "Corridor by machinery, 220 m (Figure 6)",
}


def draw_trails(folder: Path, seed: int) -> None:
    """One run of every trail, each in a picture of its own and all in one; raises EchostepError when a file cannot be written."""
    walks = {trail.name: _walks(trail, seed) for trail in TRAILS}
    for trail in TRAILS:
        _draw(folder / f"trail-{trail.name}.png", (trail,), walks, _size_inches(trail, walks[trail.name]))
    _draw(folder / "trails.png", TRAILS, walks, (15.0, 17.0))


def _walks(trail: Trail, seed: int) -> dict[str, JudgedTrack]:
    walked = walk_trail(trail, seed)
    samples = measure_trail(trail, walked, RATES_HZ[0], seed)
    return {profile: judge(track(samples, profile), walked) for profile in METHODS}


def _size_inches(trail: Trail, walks: dict[str, JudgedTrack]) -> tuple[float, float]:
    """Of a picture nine inches wide that suits the trail's shape."""
    places = np.vstack(
        [[waypoint[:2] for waypoint in trail.waypoints], *(walked.places_m for walked in walks.values())]
    )
    width, height = np.ptp(places, axis=0)
    return 9.0, 1.5 + min(max(8.2 * height / width, 2.0), 7.0)


def _draw(
    path: Path, some: tuple[Trail, ...], walks: dict[str, dict[str, JudgedTrack]], size_inches: tuple[float, float]
) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size_inches, dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    columns = min(2, len(some))
    grid = figure.subplots(-(-len(some) // columns), columns, squeeze=False)
    for axes, trail in zip(grid.ravel(), some, strict=True):
        _draw_trail(axes, trail, walks[trail.name])
        axes.set_aspect("equal", adjustable="box" if len(some) == 1 else "datalim")
    drawn, labels = grid.ravel()[-1].get_legend_handles_labels()
    figure.legend(drawn, labels, loc="outside lower center", ncols=len(labels), fontsize=9)
    save(figure, path)


def _draw_trail(axes: Any, trail: Trail, walks: dict[str, JudgedTrack]) -> None:
    way = np.array([waypoint[:2] for waypoint in trail.waypoints])
    axes.plot(*way.T, **TRUTH)
    if trail.machines:
        axes.plot(*np.array([machine.at_m[:2] for machine in trail.machines]).T, **MACHINES)
    for profile, walked in walks.items():
        axes.plot(*walked.places_m.T, **STYLES[profile])
        axes.plot(*walked.places_m[-1], marker="o", markersize=6, color=STYLES[profile]["color"])
    axes.plot(*way[0], "k^", markersize=7, linestyle="none", label="start")
    axes.set(title=f"{TITLES[trail.name]}, simulated", xlabel="x / m", ylabel="y / m")
    axes.margins(0.08)
    axes.grid(alpha=0.25)
