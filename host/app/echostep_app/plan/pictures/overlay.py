# SPDX-License-Identifier: MIT
"""A plan as pictures on the map: KMZ with a ground overlay a storey, which ATAK loads as a GRG (gridded reference graphic).

In: a plan with a georeference. Out: a KMZ file [OGC 07-147r2, KML 2.2, 11.2 and 11.3]. Owns nothing.

The pictures are drawn with north up, so their boxes need no `rotation`, which readers of KML implement differently or not at all. Where there is no
building they are transparent.
"""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.file_mode import keep_earlier
from echostep.plan import Plan
from echostep_app.plan.cropping import Bounds, extent
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.pictures.drawing import draw_bare_level
from echostep_app.printing.lines import as_error, faults_of

KML = "http://www.opengis.net/kml/2.2"
PIXELS_PER_M, MOST_PX = 40.0, 4096  # a door is 36 pixels wide; the largest texture of older phones
EDGE_M = 1.0  # around the walls
EPOCH = (1980, 1, 1, 0, 0, 0)  # of every file in the archive, so that the same plan gives the same bytes


@dataclass(frozen=True, slots=True)
class Overlay:
    """A picture (PNG) of a storey and its box on Earth, degrees in WGS 84."""

    name: str
    png: bytes
    north: float
    south: float
    east: float
    west: float


def write_overlays(plan: Plan, out: Path) -> list[Overlay]:
    """Write the KMZ file; returns its overlays. Raises EchostepError without a georeference, and when the file cannot be written."""
    if out.suffix.casefold() != ".kmz":
        raise EchostepError(f"{out}: give a name that ends in .kmz")
    pictures = overlays(plan)
    with as_error(f"cannot write {out}"), zipfile.ZipFile(keep_earlier(out), "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("doc.kml", EPOCH), _document(plan, pictures))
        for k, overlay in enumerate(pictures):
            archive.writestr(zipfile.ZipInfo(_file_name(k), EPOCH), overlay.png)
    return pictures


def overlays(plan: Plan) -> list[Overlay]:
    """An overlay of each level that has walls, the lowest first; raises EchostepError without a georeference or without walls."""
    if plan.georeference is None:
        raise EchostepError(
            f"plan {plan.name}: an overlay needs a georeference: add longitude and latitude of the map's origin to the plan"
        )
    with faults_of(f"plan {plan.name}"):
        earth = EarthTransform(replace(plan.georeference, rotation_rad=0.0))
    turned = north_up(plan)
    walled = [k for k, level in enumerate(turned.levels) if len(level.solid)]
    if not walled:
        raise EchostepError(f"plan {plan.name}: no level has walls")
    return [_overlay(turned, k, earth) for k in sorted(walled, key=lambda k: turned.levels[k].height_m)]


def north_up(plan: Plan) -> Plan:
    """The same plan with x to the east and y to the north."""
    assert plan.georeference is not None
    c, s = np.cos(plan.georeference.rotation_rad), np.sin(plan.georeference.rotation_rad)
    rotation = np.array([[c, -s], [s, c]])

    def turn(points: Floats) -> Floats:
        """Points (n, 2), or segments (n, 4)."""
        return np.asarray((points.reshape(-1, 2) @ rotation.T).reshape(points.shape))

    levels = tuple(
        replace(
            level,
            walls=turn(level.walls),
            windows=turn(level.windows),
            doubtful=turn(level.doubtful),
            place_sd=np.column_stack([turn(level.place_sd[:, :2]), level.place_sd[:, 2]]),
            obstacles=tuple(turn(corners) for corners in level.obstacles),
            doors=tuple(replace(door, line=_four(turn, door.line)) for door in level.doors),
            rooms=tuple(
                replace(
                    room, at_m=_two(turn, room.at_m), outline_m=None if room.outline_m is None else turn(room.outline_m)
                )
                for room in level.rooms
            ),
        )
        for level in plan.levels
    )
    connectors = tuple(replace(way, outline_m=turn(way.outline_m)) for way in plan.connectors)
    return replace(
        plan,
        levels=levels,
        connectors=connectors,
        start=None,
        georeference=replace(plan.georeference, rotation_rad=0.0),
    )


def _two(turn: Callable[[Floats], Floats], at_m: tuple[float, float]) -> tuple[float, float]:
    x, y = turn(np.array(at_m)).tolist()
    return x, y


def _four(
    turn: Callable[[Floats], Floats], line: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    x0, y0, x1, y1 = turn(np.array(line)).tolist()
    return x0, y0, x1, y1


def _overlay(plan: Plan, level: int, earth: EarthTransform) -> Overlay:
    """The picture of a level whose y axis points north; the box of its edges' middles, right to a centimetre within a kilometre."""
    x0, y0, x1, y1 = extent(plan.levels[level].solid)
    bounds: Bounds = (x0 - EDGE_M, y0 - EDGE_M, x1 + EDGE_M, y1 + EDGE_M)
    width_m, height_m = bounds[2] - bounds[0], bounds[3] - bounds[1]
    pixels = min(PIXELS_PER_M, MOST_PX / max(width_m, height_m))
    file = io.BytesIO()
    draw_bare_level(plan, level, bounds, pixels, file)
    x, y = 0.5 * (bounds[0] + bounds[2]), 0.5 * (bounds[1] + bounds[3])
    sides = np.array([(x, bounds[3]), (x, bounds[1]), (bounds[2], y), (bounds[0], y)])
    degrees = earth.degrees(sides)
    north, south, east, west = float(degrees[0, 1]), float(degrees[1, 1]), float(degrees[2, 0]), float(degrees[3, 0])
    return Overlay(plan.levels[level].name, file.getvalue(), north, south, east, west)


def _document(plan: Plan, pictures: list[Overlay]) -> bytes:
    ET.register_namespace("", KML)
    root = ET.Element(f"{{{KML}}}kml")
    document = _element(root, "Document")
    _element(document, "name", plan.name)
    for k, overlay in enumerate(pictures):
        ground = _element(document, "GroundOverlay")
        _element(ground, "name", f"{plan.name}: {overlay.name}" if len(pictures) > 1 else plan.name)
        _element(ground, "visibility", str(int(k == 0)))
        _element(ground, "drawOrder", str(k))
        _element(_element(ground, "Icon"), "href", _file_name(k))
        box = _element(ground, "LatLonBox")
        for side in ("north", "south", "east", "west"):
            _element(box, side, f"{getattr(overlay, side):.9f}")
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True)


def _file_name(k: int) -> str:
    return f"files/level-{k}.png"


def _element(parent: ET.Element, name: str, text: str | None = None) -> ET.Element:
    element = ET.SubElement(parent, f"{{{KML}}}{name}")
    element.text = text
    return element
