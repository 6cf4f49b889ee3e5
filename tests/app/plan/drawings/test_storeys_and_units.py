# SPDX-License-Identifier: MIT
"""Storeys and units of drawings: several in one drawing, drawn apart; stated units that make no building are refused with the unit that would."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.filemanagement import readfile

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep_app.commands.options import scale_of as scale_option
from echostep_app.plan.importers.dxf.frame import METRES
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.report import Hints
from echostep_app.plan.importers.summary import size_m
from plan.drawings.drawn_houses import WALL, house, sheet
from plan.imported_plans import imported_file


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
    _, report = imported_file(tmp_path / "a.dxf")
    assert "looks like 2 storeys beside each other" in report.doubts[0]
    words = report.doubts[0].split("--window ")[1:]
    windows = [tuple(float(v) for v in word.strip().split(",")) for word in words]
    names = ["Ground", "Upper"]
    plan, report = imported_file(tmp_path / "a.dxf", windows=windows, level_names=names, storey_height_m=3.0)
    assert report.doubts == []
    assert [(level.name, level.height_m) for level in plan.levels] == [("Ground", 0.0), ("Upper", 3.0)]
    assert [size_m(level) for level in plan.levels] == [pytest.approx((10, 8), abs=0.01)] * 2
    assert [[room.name for room in level.rooms] for level in plan.levels] == [["Hall"], ["Loft"]]
    assert plan.levels[0].doors[0].line == pytest.approx((4.05, 3.0, 4.05, 3.9), abs=0.01)
    assert plan.levels[1].doors[0].line == pytest.approx((4.05, 5.0, 4.05, 5.9), abs=0.05)


def test_rows_of_rooms_that_doors_join_are_one_storey() -> None:
    """The office of the manual's pictures: nothing but the doors at both ends of its corridor joins the rows."""
    plan, report = imported_file(ROOT / "tests/captures/office.dxf")
    (level,) = plan.levels
    assert (report.doubts, len(level.rooms), len(level.doors)) == ([], 12, 14)


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
    _, report = imported_file(*files)
    assert report.doubts == ["first.dxf does not lie over ground.dxf: --align lays the storeys over each other"]
    plan, report = imported_file(*files, align=True)
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
    plan, report = imported_file(tmp_path / "ground.dxf", [tmp_path / "first.dxf"])
    assert [size_m(level) for level in plan.levels] == [pytest.approx((10, 8), abs=0.01)] * 2
    assert report.units == "cm ($INSUNITS; sizes fit); mm ($INSUNITS; sizes fit)"


CODES = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, None: 0}


def drawing(path: Path, drawn: str, stated: str | None, *, door: bool = True) -> Path:
    """The house of 10 m by 8 m drawn in one unit, with the header of another."""
    doc, space = sheet(CODES[stated])
    house(space, one=1 / METRES[drawn], door=door)
    doc.saveas(path)
    return path


@pytest.mark.parametrize("door", [True, False])
@pytest.mark.parametrize("drawn", list(METRES))
def test_a_unit_that_is_wrong_is_refused_with_the_right_one(tmp_path: Path, drawn: str, door: bool) -> None:
    """Of 20 pairs all are refused with a door to judge by, and those by a factor of 10 or more without one."""
    for stated in METRES:
        path = drawing(tmp_path / "a.dxf", drawn, stated, door=door)
        ratio = METRES[stated] / METRES[drawn]
        if stated == drawn:
            assert size_m(import_plan(path).levels[0]) == pytest.approx((10, 8), abs=0.01)
        elif door or not 0.1 < ratio < 10:
            with pytest.raises(EchostepError, match=f"--units {drawn} ") as caught:
                import_plan(path)
            assert "\n" not in str(caught.value)
        assert size_m(import_plan(path, Hints(units=drawn)).levels[0]) == pytest.approx((10, 8), abs=0.01)


def test_a_unit_that_is_possible_but_odd_is_told(tmp_path: Path) -> None:
    """Drawn in cm, called inches: a building of 25 m with walls 0.76 m thick may be, but hardly."""
    _, report = imported_file(drawing(tmp_path / "a.dxf", "cm", "in", door=False))
    assert "another unit" in report.doubts[0]
    assert report.doubts[0].endswith("in centimetres: --units cm?")


def test_a_free_scale(tmp_path: Path) -> None:
    """A scanned drawing, 1 unit being 1.7 cm."""
    path = drawing(tmp_path / "a.dxf", "cm", None)
    plan = import_plan(path, Hints(scale_m=0.017))
    assert size_m(plan.levels[0]) == pytest.approx((17, 13.6), abs=0.01)
    assert plan.levels[0].doors[0].width_m == pytest.approx(0.9 * 1.7, abs=0.01)


@pytest.mark.parametrize(("text", "scale"), [("0.0254", 0.0254), ("0,0,300,400=10", 0.02), ("10,0,11,0=1", 1.0)])
def test_the_option_scale(text: str, scale: float) -> None:
    assert scale_option(text, None) == pytest.approx(scale)


@pytest.mark.parametrize("text", ["x", "0", "-1", "nan", "1,2,3=4", "0,0,0,0=1", "0,0,1,0=", "1e30"])
def test_wrong_scales(text: str) -> None:
    with pytest.raises(EchostepError, match="--scale"):
        scale_option(text, None)
    with pytest.raises(EchostepError, match="not both"):
        scale_option("1", "mm")


def test_stray_lines_do_not_count(tmp_path: Path) -> None:
    path = drawing(tmp_path / "a.dxf", "mm", "mm")
    doc: Any = readfile(path)
    doc.modelspace().add_line((0, 0), (5e7, 0), WALL)  # 50 km
    doc.saveas(path)
    walls = import_plan(path).levels[0].walls
    assert np.abs(walls).max() == pytest.approx(50_000)
