# SPDX-License-Identifier: MIT
"""The file of a building model, and its storeys.

In: an .ifc file, or one packed as .ifczip. Out: the model, names and heights of its storeys. Owns which storeys are reference levels, and which
elements their kind keeps out of a plan.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from echostep.errors import EchostepError
from echostep.fields import LIMIT_M
from echostep_app.extras import require
from echostep_app.plan.importers.imdf.archive import Archive
from echostep_app.plan.importers.parsing import read_bytes
from echostep_app.plan.importers.report import ImportReport

# A storey without walls, doors and rooms nearer than this to another one is its reference level; assumed
REFERENCE_M = 1.0
DIFFERENT_M = 0.1  # between two heights of one storey; assumed
CONTENTS = ("IfcWall", "IfcDoor", "IfcWindow", "IfcSpace", "IfcCurtainWall")
KINDS = ("PredefinedType", "InteriorOrExteriorSpace", "OperationType")  # the latter two in IFC 2x3
NO_ROOMS = {"GFA", "EXTERNAL"}  # gross floor area; outside of the house
NO_LIFTS = {"ESCALATOR", "MOVINGWALKWAY", "CRANEWAY", "LIFTINGGEAR", "HAULINGGEAR", "USERDEFINED"}


class Storey(NamedTuple):
    """A storey: its name, its height (m), how many walls, doors and rooms it contains."""

    name: str
    height_m: float
    contents: int


def open_model(path: Path) -> Any:
    """The model; raises EchostepError when the file is not a model."""
    require(f"{path}: IFC", "ifcopenshell")
    ifcopenshell: Any = import_module("ifcopenshell")
    packed = path.suffix.casefold() == ".ifczip"
    raw = _unpacked(path) if packed else read_bytes(path)
    if b"ISO-10303-21" not in raw[:2000]:
        raise EchostepError(f"{path}: not an IFC file (no ISO-10303-21 at its beginning): export it as IFC (STEP)")
    try:
        return ifcopenshell.file.from_string(raw.decode("utf-8", "replace")) if packed else ifcopenshell.open(str(path))
    except Exception as error:  # a damaged model breaks its reader in many ways
        raise EchostepError(f"{path}: not an IFC file: {' '.join(str(error).split())[:200]}") from error


def _unpacked(path: Path) -> bytes:
    """The first .ifc file in an .ifczip, which is a zip file."""
    with Archive(path) as packed:
        names = packed.ending_with(".ifc")
        if not names:
            raise EchostepError(f"{path}: no .ifc file in it")
        return packed.content(names[0])


def storeys_of(model: Any, path: Path, report: ImportReport) -> list[Storey]:
    """The model's storeys from the lowest, without reference levels, which are reported."""
    try:
        scale_m = float(import_module("ifcopenshell.util.unit").calculate_unit_scale(model))
        found = model.by_type("IfcBuildingStorey")
        heights = _heights_m(found, scale_m, report)
        storeys = [
            Storey(str(s.Name or s.LongName or "storey")[:80], round(height_m, 6), _contents(s))
            for s, height_m in zip(found, heights, strict=True)
        ]
    except Exception as error:
        raise EchostepError(f"{path}: its storeys cannot be read: {' '.join(str(error).split())[:200]}") from error
    if not storeys or not all(abs(storey.height_m) <= LIMIT_M for storey in storeys):
        raise EchostepError(
            f"{path}: {'a storey has no sane height' if storeys else 'no IfcBuildingStorey'}: export the model with its storeys"
        )
    return _without_references(sorted(storeys, key=lambda storey: storey.height_m), report)


