# SPDX-License-Identifier: MIT
"""A picture of each log's plans with its path, to see whether they look like the building.

In: a `LogBuilding`. Out: NAME.png. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path

from matplotlib.collections import LineCollection

from echostep_studies.bench.laser.building import LogBuilding
from echostep_studies.frame.pictures import BLACK, BLUE, axes_of, save


def draw_plans(folder: Path, building: LogBuilding) -> None:
    """Both plans side by side, and the way of the scans."""
    figure, axes = axes_of(1, len(building.plans), (8.0 * len(building.plans), 8.0))
    for ax, (name, plan) in zip(axes[0], building.plans.items(), strict=True):
        walls = plan.levels[0].walls
        ax.add_collection(LineCollection(list(walls.reshape(-1, 2, 2)), colors=BLACK, linewidths=1.0, label="walls"))
        ax.plot(*building.log.pose[:, :2].T, color=BLUE, lw=0.6, label="way of the scans")
        ax.set(aspect="equal", xlabel="x / m", ylabel="y / m")
        ax.legend(loc="upper right", fontsize=8)
        ax.set_title(f"{building.log.name}/{name}: {len(walls)} segments; {building.odometry.source}", fontsize=10)
    save(figure, folder / f"{building.log.name}.png")
