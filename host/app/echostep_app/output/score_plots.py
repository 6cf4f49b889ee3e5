# SPDX-License-Identifier: MIT
"""Pictures of scores: distribution of the errors, errors on the plan, Stanford diagrams.

In: `Scored` tracks, a plan. Out: matplotlib figures. Owns nothing. Colours that the colour-blind can tell apart [Okabe and Ito 2008]; lines
differ in their dashes too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from echostep.arrays import Floats
from echostep.plan import Plan
from echostep_app.scorecard.card import Scored

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLACK, ORANGE, BLUE, RED, GREEN, PURPLE, SKY = (
    "#000000", "#e69f00", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9",
)  # fmt: skip
LINES = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK)
DASHES = ("-", "--", "-.", ":")
SHARES = (0.5, 0.75, 0.95)  # marked in the distribution: CE50, the third quartile, CE95
RANGE_M = (0.01, 100.0)  # of both axes of a Stanford diagram
MOST_POINTS = 4000  # drawn of a track
ONE_PANEL_INCHES = (7.5, 4.2)
GREATEST_INCHES, LEAST_INCHES = 9.0, 2.2  # height of a panel that shows a level


def draw_distribution(scored: Sequence[Scored], names: Sequence[str]) -> Figure:
    """Share of the horizontal errors below each error, a line a track."""
    figure, (axes,) = _figure(1, *ONE_PANEL_INCHES)
    for k, (one, name) in enumerate(zip(scored, names, strict=True)):
        error = np.sort(one.matched.error_m)
        share = np.arange(1, len(error) + 1) / len(error)
        style: Any = {"color": LINES[k % len(LINES)], "linestyle": DASHES[k // len(LINES) % len(DASHES)]}
        axes.plot(np.concatenate(([0.0], error)), np.concatenate(([0.0], share)), drawstyle="steps-post", **style)
        axes.plot([], [], label=f"{name}: CE50 {one.card.ce50_m:.2f} m, CE95 {one.card.ce95_m:.2f} m", **style)
    for mark in SHARES:
        axes.axhline(mark, color="0.8", lw=0.8, zorder=0)
        axes.text(1.005, mark, f"{100 * mark:.0f} %", transform=axes.get_yaxis_transform(), va="center", fontsize=8)
    axes.set(xlabel="horizontal error (m)", ylabel="share of the points", ylim=(0.0, 1.02))
    axes.set_xlim(left=0.0)
    axes.legend(loc="lower right", fontsize=8)
    return figure


def draw_on_plan(scored: Scored, plan: Plan | None) -> Figure:
    """A track and the truth, one panel a floor, the lowest at the bottom; the colour of a point is its error."""
    from matplotlib.colors import Normalize

    at = scored.matched
    level = at.true_level if at.true_level is not None else np.zeros(len(at.t_s))
    floors = sorted({int(k) for k in level[np.isfinite(level)].tolist()}) or [0]
    sheets = [plan.levels[k].solid if plan is not None and 0 <= k < len(plan.levels) else None for k in floors]
    inches = [_panel_inches(sheet, at.true_xy_m) for sheet in sheets]
    figure, panels = _figure(len(floors), 9.0, sum(inches), height_ratios=inches[::-1])
    norm = Normalize(0.0, max(scored.card.ce95_m, 0.1))
    for axes, floor, sheet in zip(panels[::-1], floors, sheets, strict=True):
        shown = _draw_floor(axes, scored, level == floor, sheet, norm)
        if len(floors) > 1:
            named = plan.levels[floor].name if plan is not None and sheet is not None else str(floor)
            axes.set_title(f"floor {named}", loc="left", fontsize=9, parse_math=False)
    figure.colorbar(shown, ax=panels, label="horizontal error (m)", extend="max", shrink=0.9)
    panels[-1].legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=2, fontsize=8, frameon=False)
    return figure


def _draw_floor(axes: Axes, scored: Scored, here: Any, walls: Floats | None, norm: Any) -> Any:
    """Walls, the true way and the points of a floor, each joined to its true place."""
    from matplotlib.collections import LineCollection

    at = scored.matched
    if walls is not None:
        axes.add_collection(LineCollection(list(walls.reshape(-1, 2, 2)), colors="#555555", linewidths=1.0))
    chosen = np.flatnonzero(here)
    chosen = chosen[:: max(1, -(-len(chosen) // MOST_POINTS))]
    error = at.error_m[chosen]
    order = np.argsort(error, kind="stable")
    joins = np.stack([at.true_xy_m[chosen], at.xy_m[chosen]], axis=1)
    axes.add_collection(LineCollection(list(joins), colors="0.6", linewidths=0.6))
    axes.plot(*at.true_xy_m[chosen].T, "+", color=BLACK, ms=3.5, mew=0.6, label="true place")
    x, y = at.xy_m[chosen][order].T
    points = axes.scatter(x, y, c=error[order], s=11, cmap="viridis", norm=norm, zorder=3, label="the track's")
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axes.tick_params(labelsize=7)
    axes.autoscale_view()
    return points


def draw_stanford(scored: Scored) -> Figure | None:
    """Stanford diagram of a track; None where it states no radius."""
    if scored.radius_m is None:
        return None
    figure, (axes,) = _figure(1, 5.2, 4.8)
    stated = ~np.isnan(scored.radius_m)
    error, radius = scored.matched.error_m[stated], scored.radius_m[stated]
    beyond = error > radius
    stanford_axes(axes, error, radius, markersize=3.5)
    share = 100.0 * beyond.mean() if len(beyond) else 0.0
    axes.set(xlabel="horizontal error (m)", ylabel=f"{scored.radius_name} (m)")
    axes.set_title(f"{share:.2f} % of {len(beyond)} points beyond the {scored.radius_name}", fontsize=10)
    axes.text(0.97, 0.04, "error beyond the radius", transform=axes.transAxes, ha="right", color=RED, fontsize=9)
    axes.text(0.03, 0.94, "radius holds", transform=axes.transAxes, color=BLUE, fontsize=9)
    return figure


def stanford_axes(axes: Axes, error_m: Floats, radius_m: Floats, markersize: float = 2.0) -> None:
    """Errors (n,) against stated radii (n,) [Tossaint et al. 2007]: above the diagonal the radius holds; the axes end at RANGE_M."""
    beyond = error_m > radius_m
    for which, colour, mark in ((~beyond, BLUE, "."), (beyond, RED, "x")):
        axes.plot(
            error_m[which].clip(*RANGE_M), radius_m[which].clip(*RANGE_M), mark, ms=markersize, alpha=0.4, color=colour,
            zorder=2,
        )  # fmt: skip
    axes.plot(RANGE_M, RANGE_M, color=BLACK, lw=1.0)
    axes.set(xscale="log", yscale="log", xlim=RANGE_M, ylim=RANGE_M)


def _figure(rows: int, width: float, height: float, **ratios: Any) -> tuple[Figure, Sequence[Axes]]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    axes: Any = figure.subplots(rows, 1, squeeze=False, **ratios)
    return figure, list(axes[:, 0])


def _panel_inches(walls: Floats | None, xy_m: Floats) -> float:
    """Height (inches) of a panel about eight inches wide, to scale."""
    points = xy_m if walls is None or not len(walls) else np.concatenate((walls.reshape(-1, 2), xy_m))
    width, height = np.ptp(points, axis=0)
    return float(np.clip(0.8 + 7.5 * height / max(width, 1e-9), LEAST_INCHES, GREATEST_INCHES))
