# SPDX-License-Identifier: MIT
"""Starts that cannot be: outside the building, inside a wall.

In: a plan, a start, where it was given. Out: an EchostepError, or a note for a start that a recording was tracked with. Owns nothing.
"""

from __future__ import annotations

import math

from echostep.errors import EchostepError
from echostep.localization.particles.start import Start
from echostep.plan.model import Plan, Pose
from echostep_app.plan.places.standing import refuse_impossible
from echostep_app.session.console import console


def check_start(plan: Plan, start: Pose | Start | None, *, given: bool, recorded: bool = False) -> None:
    """Refuse an impossible start. `given`: on the command line; else it is the recording's if `recorded`, and only noted, or the plan's."""
    start = start.pose if isinstance(start, Start) else start
    if start is None or start.level < 0 or not plan.is_drawn:
        return  # a check-in, a room, anywhere, on any level; no plan that could object
    shown = f"{start.x_m:g},{start.y_m:g},{math.degrees(start.heading_rad):.0f}"
    if recorded and not given:
        try:
            refuse_impossible(plan, start, f"Note: the recorded start {shown}")
        except EchostepError as error:
            console.print(str(error), markup=False)
        return
    refuse_impossible(plan, start, f"--start {shown}" if given else f"the plan's start {shown}")
