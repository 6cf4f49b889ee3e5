# SPDX-License-Identifier: MIT
"""Messages that viewers of recordings (Foxglove, PlotJuggler) show without a plug-in.

In: positions, headings, a plan. Out: `DerivedMessage`s for a `Recorder`: JSON with JSON Schemas, Foxglove's where one fits
[Foxglove, message schemas], else flat objects of numbers, which can be plotted. Owns nothing. The schemas contain only the fields that are filled.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from echostep.plan import Level
from echostep_app.recording.recorder import DerivedMessage, Topic

MAP_FRAME, TRUNK_FRAME = "map", "trunk"
NUMBER, TEXT, WHOLE, TRUTH = {"type": "number"}, {"type": "string"}, {"type": "integer"}, {"type": "boolean"}
MOST_WALLS = 20_000  # drawn of a level: keeps the recording of a large plan small
LINE_STRIP, LINE_LIST = 0, 2
COVARIANCE_KNOWN = 3  # `position_covariance_type` of LocationFix: all elements are known
LINE_PIXELS = 2.0

Shape = Mapping[str, Any]


def fields(title: str, **properties: Shape) -> dict[str, Any]:
    """A JSON Schema of an object."""
    return {"title": title, "type": "object", "properties": dict(properties)}


def array(items: Shape) -> dict[str, Any]:
    """A JSON Schema of an array."""
    return {"type": "array", "items": dict(items)}


def topic(name: str, schema: Mapping[str, Any]) -> Topic:
    """A channel whose messages have this schema; its title is the schema's name."""
    return Topic(name, schema["title"], json.dumps(schema))


_TIME = fields("time", sec=WHOLE, nsec=WHOLE)
_PLACE = fields("foxglove.Vector3", x=NUMBER, y=NUMBER, z=NUMBER)
_TURN = fields("foxglove.Quaternion", x=NUMBER, y=NUMBER, z=NUMBER, w=NUMBER)
_POSE = fields("foxglove.Pose", position=_PLACE, orientation=_TURN)
_COLOR = fields("foxglove.Color", r=NUMBER, g=NUMBER, b=NUMBER, a=NUMBER)
_LINE = fields(
    "foxglove.LinePrimitive", type=WHOLE, pose=_POSE, thickness=NUMBER, scale_invariant=TRUTH, points=array(_PLACE),
    color=_COLOR, colors=array(_COLOR), indices=array(WHOLE),
)  # fmt: skip
_SOLIDS = ("arrows", "cubes", "spheres", "cylinders", "triangles", "texts", "models")
_ENTITY = fields(
    "foxglove.SceneEntity", timestamp=_TIME, frame_id=TEXT, id=TEXT, lifetime=fields("duration", sec=WHOLE, nsec=WHOLE),
    frame_locked=TRUTH, metadata=array(fields("foxglove.KeyValuePair", key=TEXT, value=TEXT)), lines=array(_LINE),
    **{name: array({"type": "object"}) for name in _SOLIDS},
)  # fmt: skip
POSE = topic("/pose", fields("foxglove.PoseInFrame", timestamp=_TIME, frame_id=TEXT, pose=_POSE))
FRAME = topic(
    "/frame",
    fields(
        "foxglove.FrameTransform",
        timestamp=_TIME,
        parent_frame_id=TEXT,
        child_frame_id=TEXT,
        translation=_PLACE,
        rotation=_TURN,
    ),
)
SCENE = topic("/scene", fields("foxglove.SceneUpdate", deletions=array({"type": "object"}), entities=array(_ENTITY)))
LOCATION = topic(
    "/location",
    fields(
        "foxglove.LocationFix",
        timestamp=_TIME,
        frame_id=TEXT,
        latitude=NUMBER,
        longitude=NUMBER,
        altitude=NUMBER,
        position_covariance={**array(NUMBER), "minItems": 9, "maxItems": 9},
        position_covariance_type=WHOLE,
    ),
)
LOG = topic(
    "/log", fields("foxglove.Log", timestamp=_TIME, level=WHOLE, message=TEXT, name=TEXT, file=TEXT, line=WHOLE)
)
WARNING = 3  # level of a log line [Foxglove, Log]

