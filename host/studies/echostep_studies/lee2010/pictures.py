# SPDX-License-Identifier: MIT
"""One run of each experiment of [Lee 2010] as pictures of the kind of its Figures 6, 7 and 8.

In: a seed. Out: `figure6.png` (lap), `figure7.png` (pressure on the way down), `figure8.png` (3D track). Owns nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from echostep.arrays import Floats
from echostep_app.simulation.people.walker import Walk
from echostep_studies.frame.pictures import save
from echostep_studies.lee2010.methods import METHODS, MethodTrack, floors_of, with_plan
from echostep_studies.lee2010.walks import (
    STOREY_M,
    STOREYS,
    MeasuredWalk,
    chunks_of,
    descent_of,
    lap_of,
    lap_plan,
    measure,
    start_of,
    storeys,
)

STYLES: dict[str, dict[str, Any]] = {
    "truth": {"color": "#d55e00", "linewidth": 1.2, "label": "the way (truth)"},
    "lee2010": {"color": "#0072b2", "linewidth": 1.4, "label": "lee2010"},
    "default": {"color": "#009e73", "linewidth": 1.4, "linestyle": "--", "label": "default, ours"},
    "default+plan": {
        "color": "#cc79a7",
        "linewidth": 1.4,
        "linestyle": ":",
        "label": "default with the plan and echoes",
    },
}


def draw(folder: Path, seed: int) -> None:
    """Draw the run of this seed; raises EchostepError when a file cannot be written."""
    lap, descent = lap_of(seed), descent_of(seed)
    down = measure(chunks_of(descent, storeys(), seed), seed)
    floors = floors_of(down.pressure)
    plan = lap_plan()
    chunks = chunks_of(lap, plan.levels, seed)
    round_ = measure(chunks, seed)
    tracks = _tracks(lap, round_) | {"default+plan": with_plan(plan, chunks, round_, start_of(lap), seed)}
    _lap(folder / "figure6.png", lap, tracks)
    _pressure(folder / "figure7.png", down.pressure, descent)
    _three(folder / "figure8.png", descent, _tracks(descent, down), floors)


def _tracks(walked: Walk, measured: MeasuredWalk) -> dict[str, MethodTrack]:
    return {name: method(measured, start_of(walked)) for name, method in METHODS.items()}


def _figure(size_inches: tuple[float, float]) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size_inches, dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _lap(path: Path, lap: Walk, tracks: dict[str, MethodTrack]) -> None:
    figure = _figure((8.0, 6.6))
    axes = figure.subplots()
    axes.plot(*lap.trunk_m[::50].T, **STYLES["truth"])
    for name, method in tracks.items():
        axes.plot(*method.track[:, 1:].T, **STYLES[name])
        axes.plot(*method.track[-1, 1:], "o", color=STYLES[name]["color"])
    axes.plot(*lap.trunk_m[0], "k^", label="start")
    axes.set(title="40 x 30 m (after Figure 6), simulated", xlabel="x / m", ylabel="y / m", aspect="equal")
    _finish(figure, axes, path)


def _pressure(path: Path, pressure: Floats, descent: Walk) -> None:
    figure = _figure((8.0, 4.6))
    axes = figure.subplots()
    axes.plot(pressure[:, 0], pressure[:, 1] / 100.0, color="#0072b2", linewidth=0.8, label="pressure")
    height = axes.twinx()
    height.step(
        descent.t_s[::100],
        np.rint(descent.height_m[::100] / STOREY_M) + 1,
        color="#d55e00",
        linewidth=1.0,
        label="floor (truth)",
    )
    height.set(ylabel="floor", yticks=range(1, STOREYS + 1))
    height.invert_yaxis()
    axes.set(
        title="From the 5th floor to the 1st (after Figure 7), simulated", xlabel="time / s", ylabel="pressure / hPa"
    )
    _finish(figure, axes, path)


def _three(path: Path, descent: Walk, tracks: dict[str, MethodTrack], floors: Floats) -> None:
    figure = _figure((8.5, 6.5))
    axes = figure.add_subplot(projection="3d")
    axes.plot(*descent.trunk_m[::100].T, descent.height_m[::100] - (STOREYS - 1) * STOREY_M, **STYLES["truth"])
    for name, method in tracks.items():
        at = np.minimum(np.searchsorted(floors[:, 0], method.track[:, 0]), len(floors) - 1)
        axes.plot(*method.track[:, 1:].T, (floors[at, 1] - (STOREYS - 1)) * STOREY_M, **STYLES[name])
    axes.set(title="Place and floor (after Figure 8), simulated", xlabel="x / m", ylabel="y / m", zlabel="z / m")
    axes.set_box_aspect((4.0, 2.0, 2.0))
    _finish(figure, axes, path)


def _finish(figure: Any, axes: Any, path: Path) -> None:
    axes.legend(fontsize=9)
    axes.grid(alpha=0.25)
    save(figure, path)
