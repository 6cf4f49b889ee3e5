"""Which format a file is in, and the plan in it.

In: a path. Out: `Plan`. Owns the list of formats.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from echostep.errors import EchostepError
from echostep.plan.model import Plan, load_plan
from echostep.plan.writer import plan_json

STOREY_M = 3.5  # from floor to floor, where a format does not say
OTHERS = {".dxf", ".ifc", ".imdf", ".osm", ".xml", ".zip"}  # what is no plan.json, by its name


@dataclass(frozen=True, slots=True)
class Hints:
    """What a file may leave open: the height of a storey, units and layers of drawings."""

    storey_m: float = STOREY_M
    units: str | None = None
    layers: Mapping[str, Sequence[str]] = field(default_factory=dict)


def import_plan(path: Path, hints: Hints | None = None, above: Sequence[Path] = ()) -> Plan:
    """The plan in a file of another program (drawings: one file a storey, more of them `above`); EchostepError names the file and the place in it."""
    plan = _imported(path, hints or Hints(), above)
    return replace(plan, digest=hashlib.sha256(plan_json(plan).encode()).hexdigest())


def open_plan(path: Path | str) -> Plan:
    """A plan.json as it is; anything else by import, where it says enough about itself. EchostepError names the file and the place in it."""
    path = Path(path)
    if path.is_dir() or path.suffix.casefold() in OTHERS or path.name in ("main.json", "core.txt"):
        return import_plan(path)
    return load_plan(path)


def _imported(path: Path, hints: Hints, above: Sequence[Path]) -> Plan:
    if path.suffix.casefold() == ".dxf":
        from echostep.plan.importers.dxf.drawing import import_dxf

        return import_dxf([path, *above], hints.storey_m, hints.layers, hints.units)
    if above:
        raise EchostepError(f"{above[0]}: only drawings (DXF) come in several files")
    if path.suffix.casefold() in (".osm", ".xml") or (
        path.suffix.casefold() == ".json" and _starts(path, '"elements"')
    ):
        from echostep.plan.importers.osm.building import import_osm

        return import_osm(path, hints.storey_m)
    if path.name == "main.json" or (path / "main.json").exists():
        from echostep.plan.importers.wrld import import_wrld

        return import_wrld(path / "main.json" if path.is_dir() else path, hints.storey_m)
    if path.suffix.casefold() == ".ifc":
        from echostep.plan.importers.ifc import import_ifc

        return import_ifc(path)
    if path.suffix.casefold() in (".zip", ".imdf") or (path / "manifest.json").exists():
        from echostep.plan.importers.imdf import import_imdf

        return import_imdf(path, hints.storey_m)
    if path.name == "core.txt" or (path / "core.txt").exists():
        from echostep.plan.importers.nodelink import import_nodelink

        return import_nodelink(path / "core.txt" if path.is_dir() else path)
    if not path.exists():
        raise EchostepError(f"{path}: no such file")
    raise EchostepError(f"{path}: no format of plans that echostep knows")


def _starts(path: Path, text: str) -> bool:
    """Whether these letters stand near the beginning of a file."""
    try:
        with path.open("rb") as file:
            return text.encode() in file.read(4096)
    except OSError:
        return False
