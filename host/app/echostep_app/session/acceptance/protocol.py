# SPDX-License-Identifier: MIT
"""The protocol of an acceptance walk: surveyed points, the order in which they are visited, and the plan they lie on.

In: points and a plan, or the metadata of a recording. Out: `Protocol`, as a field of the metadata; its visits. Owns the name of the field, and the
manner of each round.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec
from msgspec import Meta

from echostep.errors import EchostepError
from echostep.fields import Metres, Text
from echostep.plan import Plan, parse_plan
from echostep.ports.people.payloads import Level
from echostep_app.ports.tap import MOST_POINTS

FIELD = "acceptance"  # of the metadata
# Of walking, of a stop with a tap, of a turn at an end; assumed
SPEED_M_S, STOP_S, TURN_S = 1.2, 4.0, 6.0


class Point(msgspec.Struct, frozen=True):
    """A surveyed point on the plan, in its metres."""

    name: Annotated[Text, Meta(min_length=1, max_length=32)]
    x_m: Metres
    y_m: Metres
    level: Level = 0


class Visit(NamedTuple):
    """A point (its index) to be tapped, standing on it or passing by."""

    point: int
    standing: bool


class Protocol(msgspec.Struct, frozen=True):
    """Points in the order in which they lie on the way, and the text of the plan, which starts at the first, looking to the second."""

    points: Annotated[tuple[Point, ...], Meta(min_length=2, max_length=MOST_POINTS)]
    plan_text: str

    @property
    def metadata(self) -> dict[str, str]:
        """The field of a recording."""
        return {FIELD: msgspec.json.encode(self).decode()}

    def plan(self) -> Plan:
        """The plan; raises ValueError."""
        plan = parse_plan(self.plan_text.encode())
        if any(point.level >= len(plan.levels) for point in self.points):
            raise ValueError("a point lies on a level that the plan does not have")
        return plan

    def visits(self, rounds: int) -> tuple[Visit, ...]:
        """The first point standing, then there and back as often: standing in the first round, passing in the second, and so on."""
        last = len(self.points) - 1
        there_and_back = (*range(1, last + 1), *range(last - 1, -1, -1))
        return (Visit(0, True), *(Visit(k, r % 2 == 0) for r in range(rounds) for k in there_and_back))

    def rounds_of(self, seconds: float) -> int:
        """An even number of rounds that take about so long."""
        way_m = 2.0 * sum(math.dist((a.x_m, a.y_m), (b.x_m, b.y_m)) for a, b in pairwise(self.points))
        stops_s = STOP_S * (len(self.points) - 1)  # in every other round
        return max(2, 2 * round(0.5 * seconds / (way_m / SPEED_M_S + 2.0 * TURN_S + stops_s)))


def recorded_protocol(metadata: Mapping[str, str], path: Path) -> tuple[Protocol, Plan]:
    """The protocol of a recording, with its plan; raises EchostepError when it has none, or a damaged one."""
    if FIELD not in metadata:
        raise EchostepError(
            f"{path}: no acceptance walk: echostep acceptance records one; echostep replay tracks any other"
        )
    try:
        protocol = msgspec.json.decode(metadata[FIELD], type=Protocol)
        return protocol, protocol.plan()
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise EchostepError(f"{path}: its acceptance protocol is damaged: {error}") from error
