# SPDX-License-Identifier: MIT
"""track.png of a run: the plan as `plan show` draws it, and the walk on it.

In: a plan, estimates, the true path where it is known. Out: pictures. Owns the colours of the walk.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from echostep.aiding import BeaconPlace, BeaconState
from echostep.arrays import Floats
from echostep.localization import Estimate, TrackStatus
from echostep.particles.ellipse import CHI2_95
from echostep.plan import Plan
from echostep_app.plan.cropping import Bounds
from echostep_app.plan.pictures.drawing import Layer, plan_figure, texts_of
from echostep_app.plan.pictures.labels import fonts_for
from echostep_app.plan.routing import Route
from echostep_app.printing.picture_files import save_picture
from echostep_app.scorecard.track_columns import ScoredPath

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NEARBY_S = 2.5  # of the truth from an estimate: they come at each step, and twice a second while standing
GAP_S = 5.0  # the line of the track is broken after so long on another level
MOST_REGIONS = 24  # drawn per level
EDGE_M = 1.0  # about a walk without a plan
ROUTE_COLOUR, BEACON_COLOUR = "#cc79a7", "#d55e00"
TRUTH_COLOUR, TRACK_COLOUR = "#009e73", "#0072b2"  # distinguishable with colour blindness [Okabe and Ito 2008]
WORDS = {TrackStatus.TRACKING: TRACK_COLOUR, TrackStatus.UNCERTAIN: "#e69f00", TrackStatus.LOST: "#000000"}


def draw_track(
    path: Path, plan: Plan, estimates: Sequence[Estimate], truth: ScoredPath | None, title: str,
    route: Route | None = None, beacons: Sequence[BeaconPlace] = (),
) -> None:  # fmt: skip
    """Draw plan, true path, route, beacons, estimates and their regions of 95 % as PNG, SVG or PDF, by the ending of the name."""
    with track_figure(plan, estimates, truth, title, route, beacons) as figure:
        save_picture(figure, path)


@contextmanager
def track_figure(
    plan: Plan, estimates: Sequence[Estimate], truth: ScoredPath | None, title: str,
    route: Route | None = None, beacons: Sequence[BeaconPlace] = (),
) -> Iterator[Figure]:  # fmt: skip
    """The picture of the visited levels, to be written within the context."""
    visited = sorted({e.level for e in estimates}) or [0]

    def draw(axes: Any, level: int) -> None:
        here = [e for e in estimates if e.level == level]
        if truth:
            axes.plot(
                *_near(truth, here).T, color=TRUTH_COLOUR, linewidth=4, alpha=0.45, solid_capstyle="round", zorder=2
            )
        _draw_guidance(axes, level, route, [b for b in beacons if b.level == level])
        _draw_walk(axes, [e for e in here if e.claims_place or not plan.is_drawn])
        _draw_regions(axes, here[:: math.ceil(len(here) / MOST_REGIONS) or 1])

    layer = Layer(draw, _legend(estimates, truth, route, beacons), title)
    with fonts_for([*texts_of(plan, visited), title]):
        yield plan_figure(plan, visited, None if plan.is_drawn else _about(estimates), layer=layer)


def _about(estimates: Sequence[Estimate]) -> Bounds | None:
    """The rectangle about a walk without a plan."""
    if not estimates:
        return None
    at_m = np.array([(e.x_m, e.y_m) for e in estimates])
    (x0, y0), (x1, y1) = at_m.min(0) - EDGE_M, at_m.max(0) + EDGE_M
    return float(x0), float(y0), float(x1), float(y1)


def _near(truth: ScoredPath, estimates: Sequence[Estimate]) -> Floats:
    """True positions (n, 2) near the times of estimates; NaN where no estimate is within NEARBY_S."""
    t_s = np.array([-np.inf, *(e.t_s for e in estimates), np.inf])
    after = np.searchsorted(t_s[:-1], truth.t_s, side="right")
    off_s = np.minimum(truth.t_s - t_s[after - 1], t_s[after] - truth.t_s)
    return np.where((off_s < NEARBY_S)[:, None], truth.xy_m, np.nan)


def _draw_walk(axes: Any, estimates: Sequence[Estimate]) -> None:
    """The line of the positions, each piece in the colour of its word; a disc where it begins, a frame where it ends."""
    from matplotlib.collections import LineCollection

    pairs = [(a, b) for a, b in pairwise(estimates) if b.t_s - a.t_s <= GAP_S]
    lines = [((a.x_m, a.y_m), (b.x_m, b.y_m)) for a, b in pairs]
    axes.add_collection(LineCollection(lines, colors=[WORDS[b.status] for _, b in pairs], linewidths=1.6, zorder=5))
    for e, sign, size, fill in zip([*estimates[:1], *estimates[-1:]], "os", (7, 10), ("full", "none"), strict=False):
        axes.plot(e.x_m, e.y_m, sign, markersize=size, fillstyle=fill, mew=2, color=WORDS[e.status], zorder=6)


def _draw_regions(axes: Any, estimates: Sequence[Estimate]) -> None:
    """The outline of the region of 95 %, where there is one; else of each place, as strong as its share of the belief."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Ellipse

    outline, outlines = partial(Ellipse, fill=False, linewidth=0.8), []
    for e in estimates:
        major_m, minor_m, angle_rad = e.ellipse95
        colour = WORDS[e.status]
        if e.is_one_place:
            turn = math.degrees(angle_rad)
            outlines.append(outline((e.x_m, e.y_m), 2 * major_m, 2 * minor_m, angle=turn, edgecolor=colour, alpha=0.6))
        for place in () if e.is_one_place else e.hypotheses:
            wide_m = 2.0 * math.sqrt(CHI2_95) * place.sd_m
            at_m, strong = (place.x_m, place.y_m), min(place.probability, 1.0)
            outlines.append(outline(at_m, wide_m, wide_m, linestyle=":", edgecolor=colour, alpha=strong))
    axes.add_collection(PatchCollection(outlines, match_original=True, zorder=4))


