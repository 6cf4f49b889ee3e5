# SPDX-License-Identifier: MIT
"""Storeys of drawings: several in one drawing, drawn apart, in different units."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from echostep.errors import EchostepError
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import size_m
from plan.drawings.drawn_houses import house, sheet


def named_house(space: Any, x: float, y: float, begin: float, name: str) -> None:
    """The house in millimetres, with a name in its room."""
    house(space, x=x, y=y, one=1000.0, begin=begin, door=True)
    at = (1000 * (x + 2), 1000 * (y + 2))
    space.add_text(name, dxfattribs={"layer": "ROOM", "insert": at, "height": 300.0})


def test_several_storeys_in_one_drawing(tmp_path: Path) -> None:
    """They are told with the windows to give; these make levels that lie over each other."""
    doc, space = sheet(4)
    named_house(space, 0, 0, 3.0, "Hall")
    named_house(space, 15, 0.5, 5.0, "Loft")
    doc.saveas(tmp_path / "a.dxf")
    report = ImportReport()
    import_plan(tmp_path / "a.dxf", report=report)
    assert "looks like 2 storeys beside each other" in report.doubts[0]
    words = report.doubts[0].split("--window ")[1:]
    windows = [tuple(float(v) for v in word.strip().split(",")) for word in words]
    hints = Hints(windows=windows, level_names=["Ground", "Upper"], storey_height_m=3.0)
    report = ImportReport()
    plan = import_plan(tmp_path / "a.dxf", hints, report=report)
    assert report.doubts == []
    assert [(level.name, level.height_m) for level in plan.levels] == [("Ground", 0.0), ("Upper", 3.0)]
    assert [size_m(level) for level in plan.levels] == [pytest.approx((10, 8), abs=0.01)] * 2
    assert [[room.name for room in level.rooms] for level in plan.levels] == [["Hall"], ["Loft"]]
    assert plan.levels[0].doors[0].line == pytest.approx((4.05, 3.0, 4.05, 3.9), abs=0.01)
    assert plan.levels[1].doors[0].line == pytest.approx((4.05, 5.0, 4.05, 5.9), abs=0.05)


def test_a_window_without_walls_is_refused(tmp_path: Path) -> None:
    doc, space = sheet()
    house(space, door=True)
    doc.saveas(tmp_path / "a.dxf")
    with pytest.raises(EchostepError, match="--window 50,50,60,60: no walls in it"):
        import_plan(tmp_path / "a.dxf", Hints(windows=[(50, 50, 60, 60)]))
    with pytest.raises(EchostepError, match="--window is for one drawing"):
        import_plan(tmp_path / "a.dxf", Hints(windows=[(0, 0, 9, 9)]), [tmp_path / "a.dxf"])


def test_storeys_drawn_apart(tmp_path: Path) -> None:
    """They are told, and --align lays them over each other."""
    for name, x, y in (("ground", 0.0, 0.0), ("first", 103.0, -47.0)):
        doc, space = sheet()
        house(space, x=x, y=y, door=True)
        doc.saveas(tmp_path / f"{name}.dxf")
    files = tmp_path / "ground.dxf", [tmp_path / "first.dxf"]
    report = ImportReport()
    import_plan(files[0], Hints(), files[1], report)
    assert report.doubts == ["first.dxf does not lie over ground.dxf: --align lays the storeys over each other"]
    report = ImportReport()
    plan = import_plan(files[0], Hints(align=True), files[1], report)
    assert report.doubts == []
    assert plan.levels[1].doors[0].line == pytest.approx(plan.levels[0].doors[0].line, abs=0.05)


def test_different_units_that_contradict_each_other(tmp_path: Path) -> None:
    for name, code in (("ground", 5), ("first", 1)):
        doc, space = sheet(code)
        house(space, one=100.0)
        doc.saveas(tmp_path / f"{name}.dxf")
    with pytest.raises(EchostepError, match=r"first.dxf: its units \(in\) are not those of ground.dxf \(cm\).*--units"):
        import_plan(tmp_path / "ground.dxf", Hints(), [tmp_path / "first.dxf"])
    plan = import_plan(tmp_path / "ground.dxf", Hints(units="cm"), [tmp_path / "first.dxf"])
    assert [size_m(level) for level in plan.levels] == [pytest.approx((10, 8), abs=0.01)] * 2


def test_different_units_that_are_right(tmp_path: Path) -> None:
    for name, code, metre in (("ground", 5, 100.0), ("first", 4, 1000.0)):
        doc, space = sheet(code)
        house(space, one=metre, door=True)
        doc.saveas(tmp_path / f"{name}.dxf")
    report = ImportReport()
    plan = import_plan(tmp_path / "ground.dxf", Hints(), [tmp_path / "first.dxf"], report)
    assert [size_m(level) for level in plan.levels] == [pytest.approx((10, 8), abs=0.01)] * 2
    assert report.units == "cm ($INSUNITS; sizes fit); mm ($INSUNITS; sizes fit)"
