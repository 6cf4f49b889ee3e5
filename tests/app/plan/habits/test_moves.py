# SPDX-License-Identifier: MIT
"""A drawing that is moved, or has its entities in another order, is the same plan up to the move: no tie is decided by the order or the last bit."""

from __future__ import annotations

import random
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.filemanagement import readfile
from ezdxf.math import Matrix44

from echostep.errors import EchostepError
from echostep_app.plan.importers.dxf.units import INSUNITS, STATED
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import ImportReport
from needs_data import data_or_skip
from plan.drawings import drawn_doors as doors
from plan.drawings import drawn_offices as drawn

STYLES = [
    *({"walls": walls} for walls in drawn.WALL_STYLES),
    *({"door": door} for door in (*doors.DOOR_STYLES, doors.leaves_alone, doors.nothing)),
]
SAME_M = 0.006


def named(style: dict[str, Any]) -> str:
    return str(next(iter(style.values())).__name__)


def moved(path: Path, out: Path, dx: float, dy: float, seed: int) -> Path:
    """The drawing moved by metres, its entities in another order."""
    doc = readfile(path)
    space, entities = doc.modelspace(), list(doc.modelspace())
    metre = STATED.get(INSUNITS.get(doc.header.get("$INSUNITS", 0), "m"), 1.0)
    for entity in random.Random(seed).sample(entities, len(entities)):
        space.unlink_entity(entity)
        space.add_entity(entity)
        entity.transform(Matrix44.translate(dx / metre, dy / metre, 0))
    doc.saveas(out)
    return out


def facts(path: Path) -> tuple[Any, list[np.ndarray]]:
    """What must be equal, and lines relative to the lowest corner; or the refusal without its numbers."""
    report = ImportReport()
    try:
        level = import_plan(path, report=report).levels[0]
    except EchostepError as error:
        return re.sub(r"[-\d.,e+]+", "#", str(error).partition(": ")[2]), []
    low = np.concatenate((level.walls, level.windows)).reshape(-1, 2).min(axis=0)
    lines = [level.walls, level.windows, np.array([door.line for door in level.doors]).reshape(-1, 4)]
    names = sorted(room.name for room in level.rooms)
    return (names, report.left_out, len(level.questions)), [one - np.tile(low, 2) for one in lines]


def differences(one: np.ndarray, other: np.ndarray) -> float:
    """The greatest distance of a line's end from that of the nearest line of the other list, in whichever direction it is drawn."""
    if one.shape != other.shape:
        return np.inf
    both = np.stack((other, np.roll(other, 2, axis=1)))
    return max((float(np.abs(both - line).max(axis=2).min()) for line in one), default=0.0)


def check(path: Path, folder: Path) -> None:
    said, lines = facts(path)
    for seed, (dx, dy) in enumerate(((1.0, 0.0), (3e5, 6e6))):
        again, others = facts(moved(path, folder / path.name, dx, dy, seed))
        assert again == said
        assert max((differences(*pair) for pair in zip(lines, others, strict=True)), default=0.0) < SAME_M


FEW = STYLES[::5]


@pytest.mark.parametrize(
    "style", [*FEW, *(pytest.param(one, marks=pytest.mark.long) for one in STYLES if one not in FEW)], ids=named
)
def test_drawings(tmp_path: Path, style: dict[str, Any]) -> None:
    (tmp_path / "moved").mkdir()
    check(drawn.write_office(tmp_path / "a.dxf", turn=33.0, **style), tmp_path / "moved")


@pytest.mark.long
def test_drawings_found(tmp_path: Path) -> None:
    for path in sorted(data_or_skip("small").rglob("*.dxf")):
        if b"$HANDSEED" in path.read_bytes():  # older ones cannot be written again
            check(path, tmp_path)
