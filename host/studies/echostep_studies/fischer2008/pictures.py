# SPDX-License-Identifier: MIT
"""Pictures of the guided returns: [Fischer 2008, Figures 9 and 10], and success over what was varied.

In: returns and rows. Out: PNG files. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from echostep_app.simulation.world.beacon_ground import BeaconGround
from echostep_studies.fischer2008.simulator import Return
from echostep_studies.frame.pictures import BLACK, BLUE, GREEN, ORANGE, RED, axes_of, save

TITLES = {
    "pdr": "dead reckoning alone (Figure 9)",
    "fischer2008": "the paper's fusion (Figure 10)",
    "default": "particle filter with beacons",
}
LABELS = {
    "place_sd_m": "standard deviation of the beacons' places (m)",
    "axis_sd_deg": "standard deviation of the beacons' orientations (degrees)",
    "reach_m": "beacons' range (m)",
    "spacing_m": "distance between beacons (m)",
    "outliers": "share of ranges with 3 m added",
    "period_s": "time between measurements (s)",
}


def draw_returns(path: Path, world: BeaconGround, returns: Mapping[str, Return]) -> None:
    """One map per system: trail, beacons, magnetic sources, true and estimated path."""
    from matplotlib.patches import Circle

    figure, axes = axes_of(len(returns), 1, (9.0, 4.2 * len(returns)))
    for (ax,), (name, walk) in zip(axes, returns.items(), strict=True):
        for x, y, radius, _ in world.sources:
            ax.add_patch(Circle((float(x), float(y)), float(radius), color=RED, alpha=0.15, lw=0))
        ax.plot(*world.trail.T, color="0.7", lw=5, solid_capstyle="round", label="trail")
        ax.plot(*world.beacons[:, :2].T, "^", color=GREEN, ms=6, label="beacons")
        ax.plot(*walk.truth.T, color=BLACK, lw=1.4, label="true path")
        ax.plot(*walk.believed.T, color=BLUE, lw=1.0, ls="--", marker=".", ms=4, label="estimated path")
        ax.plot(*world.trail[-1], "s", color=ORANGE, ms=9, label="exit")
        result = "exit reached" if walk.arrived else f"exit not reached: ended {walk.end_m:.0f} m from it"
        ax.set_title(f"{TITLES[name]}: {result}", fontsize=10)
        ax.set(aspect="equal", xlabel="x / m", ylabel="y / m")
        ax.tick_params(labelsize=7)
    axes[0][0].legend(loc="upper left", fontsize=8)
    figure.suptitle("Simulated guided returns; red: magnetic sources (after Fischer et al. 2008)")
    save(figure, path)


def draw_sweeps(
    path: Path,
    sweeps: Mapping[str, Sequence[float]],
    nominal: Mapping[str, float],
    rows: Mapping[str, Mapping[str, Any]],
) -> None:
    """Success with its 95 % interval over each parameter, for the paper's fusion and the particle filter."""
    columns = 3
    figure, axes = axes_of(-(-len(sweeps) // columns), columns, (4.2 * columns, 3.2 * -(-len(sweeps) // columns)))
    flat = [ax for line in axes for ax in line]
    for ax, (parameter, values) in zip(flat, sweeps.items(), strict=False):
        for name, colour in (("fischer2008", ORANGE), ("default", BLUE)):
            names = {nominal[parameter]: name} | {v: f"sweep/{parameter}={v:g}/{name}" for v in values}
            points = [(v, rows[row]) for v, row in sorted(names.items()) if row in rows]
            x = [v for v, _ in points]
            y = np.array([100.0 * row["success"] for _, row in points])
            low = np.maximum(y - [100.0 * row["low95"] for _, row in points], 0.0)
            high = np.maximum([100.0 * row["high95"] for _, row in points] - y, 0.0)
            ax.errorbar(x, y, [low, high], color=colour, marker="o", ms=4, capsize=3, lw=1.2, label=name)
        ax.set_xlabel(LABELS[parameter], fontsize=8)
        ax.set_ylim(-3.0, 103.0)
        ax.tick_params(labelsize=7)
    flat[0].set_ylabel("exit reached (%)", fontsize=8)
    flat[0].legend(fontsize=8)
    figure.suptitle("Simulated: guided returns as beacons get worse, 95 % intervals")
    save(figure, path)
