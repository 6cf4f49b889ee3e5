# SPDX-License-Identifier: MIT
"""The fields of plan.json: `plan/model.py` makes a `Plan` of them.

In: nothing. Out: structs whose types check each field, and say what it is. Owns the limits.
"""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import UNSET, Meta, Struct, UnsetType

LIMIT_M = 1e5  # greatest coordinate: 100 km, more than any site
MOST_CORNERS = 10_000  # of an outline: a room of a drawing with arcs has hundreds
DoorState = Literal["open", "closed", "unknown"]
ConnectorKind = Literal["stairs", "lift", "ramp"]
QuestionAbout = Literal["door", "wall", "room"]

Metres = Annotated[float, Meta(ge=-LIMIT_M, le=LIMIT_M, description=f"a finite number within {LIMIT_M:.0f} m")]
Deviation = Annotated[float, Meta(ge=0.0, le=LIMIT_M, description=f"a finite number from 0 to {LIMIT_M:.0f} m")]
Longitude = Annotated[float, Meta(ge=-180.0, le=180.0, description="a finite number within 180 degrees east")]
Latitude = Annotated[float, Meta(ge=-90.0, le=90.0, description="a finite number within 90 degrees north")]
# What UTF-8 and XML cannot hold: lone surrogates, and control characters but tab and line ends [XML 1.0, 2.2]
UNWRITABLE = r"\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff"
Text = Annotated[str, Meta(pattern=rf"^[^{UNWRITABLE}]*$", description="a text without control characters")]
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


class DoorFields(Struct):
    """A gap in the walls."""

    line: Segment
    state: Annotated[DoorState, Meta(description="one of open, closed, unknown")] = "unknown"
    name: Text = ""


class QuestionFields(Struct):
    """What an import could not decide."""

    text: Text
    about: Annotated[QuestionAbout, Meta(description="one of door, wall, room")]
    at: Point
    lines: Segments = []
    proposed: bool = False


PlaceDeviation = tuple[Metres, Metres, Deviation]


class LevelFields(Struct):
    """One level."""

    walls: Segments
    name: Text | UnsetType = UNSET
    height_m: Metres = 0.0
    rooms: list[RoomFields] = []
    doors: list[DoorFields] = []
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
