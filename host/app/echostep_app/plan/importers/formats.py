# SPDX-License-Identifier: MIT
"""Recognises the format of a file and calls its importer.

In: a path, and hints. Out: `Plan`. Owns the list of formats.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError
from echostep.plan import Plan
from echostep_app.plan.importers.parsing import FORMATS, GML
from echostep_app.plan.importers.report import Hints, ImportReport
from echostep_app.plan.importers.storey_names import in_order
from echostep_app.plan.writer import plan_json

# Traced with --scale
PICTURES = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".pbm", ".bmp", ".tif", ".tiff", ".gif", ".webp")
TRACE = (
    "a picture: --scale X0,Y0,X1,Y1=M traces what is dark in it (two points in pixels, their distance in metres), "
    "or echostep plan edit PLAN --picture FILE draws over it (PNG, JPEG)"
)
NEXT_STEPS = {  # formats that are not read, and what to do
    **dict.fromkeys(PICTURES, f"{TRACE}; a map of ROS is imported by its map.yaml"),
    ".svg": "SVG: save it as DXF (Inkscape: Save a Copy, Desktop Cutting Plotter), or echostep plan edit PLAN --picture FILE draws over it",
    ".heic": f"save it as PNG or JPEG, then it is {TRACE}",
    ".pdf": f"PDF: make a picture of its page (pdftoppm -png -r 150 FILE page), then page-1.png is {TRACE}",
    ".dwg": "DWG: save it as DXF (in AutoCAD SAVEAS, or with the free ODA File Converter)",
    ".dgn": "DGN: save it as DXF",
    ".dwf": "DWF: save the drawing that it was made of as DXF",
    **dict.fromkeys((".rvt", ".rfa", ".pln", ".skp", ".3dm"), "a model of its own program: export it there as IFC, or a floor plan as DXF"),
    **dict.fromkeys((".ifcxml", ".ifcjson"), "export it as IFC (STEP, .ifc)"),
    ".gml": GML,
    **dict.fromkeys((".shp", ".gpkg", ".kml", ".kmz"), "export it as DXF (QGIS: Project, Import/Export), or map it as OpenStreetMap indoor tags"),
}  # fmt: skip
# Files that are not read as plan.json
OTHERS = {".dxf", ".geojson", ".ifc", ".ifczip", ".imdf", ".osm", ".xml", ".yaml", ".yml", ".zip", *NEXT_STEPS}
ORDER = "give drawings in this order, correct the heights in other files"
HALF_STOREY_M = 1.5  # closer levels are told; assumed
SNIFFED_BYTES = 4096  # read to recognise a format


def import_plan(
    path: Path, hints: Hints | None = None, above: Sequence[Path] = (), report: ImportReport | None = None
) -> Plan:
    """Import a file of another program; drawings have one file per level, `above` are the files of the higher levels. Fills the report.

    Raises EchostepError with the file's name and the position.
    """
    hints = hints or Hints()
    if hints.doors_m is not None and not _is_imdf(path):
        raise EchostepError(f"{path}: --doors is for IMDF alone: draw doors with echostep plan edit")
    drawn: dict[str, Any] = {"--units": hints.units, "--scale": hints.scale_m, "--window": hints.windows}
    drawn |= {"--layer": hints.layers, "--align": hints.align, "--level": hints.level_names}
    suffix, given = path.suffix.casefold(), [option for option, value in drawn.items() if value]
    unread = suffix in {*NEXT_STEPS} - {*PICTURES}
    if given and not unread and suffix != ".dxf" and not (suffix in PICTURES and given == ["--scale"]):
        raise EchostepError(f"{path}: {' and '.join(given)} {'are' if given[1:] else 'is'} for drawings (DXF) alone")
    report = ImportReport() if report is None else report
    plan = _imported(path, hints, above, report)
    names = [level.name for level in plan.levels]
    if (order := in_order(names)) != names:
        report.doubt(
            f"by their names the storeys are {', '.join(order)[:99]} from the lowest, not {', '.join(names)[:99]}: {ORDER}"
        )
    for low, up in pairwise(plan.levels):
        if (off_m := up.height_m - low.height_m) < HALF_STOREY_M:
            report.doubt(f"levels {low.name} and {up.name} are {off_m:.2f} m apart: half storeys, or reference levels?")
    return replace(plan, digest=hashlib.sha256(plan_json(plan).encode()).hexdigest())


def is_foreign(path: Path) -> bool:
    """Whether a file has another format than plan.json, by its name."""
    return path.is_dir() or path.suffix.casefold() in OTHERS or _is_map(path)


def _imported(path: Path, hints: Hints, above: Sequence[Path], report: ImportReport) -> Plan:
    suffix, height_m = path.suffix.casefold(), hints.storey_height_m
    plan: Plan
    if above and suffix != ".dxf":
        raise EchostepError(f"{above[0]}: only drawings (DXF) may be given as several files: give one file or folder")
    if suffix == ".dxf":
        plan = _module("dxf.drawing").import_dxf([path, *above], hints, report)
    elif suffix in (".osm", ".xml", ".geojson") or _is_map(path):
        plan = _module("osm.building").import_osm(path, height_m, report)
    elif suffix in (".ifc", ".ifczip"):
        plan = _module("ifc.building").import_ifc(path, report)
    elif _is_imdf(path):
        plan = _module("imdf.venue").import_imdf(path, height_m, hints.doors_m, report)
    elif suffix in (".yaml", ".yml"):
        plan = _module("raster.ros_map").import_ros_map(path, report)
    elif suffix in PICTURES and hints.scale_m is not None:
        plan = _module("raster.picture").import_picture(path, hints.scale_m, report)
    elif not path.exists():
        raise EchostepError(f"{path}: no such file")
    else:
        raise EchostepError(f"{path}: {NEXT_STEPS.get(suffix, f'no format that echostep knows: give {FORMATS}')}")
    return plan


def _module(name: str) -> Any:
    """An importer, loaded with its libraries when a file of its format is given."""
    return import_module(f"echostep_app.plan.importers.{name}")


def _is_imdf(path: Path) -> bool:
    names = ("manifest.json", "level.geojson", "level.json")
    return path.suffix.casefold() in (".zip", ".imdf") or any((path / name).exists() for name in names)


def _is_map(path: Path) -> bool:
    """Whether a JSON file is from OpenStreetMap: of Overpass, or GeoJSON."""
    begins = [_begins_with(path, text) for text in ('"elements"', '"FeatureCollection"', '"echostep_plan"')]
    return path.suffix.casefold() == ".json" and any(begins[:2]) and not begins[2]


def _begins_with(path: Path, text: str) -> bool:
    """Whether a text occurs in the first `SNIFFED_BYTES` of a file."""
    try:
        with path.open("rb") as file:
            return text.encode() in file.read(SNIFFED_BYTES)
    except OSError:
        return False
