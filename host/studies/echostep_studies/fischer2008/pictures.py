# SPDX-License-Identifier: MIT
"""The picture of the guided returns: success over each parameter that was varied.

In: rows. Out: a PNG. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from echostep_studies.frame.pictures import BLUE, ORANGE, axes_of, save

LABELS = {
    "place_sd_m": "standard deviation of the beacons' places (m)",
    "axis_sd_deg": "standard deviation of the beacons' orientations (degrees)",
    "reach_m": "beacons' range (m)",
    "spacing_m": "distance between beacons (m)",
    "outliers": "share of ranges with 3 m added",
    "period_s": "time between measurements (s)",
}


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
