# SPDX-License-Identifier: MIT
"""A picture of the team on its plan.

In: a plan, members. Out: a PNG, SVG or PDF. Owns nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from echostep.localization import ellipse95
from echostep.plan import Plan
from echostep_app.printing.picture_files import save_picture
from echostep_app.team.messages.report import Position
from echostep_app.team.roster import Member, MemberState

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LABEL_DISTANCE_M = 1.5  # labels of members closer than this are stacked
COLOURS = {  # distinguishable with colour blindness [Okabe and Ito 2008]
    MemberState.MAYDAY: "#d55e00", MemberState.ASKED: "#d55e00", MemberState.LOST: "#d55e00",
    MemberState.STALE: "#cc79a7", MemberState.UNCERTAIN: "#e69f00",
    MemberState.WAITING: "#56b4e9", MemberState.TRACKING: "#009e73", MemberState.ENDED: "#888888",
}  # fmt: skip


def draw_team(path: Path, plan: Plan, members: Sequence[Member], now_s: float) -> None:
    """Draw each floor with members on it, and each member with 95 % ellipse, heading and state; raises EchostepError."""
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    placed = [m for m in members if (p := m.report.last_known) is not None and 0 <= p.floor < len(plan.levels)]
    floors = sorted({p.floor for m in placed if (p := m.report.last_known)}) or [0]
    figure = Figure(figsize=(10, 6 * len(floors)), dpi=120, layout="constrained")
    for k, floor in enumerate(floors):
        level = plan.levels[floor]
        axes = figure.add_subplot(
            len(floors), 1, k + 1, aspect="equal", title=f"{plan.name}: {level.name}", xlabel="x / m", ylabel="y / m"
        )
        axes.add_collection(LineCollection(list(level.solid.reshape(-1, 2, 2)), colors="#444444", linewidths=1.2))
        for room in level.rooms:
            axes.text(*room.at_m, room.name.replace("$", r"\$"), ha="center", va="center", color="#888888", fontsize=8)
        axes.autoscale_view()
        axes.autoscale(enable=False)  # the ellipse of a lost member may be larger than the plan
        labels: list[tuple[float, float]] = []
        for m in placed:
            if (p := m.position(now_s)) and p.floor == floor:
                stacked = sum(math.dist(label, (p.x_m, p.y_m)) < LABEL_DISTANCE_M for label in labels)
                labels.append((p.x_m, p.y_m))
                _draw_member(axes, m.report.name, p, m.state(now_s), stacked)
        if placed:
            _draw_legend(axes, {m.state(now_s) for m in placed})
    path.parent.mkdir(parents=True, exist_ok=True)
    save_picture(figure, path)


def _draw_legend(axes: Axes, states: Collection[MemberState]) -> None:
    """The colour of each state that is drawn."""
    for state, colour in COLOURS.items():
        if state in states:
            axes.plot([], [], "o", color=colour, markersize=6, label=f"{state}, 95 % ellipse")
    axes.legend(loc="upper right", fontsize=8)


def _draw_member(axes: Axes, name: str, p: Position, need: MemberState, stacked: int) -> None:
    """Draw one member; its label is moved up by `stacked` lines, one for each label near it."""
    from matplotlib.patches import Ellipse as Patch

    colour, ellipse = COLOURS[need], ellipse95(p.xx_m2, p.xy_m2, p.yy_m2)
    wide, high, turn = 2 * ellipse.major_m, 2 * ellipse.minor_m, math.degrees(ellipse.angle_rad)
    axes.add_patch(
        Patch((p.x_m, p.y_m), wide, high, angle=turn, color=colour, fill=need is not MemberState.STALE, alpha=0.25)
    )
    axes.plot(p.x_m, p.y_m, "o", color=colour, markersize=6)
    if p.heading_rad is not None:
        c, s = math.cos(p.heading_rad), math.sin(p.heading_rad)
        axes.annotate("", (p.x_m + c, p.y_m + s), (p.x_m, p.y_m), arrowprops={"arrowstyle": "->", "color": colour})
    label = (name if need is MemberState.TRACKING else f"{name}: {need}").replace("$", r"\$")
    axes.annotate(
        label, (p.x_m, p.y_m), xytext=(8, 8 + 11 * stacked), textcoords="offset points", fontsize=8, color=colour
    )
