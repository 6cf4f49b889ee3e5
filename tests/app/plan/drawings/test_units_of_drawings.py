# SPDX-License-Identifier: MIT
"""Units of drawings: stated ones that make no building are refused with the unit that would, for every pair of units; scales of any size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ezdxf.filemanagement import readfile

from echostep.errors import EchostepError
from echostep_app.commands.options import scale_of as scale_option
from echostep_app.plan.importers.dxf.frame import METRES
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.importers.report import ImportReport
from echostep_app.plan.importers.summary import size_m
from plan.drawings.drawn_houses import WALL, house, sheet

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
    report = ImportReport()
    import_plan(drawing(tmp_path / "a.dxf", "cm", "in", door=False), report=report)
    assert "another unit" in report.doubts[0]
    assert report.doubts[0].endswith("in centimetres: --units cm?")


@pytest.mark.parametrize("drawn", list(METRES))
def test_a_drawing_without_units_is_asked_about(tmp_path: Path, drawn: str) -> None:
    with pytest.raises(EchostepError, match=rf"does not say its units.*--units {drawn}$"):
        import_plan(drawing(tmp_path / "a.dxf", drawn, None))


def test_how_the_units_were_decided(tmp_path: Path) -> None:
    for hints, words in ((Hints(), "cm ($INSUNITS; sizes fit)"), (Hints(units="cm"), "cm (--units)")):
        report = ImportReport()
        import_plan(drawing(tmp_path / "a.dxf", "cm", "cm"), hints, report=report)
        assert report.units == words


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
