# SPDX-License-Identifier: MIT
"""The KiCad schematics: the nets are those of the wiring, and what is not is found; footprints; the printed boxes: closed, with room."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from hardware.boxes import BOXES, NAMES, PARTS, is_closed, read_stl, render, size, volume
from hardware.schematic import all_of, file_of, parsed, pins_of, problems
from hardware.wiring import WiredBoard, boards

BOARDS = pytest.mark.parametrize("board", boards(), ids=lambda board: board.name)


@BOARDS
def test_the_nets_are_those_of_the_wiring(board: WiredBoard) -> None:
    assert problems(board, file_of(board).read_text()) == []


def test_what_differs_is_found() -> None:
    (foot,) = (board for board in boards() if board.name == "foot")
    text = file_of(foot).read_text()
    label = '(global_label "MOSI" '
    begin = text.index(label)
    elsewhere = re.sub(r"\(at ([\d.]+) ", "(at 1.27 ", text[begin:], count=1)
    for changed, words in (
        (text.replace(label, '(global_label "MISO" ', 1), ("net MISO: processor MOSI PB2 is not wired", "net MOSI: ")),
        (text[:begin] + elsewhere, ("has neither label nor cross", "where no pin ends")),
    ):
        found = " ".join(problems(foot, changed))
        for each in words:
            assert each in found


@BOARDS
def test_identifiers_and_references_are_unique(board: WiredBoard) -> None:
    text = file_of(board).read_text()
    identifiers = re.findall(r"\(uuid ([0-9a-f-]{36})\)", text)
    assert len(identifiers) == len(set(identifiers)) > 10
    references = re.findall(r'\(reference "(\w+)"\)', text)
    assert len(references) == len(set(references)) == len(board.devices) + 1
    assert "Not built yet" in text


@BOARDS
def test_pins_end_on_the_sheet_each_at_a_place_of_its_own(board: WiredBoard) -> None:
    ends = [at for at, _ in pins_of(parsed(file_of(board).read_text()))]
    assert len(ends) == len(set(ends))
    assert all(0.0 < x < 400.0 and 0.0 < y < 287.0 for x, y in ends)


@BOARDS
def test_a_part_has_a_footprint_with_as_many_pads_as_pins(board: WiredBoard) -> None:
    for part in all_of(parsed(file_of(board).read_text()), "symbol"):
        footprint = next(row[2] for row in all_of(part, "property") if row[1] == "Footprint")
        pads = 2 if "R_Axial" in footprint else int((re.search(r"_1x(\d+)_", footprint) or [0, 0])[1])
        is_processor = all_of(part, "lib_id")[0][1].startswith("echostep:micro")
        assert pads == (0 if is_processor else len(all_of(part, "pin")))


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
