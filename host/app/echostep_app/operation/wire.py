# SPDX-License-Identifier: MIT
"""Everything that goes to a commander's page: typed messages and their bytes.

In: scenes, details. Out: JSON for texts, bytes for frames. Owns nothing. A frame, little-endian:

    u32         length of the JSON header, padded with spaces to a multiple of four
    bytes       the header (`TableHeader`)
    float32[7]  `places` rows: wearer, x, y, level, heading, 95 % radius, protection radius (`Operation.scene`)
    float32[5]  `trail` rows: wearer, x, y, level, age in seconds
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import msgspec

from echostep.plan.model import Plan
from echostep_app.operation.distress import ShownDistress
from echostep_app.operation.operation import TableScene
from echostep_app.operation.recorded.past import ShownTime
from echostep_app.operation.words import ShownDetails, ShownWearer
from echostep_app.page.elements.marks import ShownMark
from echostep_app.page.protocol import PlanLabels, Refused, hello, packed
from echostep_app.team.messages.crews import Crew

PLACE_BYTES, TRAIL_BYTES = 7 * 4, 5 * 4

# The field names of all classes here are keys of the JSON.


@dataclass(frozen=True, slots=True)
class TableHello:
    """The first message to a page."""

    title: str
    plan: PlanLabels
    kind: Literal["hello"] = "hello"


@dataclass(frozen=True, slots=True)
class TableHeader:
    """One moment. `seq`: the page returns it when the frame is drawn. `list`, `marks`, `crews`: None when the page has them already.

    `trail_from` 0: trails begin anew. `details`, `distress`: of the chosen wearer. `time`: of the time bar.
    """

    seq: int
    unix_s: float
    places: int
    trail: int
    trail_from: int
    list: tuple[ShownWearer, ...] | None
    summary: str
    refused: str
    connected: bool
    fault: str
    details: ShownDetails | None
    distress: ShownDistress | None
    marks: tuple[ShownMark, ...] | None
    crews: tuple[Crew, ...] | None
    time: ShownTime | None
    kind: Literal["table"] = "table"


def encode(message: TableHello | Refused) -> str:
    """A message as JSON."""
    return msgspec.json.encode(message).decode()


def table_hello(plan: Plan, title: str) -> TableHello:
    """The first message of an operation on this plan."""
    return TableHello(title, hello(plan, title, replay=False).plan)


@dataclass(frozen=True, slots=True)
class TableParts:
    """What a frame has beside its scene, for one page. `trail`: rows, the first of which has the number `trail_from`.

    `lists`, `marks`, `crews`: these are new.
    """

    seq: int
    trail: bytes
    trail_from: int
    lists: bool
    marks: bool
    crews: bool
    details: ShownDetails | None
    distress: ShownDistress | None
    time: ShownTime | None


def frame(scene: TableScene, parts: TableParts) -> bytes:
    """A frame as bytes, in the layout of this module's docstring."""
    header = TableHeader(
        seq=parts.seq,
        unix_s=scene.unix_s,
        places=len(scene.places) // PLACE_BYTES,
        trail=len(parts.trail) // TRAIL_BYTES,
        trail_from=parts.trail_from,
        list=scene.rows if parts.lists else None,
        summary=scene.summary,
        refused=scene.refused,
        connected=scene.connected,
        fault=scene.fault,
        details=parts.details,
        distress=parts.distress,
        marks=scene.marks if parts.marks else None,
        crews=scene.crews if parts.crews else None,
        time=parts.time,
    )
    return packed(header, scene.places + parts.trail)
