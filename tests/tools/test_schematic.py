# SPDX-License-Identifier: MIT
"""The KiCad schematics: the nets are those of the wiring, and what is not is found; footprints."""

from __future__ import annotations

import re

import pytest

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
