# SPDX-License-Identifier: MIT
"""The printed boxes: closed surfaces, room for their boards, STL files of the present sources."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hardware.boxes import BOXES, NAMES, PARTS, is_closed, read_stl, render, size, volume

PRINTER_MM = 180.0  # bed of a small printer
BOARDS_MM = {  # boards that lie side by side in each box: length, width together, height with plugs and joints
    "belt_box": (81.0, 51.0 + 8.0, 26.0),
    "ranger_holder": (45.0, 20.0, 15.0),
    "imu_clip": (25.4, 17.78, 10.0),
    "ankle_box": (48.0, 18.0 + 17.78, 12.0),
}


@pytest.mark.parametrize("name", NAMES)
def test_a_box_and_its_lid_are_closed_fit_the_printer_and_hold_their_boards(name: str) -> None:
    box, lid = (read_stl(BOXES / f"{name}-{part}.stl") for part in PARTS)
    for part in (box, lid):
        assert is_closed(part)
        assert size(part).max() < PRINTER_MM
    length, width, height = BOARDS_MM[name]
    assert size(lid)[0] - 4.0 >= length + 1.0
    assert size(lid)[1] - 4.0 >= width + 1.0
    assert size(box)[2] - 2.0 >= height
    assert volume(box) < 40_000.0  # mm3: about 50 g of PETG


@pytest.mark.process
@pytest.mark.skipif(shutil.which("openscad") is None, reason="openscad is not installed: no box is rendered")
@pytest.mark.parametrize("name", NAMES)
def test_what_is_printed_is_of_the_present_source(name: str, tmp_path: Path) -> None:
    """`make hardware` after a change of a source."""
    for part in PARTS:
        rendered, kept = render(name, part, tmp_path), read_stl(BOXES / f"{name}-{part}.stl")
        assert size(rendered) == pytest.approx(size(kept), abs=1e-3)
        assert volume(rendered) == pytest.approx(volume(kept), rel=1e-6)


def test_every_source_is_rendered() -> None:
    assert {path.stem for path in BOXES.glob("*.scad")} == {*NAMES, "common"}
