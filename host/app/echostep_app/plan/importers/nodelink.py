# SPDX-License-Identifier: MIT
"""Node and link text (`biba`): core.txt, node.txt, link.txt, arrow.txt, polygon.txt -> `Plan`.

In: core.txt. Out: `Plan`. Owns nothing. Nodes are pixels of a picture, y down, `scale` metres each; links are walls; an arrow is a flight of stairs
(0 down, 1 up, 2 both), and the zone of type 1 around it is its outline. Zones of type 0 have no access; their links are walls already, so they are
left out. The start is left out too, because the format does not state the direction of its angle 0.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from shapely.geometry import LineString, Polygon

from echostep.errors import EchostepError
from echostep.fields import LIMIT_M
from echostep.plan import Plan
from echostep_app.plan.georeference import IN_GRID, grid_origin
from echostep_app.plan.importers.connector_shapes import plan_of
from echostep_app.plan.importers.drawn_level import ConnectorShape, DrawnLevel, areas
from echostep_app.plan.importers.parsing import beside, finite, read_text
from echostep_app.plan.importers.report import ImportReport

MOST_FLOORS = 200
ZONE_WITH_STAIRS = "1"


class Node(NamedTuple):
    """A corner of a wall: `layer` (index of the level), x and y in metres."""

    layer: int
    x_m: float
    y_m: float


def import_nodelink(core: Path, report: ImportReport) -> Plan:
    """Import the building of a core.txt; raises EchostepError that names the file and the line."""
    settings = {row[0]: row[1:] for _, row in _rows(core, 1)}
    levels = int(_setting(core, settings, "floor", MOST_FLOORS))
    height_m = _setting(core, settings, "height", 100.0)
    nodes = _nodes(_beside(core, settings, "node"), levels, _setting(core, settings, "scale", 1000.0), report)
    drawn_levels = [DrawnLevel(f"floor {i}", i * height_m) for i in range(levels)]
    for where, row in _rows(_beside(core, settings, "link"), 4, skip=1):
        a, b = (_node(nodes, text, where) for text in row[2:4])
        if a.layer != b.layer:
            raise EchostepError(f"{where}: a wall from floor {a.layer} to floor {b.layer}")
        if a[1:] != b[1:]:
            drawn_levels[a.layer].walls.append(LineString((a[1:], b[1:])))
        else:
            report.leave_out("link without length")
    _stairs(core, settings, nodes, drawn_levels, report)
    return plan_of(core.parent.name, drawn_levels, report)


def _nodes(path: Path, levels: int, scale_m: float, report: ImportReport) -> dict[str, Node]:
    """All nodes in metres; y points up and is 0 at the lowest node."""
    rows = []
    for where, row in _rows(path, 4, skip=1):
        layer, x, y = (finite(text, where) for text in row[1:4])
        if layer not in range(levels):
            raise EchostepError(f"{where}: floor {row[1]} of {levels}")
        rows.append((where, row[0], int(layer), x * scale_m, -y * scale_m))
    lowest = min((y for *_, y in rows), default=0.0)
    far_x, _ = grid_origin(np.array([(x, 0.0) for *_, x, _ in rows]).reshape(-1, 2))
    if far_x:
        report.doubt(IN_GRID.format("the building", far_x, lowest))
    nodes = {}
    for where, key, layer, x, y in rows:
        nodes[key] = Node(layer, round(x - far_x, 3), round(y - lowest, 3))
        if max(abs(nodes[key].x_m), nodes[key].y_m) > LIMIT_M:
            raise EchostepError(f"{where}: further than {LIMIT_M / 1000:.0f} km from the origin: is scale right?")
    return nodes


def _stairs(
    core: Path,
    settings: dict[str, list[str]],
    nodes: dict[str, Node],
    drawn_levels: list[DrawnLevel],
    report: ImportReport,
) -> None:
    """Stairs for each arrow inside a zone, to the levels that the arrow points to."""
    zones: list[tuple[int, Polygon]] = []
    for where, row in _rows(_beside(core, settings, "polygon"), 3, skip=1):
        corners = [_node(nodes, text, where) for text in row[3:]]
        if len({node.layer for node in corners}) > 1 or len(corners) < 3:
            raise EchostepError(f"{where}: a zone needs three nodes or more, all on one floor")
        if row[1] == ZONE_WITH_STAIRS:
            zones += [(corners[0].layer, area) for area in areas([Polygon([node[1:] for node in corners])])]
        else:
            report.leave_out(f"zone of type {row[1][:20]}")
    for where, row in _rows(_beside(core, settings, "arrow"), 4, skip=1):
        a, b = (_node(nodes, text, where) for text in row[2:4])
        middle = LineString((a[1:], b[1:])).interpolate(0.5, normalized=True)
        zone = next((area for layer, area in zones if layer == a.layer and area.contains(middle)), None)
        steps = {"0": (-1,), "1": (1,), "2": (-1, 1)}.get(row[1])
        if steps is None:
            raise EchostepError(f"{where}: type {row[1][:20]!r}: expected 0 (down), 1 (up) or 2 (both)")
        levels = tuple(a.layer + step for step in steps if 0 <= a.layer + step < len(drawn_levels))
        if zone is not None:
            drawn_levels[a.layer].connectors.append(ConnectorShape("stairs", "", zone, levels))
        else:
            report.leave_out("arrow in no zone of stairs")


def _rows(path: Path, least: int, skip: int = 0) -> Iterator[tuple[str, list[str]]]:
    """Rows of a CSV file with their file and line; raises EchostepError for a row with less than `least` fields."""
    try:
        for number, row in enumerate(csv.reader(read_text(path).splitlines()), 1):
            if number > skip and row:
                if len(row) < least:
                    raise EchostepError(f"{path}: line {number}: expected {least} fields or more")
                yield f"{path}: line {number}", [text.strip() for text in row]
    except csv.Error as error:
        raise EchostepError(f"{path}: {error}") from error


def _setting(core: Path, settings: dict[str, list[str]], key: str, most: float) -> float:
    """A number from core.txt, greater than 0 and at most `most`."""
    text = (settings.get(key) or [""])[0]
    value = finite(text, f"{core}: {key}")
    if not 0.0 < value <= most:
        raise EchostepError(f"{core}: {key}: {text[:40]!r} is not between 0 and {most:g}")
    return value


def _beside(core: Path, settings: dict[str, list[str]], key: str) -> Path:
    """The file that core.txt names for `key`."""
    return beside(core, (settings.get(key) or [f"{key}.txt"])[0], key)


def _node(nodes: dict[str, Node], text: str, where: str) -> Node:
    if (node := nodes.get(text)) is None:
        raise EchostepError(f"{where}: there is no node {text[:20]!r}")
    return node
