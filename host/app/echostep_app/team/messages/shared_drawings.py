# SPDX-License-Identifier: MIT
"""Drawings that wearers share: plan.json on `echostep/<team>/<wearer>/drawing/plan`, which the broker keeps.

In: the bytes of a payload from an untrusted sender. Out: a `Plan`, or why it is none. Owns topic and limits. The topic has a part more than those of
reports, so no commander and no teammate gets a drawing without asking for it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Plan, parse_plan
from echostep_app.plan.places.refusals import refusals
from echostep_app.team.messages.report import is_printable

MOST_BYTES = 1 << 20  # of a drawing: an hour in a furnished office has 30 kB
MOST_WALLS = 10_000  # of all storeys; assumed
MOST_LENGTH_M = 50_000.0  # of all walls together: a walk of four hours has 13 km of path, and a wall on either side
MOST_EXTENT_M = 5_000.0  # of the walls along x and y: one site
MOST_STOREYS = 64  # assumed: no building has more
MOST_OTHERS = 2_000  # assumed: a walk draws doors and stairs, and no rooms
# Pairs of walls of a storey whose boxes meet, each with itself; assumed: a drawn wall meets a few others
MOST_MEETINGS = 200_000
AT_ONCE = 200  # walls, of a search that may find all others


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
        raise EchostepError("; ".join(refusals(plan)) or "it shows no wall")
    names = [plan.name, *(stairs.name for stairs in plan.connectors)]
    for level in plan.levels:
        names += [level.name, *(room.name for room in level.rooms), *(door.name for door in level.doors)]
    if not all(map(is_printable, names)):
        raise EchostepError("a name in it is not printable")
    _check_size(plan)
    return plan


def _check_size(plan: Plan) -> None:
    """Raises EchostepError for more than a walk can have drawn: laying it out would take minutes."""
    walls = np.concatenate([level.heard for level in plan.levels])
    length_m = float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())
    outlines = [*(connector.outline_m for connector in plan.connectors)]
    others = len(plan.connectors)
    for level in plan.levels:
        outlines += [*level.obstacles, *(room.outline_m for room in level.rooms if room.outline_m is not None)]
        others += sum(map(len, (level.rooms, level.doors, level.questions, level.obstacles, level.doubtful)))
        others -= len(level.heard) - len(
            level.solid
        )  # doubtful walls that are compared with echoes are counted as walls
    extent_m = float(np.ptp(np.concatenate([walls.reshape(-1, 2), *_others(plan), *outlines]), axis=0).max())
    for size, most, what in (
        (len(plan.levels), MOST_STOREYS, "storeys"),
        (len(walls), MOST_WALLS, "walls"),
        (length_m, MOST_LENGTH_M, "m of wall"),
        (others, MOST_OTHERS, "doors, rooms, connectors and the like"),
        (sum(map(len, outlines)), MOST_WALLS, "corners of outlines"),
        (extent_m, MOST_EXTENT_M, "m from end to end"),
    ):
        if size > most:
            raise EchostepError(f"it has {size:.0f} {what}, more than {most:.0f}")
    for level in plan.levels:
        _check_meetings(level.heard)


def _others(plan: Plan) -> Iterator[Floats]:
    """Places of what is neither wall nor outline, (n, 2) each."""
    if plan.start is not None:
        yield np.array([[plan.start.x_m, plan.start.y_m]])
    for level in plan.levels:
        yield level.doubtful.reshape(-1, 2)
        yield level.place_sd[:, :2]
        yield np.array([door.line for door in level.doors]).reshape(-1, 2)
        yield np.array([room.at_m for room in level.rooms]).reshape(-1, 2)


def _check_meetings(walls: Floats) -> None:
    """Raises EchostepError where too many walls meet or cross: the spaces between them would take minutes and gigabytes."""
    import shapely

    tree, count = shapely.STRtree(shapely.linestrings(walls.reshape(-1, 2, 2))), 0
    for begin in range(0, len(walls), AT_ONCE):
        count += tree.query(tree.geometries[begin : begin + AT_ONCE]).shape[1]
        if count > MOST_MEETINGS:
            raise EchostepError(f"more than {MOST_MEETINGS} of its walls meet or cross each other on one storey")