def _draw_guidance(axes: Any, level: int, route: Route | None, beacons: Sequence[BeaconPlace]) -> None:
    """Draw the route, and each beacon with two standard deviations; moved and silent beacons are hollow."""
    from matplotlib.patches import Circle

    for stretch in route.stretches if route else ():
        if stretch.level == level:
            axes.plot(*stretch.line_m.T, color=ROUTE_COLOUR, linewidth=2, linestyle="--", zorder=3)
    for b in beacons:
        filled = BEACON_COLOUR if b.state is BeaconState.WELL else "none"
        axes.plot(b.x_m, b.y_m, "^", color=BEACON_COLOUR, mfc=filled, markersize=6)
        axes.add_patch(Circle((b.x_m, b.y_m), 2.0 * b.sd_m, color=BEACON_COLOUR, alpha=0.15, lw=0))


def _legend(
    estimates: Sequence[Estimate], truth: ScoredPath | None, route: Route | None, beacons: Sequence[BeaconPlace]
) -> list[Any]:
    """The signs of the walk that are drawn."""
    from matplotlib.lines import Line2D

    line: Any = partial(Line2D, [], [])
    seen = {e.status for e in estimates}
    sign = {"linestyle": "", "color": TRACK_COLOUR}
    kinds = (
        (line(color=TRUTH_COLOUR, linewidth=4, alpha=0.45, label="truth"), truth),
        *((line(color=WORDS[word], label=word.value), word in seen) for word in WORDS),
        (line(marker="o", mfc="none", mew=0.8, markersize=9, **sign, label="95 % within"), estimates),
        (line(marker="o", **sign, label="begins"), estimates),
        (line(marker="s", fillstyle="none", mew=2, **sign, label="ends"), estimates),
        (line(color=ROUTE_COLOUR, linewidth=2, linestyle="--", label="route"), route),
        (line(marker="^", linestyle="", color=BEACON_COLOUR, label="beacon (hollow: moved or silent)"), beacons),
    )  # fmt: skip
    return [handle for handle, is_drawn in kinds if is_drawn]
