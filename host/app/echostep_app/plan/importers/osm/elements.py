# SPDX-License-Identifier: MIT
"""Nodes, ways and multipolygons of an OpenStreetMap file, and the numbers of its level tags.

In: XML, the JSON of Overpass (`out body; >; out skel;` or `out geom;`), or GeoJSON; tags (`level=0;1`, `level=-1-2`,
`repeat_on=3-5`). Out: `Elements`; level numbers, ascending. Owns nothing. XML with an entity or a DTD is refused.
"""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import LineString

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep_app.plan.importers.osm.geojson_rows import geojson_rows, without_names
from echostep_app.plan.importers.parsing import FORMATS, GML, number, parse_json, read_text, typed
from echostep_app.printing.lines import faults_of

RANGE = re.compile(r"^(-?\d+(?:\.\d+)?)\s*-\s*(-?\d+(?:\.\d+)?)$")
MOST = 300  # greatest level number, and most levels in a range
DECIMALS = 7  # of a degree: the resolution of OpenStreetMap
FIRST_ID = 1 << 62  # of nodes that have a position alone: no element of OpenStreetMap has such an id
Tags = dict[str, str]


def levels_of(tags: Mapping[str, str], where: str = "") -> list[float]:
    """The level numbers of an element; empty when no tag can be read. Raises EchostepError for an impossible range."""
    texts = f"{tags.get('level', '')};{tags.get('repeat_on', '')}".replace("\u2212", "-").split(";")
    levels: set[float] = set()
    for text in (text.strip() for text in texts):
        if match := RANGE.match(text):
            low, high = float(match[1]), float(match[2])
            if not 0 <= high - low <= MOST:
                raise EchostepError(f"{where}: level {text[:40]!r} is no range of levels: expected LOW-HIGH, as 0-5")
            levels |= {low + step for step in range(int(high - low) + 1)}
        else:
            try:
                level = float(text)
            except ValueError:
                continue
            if math.isfinite(level) and abs(level) <= MOST:
                levels.add(level)
    return sorted(levels)


@dataclass(slots=True)
class Elements:
    """The elements of a file by id. `degrees`: longitude and latitude of nodes; `at_m`: their map positions, filled by `project`."""

    degrees: dict[int, tuple[float, float]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)
    ways: dict[int, list[int]] = field(default_factory=dict)
    way_tags: dict[int, Tags] = field(default_factory=dict)
    relations: list[tuple[int, list[tuple[int, str]], Tags]] = field(default_factory=list)
    member_ways: dict[int, list[int]] = field(default_factory=dict)
    at_m: dict[int, tuple[float, float]] = field(default_factory=dict)
    other_relations: int = 0
    at_place: dict[tuple[float, float], int] = field(default_factory=dict)  # nodes that have a position alone

    def lines(self) -> Iterator[tuple[str, list[int], Tags]]:
        """Name, nodes and tags of ways, and of the rings of multipolygons; only lines of two nodes or more. Inner rings have no name."""
        for key, nodes in self.ways.items():
            if len(nodes) > 1:
                yield f"way {key}", nodes, self.way_tags[key]
        for key, members, tags in self.relations:
            for inner in (False, True):
                ways = [
                    self.ways.get(ref, self.member_ways.get(ref, []))
                    for ref, role in members
                    if (role == "inner") == inner
                ]
                for nodes in rings([way for way in ways if len(way) > 1]):
                    yield f"relation {key}", nodes, without_names(tags) if inner else tags

    def nodes(self) -> Iterator[tuple[int, Tags]]:
        """Nodes with tags."""
        return ((key, tags) for key, tags in self.node_tags.items() if tags)

    def levels(self, file: Path) -> set[float]:
        """The level numbers of all lines with an indoor tag."""
        indoor = ((name, tags) for name, _, tags in self.lines() if tags.get("indoor", "no") != "no")
        return {level for name, tags in indoor for level in levels_of(tags, f"{file}: {name}")}

    def through(self, node: int) -> int:
        """The node by which ways pass through a node's place: itself, or one that has a position alone."""
        return self.at_place.get(_rounded(self.degrees[node]), node)

    def project(self, metres: Callable[[Floats], Floats]) -> None:
        """Fill `at_m` by the projection `metres`: (n, 2) degrees -> (n, 2) map metres."""
        positions = metres(np.array(list(self.degrees.values())).reshape(-1, 2))
        self.at_m = {key: (float(x), float(y)) for key, (x, y) in zip(self.degrees, positions, strict=True)}

    def line(self, nodes: list[int]) -> LineString | None:
        """The line through nodes in map metres; None when all are at one position."""
        positions = [self.at_m[node] for node in nodes]
        return LineString(positions) if len(set(positions)) > 1 else None


def rings(ways: list[list[int]]) -> list[list[int]]:
    """Ways joined where they share an end, until they are closed: the parts of a multipolygon's outline may be drawn in any direction."""
    left, joined = [list(way) for way in ways], []
    while left:
        line = left.pop()
        while line[0] != line[-1]:
            following = next((way for way in left if line[-1] in (way[0], way[-1])), None)
            if following is None:
                break
            left.remove(following)
            line += following[1:] if following[0] == line[-1] else following[-2::-1]
        joined.append(line)
    return joined[::-1]


