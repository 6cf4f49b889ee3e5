# SPDX-License-Identifier: MIT
"""Drawings that wearers share: plan.json on `echostep/<team>/<wearer>/drawing/plan`, which the broker keeps.

In: the bytes of a payload from an untrusted sender. Out: a `Plan`, or why it is none. Owns topic and limits. The topic has a part more than those of
reports, so no commander and no teammate gets a drawing without asking for it.
"""

from __future__ import annotations

import numpy as np

from echostep.errors import EchostepError
from echostep.plan.model import Plan, parse_plan
from echostep.team.messages.report import is_printable

MOST_BYTES = 1 << 20  # of a drawing: an hour in a furnished office has 30 kB
MOST_WALLS = 10_000  # of all storeys; assumed
MOST_LENGTH_M = 50_000.0  # of all walls together: a walk of four hours has 13 km of path, and a wall on either side
MOST_EXTENT_M = 5_000.0  # of the walls along x and y: one site
MOST_STOREYS = 64  # assumed: no building has more


def drawing_topic(team: str, name: str) -> str:
    """Where a wearer's drawing is kept; `team` may be `+`: any."""
    return f"echostep/{team}/{name}/drawing/plan"


def checked_drawing(payload: bytes) -> Plan:
    """The plan in a payload; raises EchostepError that says why it is not used."""
    if len(payload) > MOST_BYTES:
        raise EchostepError(f"it has {len(payload)} bytes, more than {MOST_BYTES}")
    try:
        plan = parse_plan(payload)
    except ValueError as error:
        raise EchostepError(str(error)) from error
    if not plan.is_drawn:
        raise EchostepError("it shows no wall")
    names = (plan.name, *(level.name for level in plan.levels), *(stairs.name for stairs in plan.connectors))
    if not all(map(is_printable, names)):
        raise EchostepError("a name in it is not printable")
    _check_size(plan)
    return plan


def _check_size(plan: Plan) -> None:
    """Raises EchostepError for more than a walk can have drawn: laying it out would take minutes."""
    walls = np.concatenate([level.solid for level in plan.levels])
    length_m = float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())
    extent_m = float(np.ptp(walls.reshape(-1, 2), axis=0).max())
    for size, most, what in (
        (len(plan.levels), MOST_STOREYS, "storeys"),
        (len(walls), MOST_WALLS, "walls"),
        (length_m, MOST_LENGTH_M, "m of wall"),
        (extent_m, MOST_EXTENT_M, "m from end to end"),
    ):
        if size > most:
            raise EchostepError(f"it has {size:.0f} {what}, more than {most:.0f}")