Place = tuple[float, float, float]
WALL, TRACK, ELLIPSE, LEFT_BEAM, RIGHT_BEAM = (
    (0.55, 0.55, 0.55, 1.0),
    (0.2, 0.5, 1.0, 1.0),
    (0.2, 0.5, 1.0, 0.6),
    (1.0, 0.6, 0.1, 0.9),
    (0.1, 0.8, 0.5, 0.9),
)
Color = tuple[float, float, float, float]


def time_of(t_ns: int) -> dict[str, int]:
    """Nanoseconds as seconds and nanoseconds, as Foxglove expects."""
    sec, nsec = divmod(max(t_ns, 0), 1_000_000_000)
    return {"sec": sec, "nsec": nsec}


def vector(xyz: Place) -> dict[str, float]:
    """A point or a vector (m), rounded to a tenth of a millimetre."""
    return {axis: round(v, 4) for axis, v in zip("xyz", xyz, strict=True)}


def about_vertical(heading_rad: float) -> dict[str, float]:
    """The quaternion of a rotation about the vertical axis."""
    return {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * heading_rad), "w": math.cos(0.5 * heading_rad)}


def pose(t_ns: int, xyz_m: Place, heading_rad: float) -> list[DerivedMessage]:
    """Position and heading of the trunk: as a pose, and as a frame that a 3D view can follow."""
    stamp, here, turn = time_of(t_ns), vector(xyz_m), about_vertical(heading_rad)
    return [
        DerivedMessage(
            POSE, t_ns, {"timestamp": stamp, "frame_id": MAP_FRAME, "pose": {"position": here, "orientation": turn}}
        ),
        DerivedMessage(
            FRAME,
            t_ns,
            {
                "timestamp": stamp,
                "parent_frame_id": MAP_FRAME,
                "child_frame_id": TRUNK_FRAME,
                "translation": here,
                "rotation": turn,
            },
        ),
    ]


def location(
    t_ns: int, longitude: float, latitude: float, height_m: float, covariance_m2: Sequence[float]
) -> DerivedMessage:
    """A position in longitude and latitude (WGS 84, degrees); `covariance_m2` (9,), row by row: east, north, up."""
    body = {
        "timestamp": time_of(t_ns),
        "frame_id": TRUNK_FRAME,
        "latitude": latitude,
        "longitude": longitude,
        "altitude": height_m,
        "position_covariance": list(covariance_m2),
        "position_covariance_type": COVARIANCE_KNOWN,
    }
    return DerivedMessage(LOCATION, t_ns, body)


def log_line(t_ns: int, text: str) -> DerivedMessage:
    """A line on the faults of the run's output."""
    body = {"timestamp": time_of(t_ns), "level": WARNING, "message": text, "name": "echostep", "file": "", "line": 0}
    return DerivedMessage(LOG, t_ns, body)


def scene(t_ns: int, **drawn: tuple[int, Color, Sequence[Place]]) -> DerivedMessage:
    """Lines on the map by name, each (kind, color, points (m)); a later line of the same name replaces the earlier one."""
    entities = [_entity(t_ns, name, *what) for name, what in drawn.items()]
    return DerivedMessage(SCENE, t_ns, {"deletions": [], "entities": entities})


def walls(level: Level) -> tuple[int, Color, list[Place]]:
    """The plan's walls for `scene`, at the level's height; the first `MOST_WALLS` of them."""
    points: list[Place] = []
    for x0, y0, x1, y1 in level.solid[:MOST_WALLS].tolist():
        points += [(x0, y0, level.height_m), (x1, y1, level.height_m)]
    return LINE_LIST, WALL, points


def _entity(t_ns: int, name: str, kind: int, color: Color, points: Sequence[Place]) -> dict[str, Any]:
    line = {
        "type": kind,
        "pose": {"position": vector((0.0, 0.0, 0.0)), "orientation": about_vertical(0.0)},
        "thickness": LINE_PIXELS,
        "scale_invariant": True,
        "points": [vector(p) for p in points],
        "color": dict(zip("rgba", color, strict=True)),
        "colors": [],
        "indices": [],
    }
    return {
        "timestamp": time_of(t_ns),
        "frame_id": MAP_FRAME,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        "lines": [line],
        **{solid: [] for solid in _SOLIDS},
    }