def read_osm(path: Path) -> Elements:
    """Read the elements of a file; raises EchostepError that names the file and the element."""
    text = read_text(path)
    with faults_of(path):
        rows = _json_rows(text, path) if text.lstrip()[:1] == "{" else _xml_rows(text)
        elements = Elements()
        for row in rows:
            _add(elements, row)
        for key, nodes in elements.ways.items():  # an extract cuts ways at its edge
            elements.ways[key] = [node for node in nodes if node in elements.degrees]
    return elements


def _json_rows(text: str, path: Path) -> list[Any]:
    tree = typed(parse_json(text, str(path)), "the file", dict)
    if tree.get("type") == "FeatureCollection":
        return list(geojson_rows(tree))
    return list(typed(tree.get("elements"), "elements", list))


def _xml_rows(text: str) -> list[dict[str, Any]]:
    """The elements of XML, in the form of Overpass JSON."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("it has a DTD or entities, which OSM files do not have: download it again")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise ValueError(f"not XML: {error}") from error
    if root.tag != "osm":
        name = root.tag.rpartition("}")[2][:40]
        gml = "opengis.net" in root.tag
        raise ValueError(f"this XML is <{name}>, not <osm>: {GML if gml else f'plans are read as {FORMATS}'}")
    return [_xml_row(element) for element in root if element.tag in ("node", "way", "relation")]


def _xml_row(element: ET.Element) -> dict[str, Any]:
    row: dict[str, Any] = {key: _json_number(value) for key, value in element.items()} | {"type": element.tag}
    row["tags"] = {tag.get("k", ""): tag.get("v", "") for tag in element.iterfind("tag")}
    row["nodes"] = [_json_number(nd.get("ref")) for nd in element.iterfind("nd[@ref]")]
    row["geometry"] = _xml_places(element)
    row["members"] = [
        {key: _json_number(value) for key, value in member.items()} | {"geometry": _xml_places(member)}
        for member in element.iterfind("member")
    ]
    return row


def _xml_places(element: ET.Element) -> list[dict[str, Any] | None]:
    """The positions that `out geom;` writes into an element."""
    places = [{key: _json_number(nd.get(key)) for key in ("lon", "lat")} for nd in element.iterfind("nd")]
    return [place if place["lon"] is not None else None for place in places]


def _json_number(text: str | None) -> Any:
    """An attribute's text as a JSON value; the text itself when it is not JSON."""
    try:
        return None if text is None else json.loads(text, parse_constant=str)
    except (ValueError, RecursionError):
        return text


def _add(elements: Elements, row: Any) -> None:
    """Check an element (as in Overpass JSON) and add it; relations other than multipolygons are counted."""
    row = typed(row, "elements", dict)
    # In JOSM before the upload, or in an extract with history
    if row.get("action") == "delete" or row.get("visible") is False:
        return
    kind, key = row.get("type"), row.get("id")
    if isinstance(key, bool) or not isinstance(key, int):
        raise ValueError(f"{str(kind)[:20]} {str(key)[:20]!r}: its id is not a whole number")
    where = f"{str(kind)[:20]} {key}"
    tags = {str(k): str(text)[:500] for k, text in typed(row.get("tags") or {}, f"{where}: tags", dict).items()}
    if kind == "node":
        elements.degrees[key] = _degrees(row, where)
        elements.node_tags[key] = tags
    elif kind == "way":
        elements.ways[key], elements.way_tags[key] = _nodes(elements, row, where), tags
    elif kind == "relation" and tags.get("type") == "multipolygon":
        members = [
            typed(member, f"{where}: members", dict)
            for member in typed(row.get("members") or [], f"{where}: members", list)
        ]
        ways = [(m, _ref(m.get("ref"), where)) for m in members if m.get("type") == "way"]
        elements.relations.append((key, [(ref, str(m.get("role"))) for m, ref in ways], tags))
        for m, ref in ways:
            if m.get("geometry"):  # `out geom;` leaves out ways that have no tags of their own
                elements.member_ways[ref] = _nodes(elements, m, where)
    elif kind == "relation":
        elements.other_relations += 1


def _nodes(elements: Elements, row: dict[str, Any], where: str) -> list[int]:
    """The nodes of a way; positions without an id become nodes, equal ones the same one."""
    refs = [_ref(ref, where) for ref in typed(row.get("nodes") or [], f"{where}: nodes", list)]
    places = [
        None if place is None else _degrees(typed(place, f"{where}: geometry", dict), where)
        for place in typed(row.get("geometry") or [], f"{where}: geometry", list)
    ]  # None: a node outside the box that was asked for
    if not refs:
        rounded = [_rounded(place) for place in places if place is not None]
        refs = [elements.at_place.setdefault(place, FIRST_ID + len(elements.at_place)) for place in rounded]
        places = list(rounded)
    for node, place in zip(refs, places, strict=False):
        if place is not None:
            elements.degrees.setdefault(node, place)
    return refs


def _rounded(place: tuple[float, float]) -> tuple[float, float]:
    return round(place[0], DECIMALS), round(place[1], DECIMALS)


def _degrees(row: dict[str, Any], where: str) -> tuple[float, float]:
    lon, lat = number(row.get("lon"), f"{where}: lon", 180.0, "degrees"), row.get("lat")
    return lon, number(lat, f"{where}: lat", 90.0, "degrees")


def _ref(value: Any, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ValueError(f"{where}: {str(value)[:20]!r} is not the id of an element")
    return value
