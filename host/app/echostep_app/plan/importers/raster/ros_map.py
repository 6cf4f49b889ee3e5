# SPDX-License-Identifier: MIT
"""Maps of ROS navigation (map.yaml and a picture, as map_server and nav2 save them) -> `Plan`.

In: map.yaml. Out: `Plan` of one level. Owns nothing. Occupied pixels become walls by their outlines [nav2_map_server, map_io: p = (255 - value) /
255, or value / 255 with negate; in raw mode a value up to 100 is p in percent, and a greater one unknown]; the origin is the pose of the lower left
corner. Other things that the robot saw are in the picture too, and stay.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from shapely.affinity import affine_transform

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.georeference import EARTH_M, IN_GRID, grid_origin
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import DrawnLevel
from echostep_app.plan.importers.parsing import finite, read_text
from echostep_app.plan.importers.raster.tracing import grey, trace
from echostep_app.plan.importers.report import ImportReport

OCCUPIED = 0.65  # default of map_server
LARGEST_PIXEL_M = 10.0
UNKNOWN = 128  # value of a transparent pixel: neither free nor occupied
FIELD = re.compile(
    r"""^["']?(\w+)["']?[ \t]*:[ \t]*(\[[^\]]{0,999}\]|(?:[ \t]*(?:#[^\n]*)?\n[ \t]*-[ \t][^\n]*){1,9}|[^\n]*)""",
    re.MULTILINE,
)
FLOW_COMMA = re.compile(r",[ \t]*(?![^\[\]]{0,999}\])")  # outside of lists
LONGEST_NAME = 255
YES, NO = ("true", "yes", "on", "y"), ("false", "no", "off", "n")
RAW_MOST = 100.0  # in raw mode, a greater value is unknown


def import_ros_map(path: Path, report: ImportReport) -> Plan:
    """Import the map of a map.yaml; raises EchostepError that names the file and the field."""
    fields = _fields(path)
    if not fields.get("image"):
        raise EchostepError(f"{path}: no field image: is this a map.yaml of ROS?")
    pixel_m = _number(path, fields, "resolution", LARGEST_PIXEL_M)
    if pixel_m <= 0.0:
        raise EchostepError(f"{path}: resolution: expected metres a pixel, more than 0")
    x, y, yaw = _origin(path, fields)
    picture = path.parent / fields["image"][:LONGEST_NAME]
    if not picture.exists() and (beside := path.with_name(picture.name)).exists():
        report.doubt(f"image: {picture} is not on this computer: {beside.name} beside it was taken")
        picture = beside
    probability = _probability(path, fields, grey(picture, UNKNOWN))
    outlines, noise = trace(probability > _number(path, fields, "occupied_thresh", 1.0, OCCUPIED), picture)
    if not outlines:
        raise EchostepError(f"{picture}: no pixel is occupied (occupied_thresh, negate): is this the map?")
    far_x, far_y = grid_origin(np.array([[x, y]]))
    if (far_x, far_y) != (0.0, 0.0):
        report.doubt(IN_GRID.format("the map", far_x, far_y))
    c, s = pixel_m * math.cos(yaw), pixel_m * math.sin(yaw)
    walls = [affine_transform(area, (c, -s, s, c, x - far_x, y - far_y)) for area in outlines]
    report.units = f"{pixel_m:g} m a pixel (resolution)"
    if noise:
        report.leave_out("specks of less than 4 pixels", noise)
    report.doubt(
        "traced from what a robot saw: furniture and people are walls too, and doors that stood open are gaps; echostep plan edit corrects it"
    )
    return plan_of(path.stem, [DrawnLevel(path.stem, 0.0, walls=[*walls])], report)


def _probability(path: Path, fields: dict[str, str], values: Floats) -> Floats:
    """How likely each pixel is occupied, 0 to 1; an unknown one is not."""
    mode = fields.get("mode", "trinary").casefold()
    if mode == "raw":
        return np.where(values <= RAW_MOST, values / RAW_MOST, 0.0)
    if mode not in ("trinary", "scale"):
        raise EchostepError(f"{path}: mode: {mode[:40]!r} is none of trinary, scale and raw")
    dark = 1.0 - values / 255.0
    return 1.0 - dark if _number(path, fields, "negate", 1.0, 0.0) else dark


def _fields(path: Path) -> dict[str, str]:
    """The fields of a flat YAML file, in block or flow style; a list is joined by commas."""
    whole = read_text(path).strip()
    if whole.startswith("{"):
        whole = FLOW_COMMA.sub("\n", whole.strip("{} \n"))
    fields: dict[str, str] = {}
    for name, value in FIELD.findall(whole):
        items = [item.split(" #")[0].strip().removeprefix("- ") for item in value.strip().splitlines()]
        fields[name] = ",".join(item.strip(" ,") for item in items if item).strip("\"'")
    return fields


def _origin(path: Path, fields: dict[str, str]) -> tuple[float, float, float]:
    """Position (m) and direction (rad) of the picture's lower left corner."""
    parts = fields.get("origin", "0,0,0").strip("[] ").split(",")
    numbers = [_number(path, {"origin": part}, "origin", EARTH_M) for part in parts]
    if len(numbers) not in (2, 3):
        raise EchostepError(f"{path}: origin: expected [x, y, yaw]")
    return numbers[0], numbers[1], numbers[2] if len(numbers) == 3 else 0.0


def _number(path: Path, fields: dict[str, str], name: str, most: float, otherwise: float | None = None) -> float:
    """A number between -`most` and `most`; `otherwise` when the file has none."""
    text = fields.get(name, "").casefold()
    if text in ("", "~", "null") and otherwise is not None:
        return otherwise
    text = "1" if text in YES else "0" if text in NO else text
    value = finite(text, f"{path}: {name}")
    if not abs(value) <= most:
        raise EchostepError(f"{path}: {name}: {value:g} is not between {-most:g} and {most:g}")
    return value
