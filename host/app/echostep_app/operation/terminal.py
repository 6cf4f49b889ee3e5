# SPDX-License-Identifier: MIT
"""The commander's view on a terminal: the words of the page's list, the most urgent first.

In: a scene. Out: lines. Owns nothing.
"""

from __future__ import annotations

from rich.console import Group
from rich.text import Text

from echostep_app.operation.operation import TableScene
from echostep_app.team.roster import MemberState

NOTHING_HEARD = (
    "nothing heard yet: does a tracker publish there, and does the broker's access list let this user read echostep/#?"
)
STYLES = {
    MemberState.MAYDAY: "bold blink white on red", MemberState.ASKED: "bold white on red", MemberState.LOST: "bold white on red",
    MemberState.STALE: "bold red", MemberState.UNCERTAIN: "yellow",
    MemberState.WAITING: "cyan", MemberState.TRACKING: "green", MemberState.ENDED: "grey62",
}  # fmt: skip


def listed(scene: TableScene, plan_name: str) -> Group:
    """A line for each wearer; below it what does not come."""
    lines = [
        Text(f"{row.team}/{row.name}: {'; '.join((row.words, *row.notes))}", style=STYLES[MemberState(row.state)])
        for row in scene.rows
    ]
    if not scene.connected:
        lines.append(Text("no connection to the broker", style="bold red"))
    elif not scene.rows:
        lines.append(Text(NOTHING_HEARD, style="grey62"))
    if scene.refused:
        lines.append(Text(f"rejected: {scene.refused}", style="grey62"))
    return Group(Text(f"{plan_name}: {scene.summary}"), *lines)
