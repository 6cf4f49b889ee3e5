# SPDX-License-Identifier: MIT
"""A track as GPX, for maps and outdoor programs.

In: places on Earth with their times of day. Out: a GPX file [Topografix, GPX 1.1 schema]. Owns nothing. Heights are left out: `ele` is metres above
the sea, to which a plan's heights are not tied.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from echostep.arrays import Floats

GPX = "http://www.topografix.com/GPX/1/1"


def write_gpx(path: Path, name: str, stretches: Sequence[tuple[Floats, Sequence[str]]]) -> None:
    """Write one track; each stretch has longitudes and latitudes (n, 2) in degrees, WGS 84, and n times of day, or none."""
    ET.register_namespace("", GPX)
    root = ET.Element(f"{{{GPX}}}gpx", version="1.1", creator="echostep")
    _element(_element(root, "metadata"), "name", name)
    track = _element(root, "trk")
    _element(track, "name", name)
    for lon_lat_deg, moments in stretches:
        segment = _element(track, "trkseg")
        for k, (lon, lat) in enumerate(lon_lat_deg.tolist()):
            point = _element(segment, "trkpt", lat=f"{lat:.9f}", lon=f"{lon:.9f}")
            if moments:
                _element(point, "time", moments[k])
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _element(parent: ET.Element, name: str, text: str | None = None, **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, f"{{{GPX}}}{name}", attributes)
    element.text = text
    return element
