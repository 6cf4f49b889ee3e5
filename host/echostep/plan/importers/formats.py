# SPDX-License-Identifier: MIT
"""Recognises the format of a file and calls its importer.

In: a path, and hints. Out: `Plan`. Owns the list of formats.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from echostep.errors import EchostepError
from echostep.plan.importers.hints import Hints
from echostep.plan.importers.parsing import FORMATS
from echostep.plan.importers.report import ImportReport
from echostep.plan.model import Plan, load_plan
from echostep.plan.writer import plan_json

OTHERS = {
    ".dxf",
    ".geojson",
    ".ifc",
    ".ifczip",
    ".imdf",
    ".osm",
    ".xml",
    ".zip",
}  # suffixes of files that are imported, not read as plan.json
SNIFFED_BYTES = 4096  # read to recognise a format


def import_plan(
    path: Path, hints: Hints | None = None, above: Sequence[Path] = (), report: ImportReport | None = None
) -> Plan:
    """Import a file of another program; of drawings one file per level, `above` are the files of the higher levels. Fills the report.

    Raises EchostepError that names the file and the position in it.
    """
    hints = hints or Hints()
    if hints.doors_m is not None and not _is_imdf(path):
        raise EchostepError(f"{path}: --doors is for IMDF alone: draw doors with echostep plan edit")
    drawn = {
        "--units": hints.units,
        "--scale": hints.scale_m,
        "--window": hints.windows,
        "--layer": hints.layers,
        "--align": hints.align,
    }
    given = [option for option, value in {**drawn, "--level": hints.level_names}.items() if value]
    if given and path.suffix.casefold() != ".dxf":
        raise EchostepError(
            f"{path}: {' and '.join(given)} {'is' if len(given) == 1 else 'are'} for drawings (DXF) alone"
        )
    plan = _imported(path, hints, above, ImportReport() if report is None else report)
    return replace(plan, digest=hashlib.sha256(plan_json(plan).encode()).hexdigest())


def open_plan(path: Path | str) -> Plan:
    """Read plan.json, or import another format without hints. Raises EchostepError that names the file and the position in it."""
    path = Path(path)
    return import_plan(path) if is_foreign(path) else load_plan(path)


def is_foreign(path: Path) -> bool:
    """Whether a file is of another format than plan.json, by its name."""
    return path.is_dir() or path.suffix.casefold() in OTHERS or path.name in ("main.json", "core.txt") or _is_map(path)


def _imported(path: Path, hints: Hints, above: Sequence[Path], report: ImportReport) -> Plan:
    if path.suffix.casefold() == ".dxf":
        from echostep.plan.importers.dxf.drawing import import_dxf

        return import_dxf([path, *above], hints, report)
    if above:
        raise EchostepError(f"{above[0]}: only drawings (DXF) may be given as several files: give one file or folder")
    if path.suffix.casefold() in (".osm", ".xml", ".geojson") or _is_map(path):
        from echostep.plan.importers.osm.building import import_osm

        return import_osm(path, hints.storey_height_m, report)
    if path.name == "main.json" or (path / "main.json").exists():
        from echostep.plan.importers.wrld import import_wrld

        return import_wrld(path / "main.json" if path.is_dir() else path, hints.storey_height_m, report)
    if path.suffix.casefold() in (".ifc", ".ifczip"):
        from echostep.plan.importers.ifc.building import import_ifc

        return import_ifc(path, report)
    if _is_imdf(path):
        from echostep.plan.importers.imdf.venue import import_imdf

        return import_imdf(path, hints.storey_height_m, hints.doors_m, report)
    if path.name == "core.txt" or (path / "core.txt").exists():
        from echostep.plan.importers.nodelink import import_nodelink

        return import_nodelink(path / "core.txt" if path.is_dir() else path)
    if not path.exists():
        raise EchostepError(f"{path}: no such file")
    raise EchostepError(f"{path}: no format of plans that echostep knows: give {FORMATS}")


def _is_imdf(path: Path) -> bool:
    names = ("manifest.json", "level.geojson", "level.json")
    return path.suffix.casefold() in (".zip", ".imdf") or any((path / name).exists() for name in names)


def _is_map(path: Path) -> bool:
    """Whether a JSON file is of OpenStreetMap: of Overpass, or GeoJSON."""
    begins = [_begins_with(path, text) for text in ('"elements"', '"FeatureCollection"', '"echostep_plan"')]
    return path.suffix.casefold() == ".json" and any(begins[:2]) and not begins[2] and path.name != "main.json"


def _begins_with(path: Path, text: str) -> bool:
    """Whether a text occurs in the first `SNIFFED_BYTES` of a file."""
    try:
        with path.open("rb") as file:
            return text.encode() in file.read(SNIFFED_BYTES)
    except OSError:
        return False