def _heights_m(storeys: list[Any], scale_m: float, report: ImportReport) -> list[float]:
    """Heights of storeys by their placement, or by their Elevation from the lowest one on: where these differ, by which more of the contents lie."""
    util: Any = import_module("ifcopenshell.util.placement")
    placed = [float(util.get_storey_elevation(storey)) * scale_m for storey in storeys]
    stated = [float(storey.Elevation) * scale_m for storey in storeys if storey.Elevation is not None]
    if len(stated) < len(placed) or not placed:
        return placed
    shift = min(zip(stated, placed, strict=True))
    stated = [height - shift[0] + shift[1] for height in stated]
    if max(abs(one - other) for one, other in zip(placed, stated, strict=True)) < DIFFERENT_M:
        return placed
    nearer = 0
    for storey, one, other in zip(storeys, placed, stated, strict=True):
        for element in (element for relation in storey.ContainsElements for element in relation.RelatedElements):
            if element.ObjectPlacement:
                z_m = float(util.get_local_placement(element.ObjectPlacement)[2][3]) * scale_m
                nearer += (abs(z_m - other) < abs(z_m - one)) - (abs(z_m - one) < abs(z_m - other))
    words = ", ".join(
        f"{s.Name or 'storey'} {one:.2f}/{other:.2f} m" for s, one, other in zip(storeys, placed, stated, strict=True)
    )
    taken = "Elevation" if nearer > 0 else "placement"
    report.doubt(
        f"storeys' placement and Elevation differ ({words[:150]}): {taken} is taken, as more of their contents lie there"
    )
    return stated if nearer > 0 else placed


def _without_references(storeys: list[Storey], report: ImportReport) -> list[Storey]:
    """Keeps, of storeys close to each other, those with contents; of several empty ones, the highest, which is the finished floor."""
    kept: list[Storey] = []
    dropped: list[Storey] = []
    for storey in storeys:
        near = bool(kept) and storey.height_m - kept[-1].height_m < REFERENCE_M
        if near and not storey.contents and kept[-1].contents:
            dropped.append(storey)
        elif near and not kept[-1].contents:
            dropped.append(kept.pop())
            kept.append(storey)
        else:
            kept.append(storey)
    if dropped:
        names = ", ".join(f"{storey.name} ({storey.height_m:g} m)" for storey in dropped[:5])
        report.leave_out("storey without walls, doors and rooms beside another one", len(dropped))
        report.doubt(f"reference levels, not storeys: {names}{', ...' if len(dropped) > 5 else ''}")
    return kept


def _contents(storey: Any) -> int:
    """How many elements of a building a storey contains."""
    contained = [e for relation in storey.ContainsElements for e in relation.RelatedElements]
    spaces = [e for relation in storey.IsDecomposedBy for e in relation.RelatedObjects]
    return sum(any(element.is_a(kind) for kind in CONTENTS) for element in (*contained, *spaces))


def standing(model: Any, kinds: Iterable[str], report: ImportReport) -> Iterator[Any]:
    """The elements of these kinds without those that are no part of a plan, which are reported."""
    for element in (element for kind in kinds for element in model.by_type(kind)):
        if why := why_out(element):
            report.leave_out(f"{element.is_a()} {why}")
        else:
            yield element


def why_out(element: Any) -> str:
    """Why an element is no part of a plan, by its kind and the status of itself, its wall and its whole; empty when it is one."""
    util: Any = import_module("ifcopenshell.util.element")
    kinds = {util.get_predefined_type(element), *(getattr(element, name, None) for name in KINDS)}
    if element.is_a("IfcSpace") and kinds & NO_ROOMS:
        return "that is no room"
    if element.is_a("IfcTransportElement") and kinds & NO_LIFTS:
        return "that is no lift"
    holes = [relation.RelatingOpeningElement for relation in getattr(element, "FillsVoids", ())]
    wholes = [relation.RelatingBuildingElement for hole in holes for relation in hole.VoidsElements]
    wholes += [relation.RelatingObject for relation in element.Decomposes]
    with suppress(AttributeError, TypeError, RuntimeError):  # damaged sets
        sets = [one for each in (element, *wholes) for one in util.get_psets(each, psets_only=True).items()]
        states = [str(values.get("Status")) for name, values in sets if re.fullmatch("Pset_.*Common", name)]
        return "to be demolished" if any("DEMOLISH" in state for state in states) else ""
    return ""
