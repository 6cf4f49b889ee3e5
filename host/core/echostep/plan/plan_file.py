# SPDX-License-Identifier: MIT
"""The fields of plan.json: `plan/model.py` makes a `Plan` from them.

In: nothing. Out: structs whose types check and describe each field; `Door`, which is one of them. Owns the limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import UNSET, Meta, Struct, UnsetType

from echostep.fields import LIMIT_M, Deviation, Latitude, Longitude, Metres, Text

MOST_CORNERS = 10_000  # of an outline: a room of a drawing with arcs has hundreds
DoorState = Literal["open", "closed", "unknown"]
ConnectorKind = Literal["stairs", "lift", "ramp"]
QuestionAbout = Literal["door", "wall", "room"]

Reference = Annotated[Text | int, Meta(description="the name or the index of a level")]
Point = Annotated[tuple[Metres, Metres], Meta(description="[x, y] in metres")]
Outline = Annotated[list[Point], Meta(description="a list of corners, [x, y] in metres")]
Segment = Annotated[tuple[Metres, Metres, Metres, Metres], Meta(description="[x0, y0, x1, y1] in metres")]
Segments = Annotated[list[Segment], Meta(description="a list of [x0, y0, x1, y1] in metres")]


class RoomFields(Struct):
    """A room, and where its name is written."""

    name: Text
    at: Point
    outline: Outline | None = None


@dataclass(frozen=True, slots=True)
class Door:
    """A gap in the walls; `line`: x0, y0, x1, y1 in metres, from one jamb to the other."""

    line: Segment
    state: Annotated[DoorState, Meta(description="one of open, closed, unknown")] = "unknown"
    name: Text = ""

    @property
    def width_m(self) -> float:
        """Distance between the jambs."""
        return math.dist(self.line[:2], self.line[2:])

    @property
    def middle_m(self) -> tuple[float, float]:
        """The place halfway between the jambs."""
        x0, y0, x1, y1 = self.line
        return (x0 + x1) / 2, (y0 + y1) / 2


class QuestionFields(Struct):
    """A question that an import could not decide."""

    text: Text
    about: Annotated[QuestionAbout, Meta(description="one of door, wall, room")]
    at: Point
    lines: Segments = []
    proposed: bool = False


Pixel = Annotated[float, Meta(gt=0.0, le=LIMIT_M, description="metres a pixel, more than 0")]
PlaceDeviation = tuple[Metres, Metres, Deviation]


class LevelFields(Struct):
    """One level."""

    walls: Segments
    name: Text | UnsetType = UNSET
    height_m: Metres = 0.0
    rooms: list[RoomFields] = []
    doors: list[Door] = []
    windows: Segments = []
    obstacles: list[Outline] = []
    doubtful: Segments = []
    place_sd: Annotated[list[PlaceDeviation], Meta(description="a list of [x, y, standard deviation] in metres")] = []
    questions: list[QuestionFields] = []


class ConnectorFields(Struct):
    """Stairs, a lift or a ramp."""

    kind: Annotated[ConnectorKind, Meta(description="one of stairs, lift, ramp")]
    levels: list[Reference]
    outline: Outline
    name: Text = ""


class StartFields(Struct):
    """Where a walk begins."""

    x: Metres
    y: Metres
    heading_deg: Annotated[
        float, Meta(ge=-LIMIT_M, le=LIMIT_M, description=f"a finite number within {LIMIT_M:.0f} degrees")
    ]
    level: Reference = 0


class GeoreferenceFields(Struct):
    """Where the origin lies on Earth."""

    origin: Annotated[tuple[Longitude, Latitude], Meta(description="[longitude, latitude] in degrees")]
    rotation_deg: Annotated[float, Meta(ge=-360.0, le=360.0, description="a finite number within 360 degrees")] = 0.0
    crs: Text = "EPSG:4326"


class PlanFields(Struct):
    """The whole file, but for the version of the format."""

    levels: Annotated[list[LevelFields], Meta(min_length=1, description="a list of at least one level")]
    name: Text = "plan"
    connectors: list[ConnectorFields] = []
    start: StartFields | None = None
    georeference: GeoreferenceFields | None = None
    uncertainty_m: Deviation | None = None
    picture: Annotated[tuple[Pixel, Metres, Metres], Meta(description="[metres a pixel, x, y]")] | None = None
