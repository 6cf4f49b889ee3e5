# SPDX-License-Identifier: MIT
"""Drawn storeys that are no plan."""

from __future__ import annotations

from dataclasses import replace

from echostep.plan import Plan
from echostep_app.plan.places.findings import refusals
from localization.test_drawn_places import ROOM, drawing


def test_a_drawn_storey_that_is_not_known_to_a_room_is_refused() -> None:
    """Its walls are compared with no echo, and a sentence names it; doubtful walls of one that is known are compared."""
    known, refused = (drawing([2.0, 4.0, sd_m]).levels[0] for sd_m in (0.3, 1.2))
    partly = replace(known, walls=ROOM[:1], doubtful=ROOM[1:])
    assert (len(partly.heard), len(partly.solid)) == (4, 1)
    plan = Plan("by anna", (known, replace(refused, name="1", walls=ROOM[:0], doubtful=ROOM)), None, "")
    (sentence,) = refusals(plan)
    assert sentence.startswith("floor 1 of by anna is refused as a plan")
    assert len(plan.levels[1].heard) == 0
    assert refusals(drawing()) == []
