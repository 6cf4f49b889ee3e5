# SPDX-License-Identifier: MIT
"""Pictures of plans, tracks and walks, as the core asks for them.

In: a `Plan`, a foot's `Track` or a `Walk`. Out: SVG for a notebook; a file. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path

from echostep.foot.steps import Track
from echostep.plan import Plan
from echostep.walk.walk import Walk
from echostep_app.extras import lacks, require
from echostep_app.output.offline_plots import foot_figure
from echostep_app.output.track_plot import draw_track, track_figure
from echostep_app.plan.pictures.drawing import plan_svg
from echostep_app.printing.picture_files import svg_text


def svg(shown: Plan | Track | Walk) -> str | None:
    """The picture as SVG; None without matplotlib."""
    if lacks("a picture", "matplotlib"):
        return None
    if isinstance(shown, Plan):
        return plan_svg(shown)
    if isinstance(shown, Track):
        return svg_text(foot_figure(shown, "foot"))
    with track_figure(shown.plan, shown.estimates, None, shown.name) as figure:
        return svg_text(figure)


def save(walk: Walk, path: Path) -> None:
    """The picture of a walk as PNG, SVG or PDF, by the ending of the name; raises EchostepError."""
    require("a picture", "matplotlib")
    draw_track(path, walk.plan, walk.estimates, None, walk.name)
