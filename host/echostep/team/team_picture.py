"""The team on its plan, as a picture.

In: a plan, members. Out: a PNG or SVG. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from echostep.errors import EchostepError
from echostep.estimate import ellipse95
from echostep.plan import Plan
from echostep.team.roster import Member, Need

COLOURS = {  # told apart by the colour-blind [Okabe and Ito 2008]
    Need.LOST: "#d55e00", Need.STALE: "#cc79a7", Need.UNCERTAIN: "#e69f00",
    Need.WAITING: "#56b4e9", Need.TRACKING: "#009e73", Need.ENDED: "#888888",
}  # fmt: skip


def draw_team(path: Path, plan: Plan, members: Sequence[Member], now_s: float) -> None:
    """Every floor that somebody is on, everybody with his 95 % ellipse, heading and state."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    placed = [m for m in members if m.report.position is not None and 0 <= m.report.position.floor < len(plan.levels)]
    floors = sorted({m.report.position.floor for m in placed if m.report.position}) or [0]
    figure = Figure(figsize=(10, 6 * len(floors)), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    for k, floor in enumerate(floors):
        level = plan.levels[floor]
        axes = figure.add_subplot(
            len(floors), 1, k + 1, aspect="equal", title=f"{plan.name}: {level.name}", xlabel="x / m", ylabel="y / m"
        )
        axes.add_collection(LineCollection(list(level.walls.reshape(-1, 2, 2)), colors="#444444", linewidths=1.2))
        axes.autoscale_view()
        for m in placed:
            if m.report.position and m.report.position.floor == floor:
                _draw_member(axes, m, now_s)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        figure.savefig(path)
    except OSError as error:
        raise EchostepError(f"{path}: cannot write the picture: {error.strerror}") from error


def _draw_member(axes, m: Member, now_s: float) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    from matplotlib.patches import Ellipse as Patch

    p = m.report.position
    assert p is not None
    need = m.need(now_s)
    colour, ellipse = COLOURS[need], ellipse95(p.xx_m2, p.xy_m2, p.yy_m2)
    wide, high, turn = 2 * ellipse.major_m, 2 * ellipse.minor_m, math.degrees(ellipse.angle_rad)
    axes.add_patch(Patch((p.x_m, p.y_m), wide, high, angle=turn, facecolor=colour, alpha=0.2))
    axes.plot(p.x_m, p.y_m, "o", color=colour, markersize=6)
    if p.heading_rad is not None:
        c, s = math.cos(p.heading_rad), math.sin(p.heading_rad)
        axes.annotate("", (p.x_m + c, p.y_m + s), (p.x_m, p.y_m), arrowprops={"arrowstyle": "->", "color": colour})
    said = m.report.name if need is Need.TRACKING else f"{m.report.name}: {need}"
    axes.annotate(
        said.replace("$", r"\$"), (p.x_m, p.y_m), xytext=(6, 6), textcoords="offset points", fontsize=8, color=colour
    )
