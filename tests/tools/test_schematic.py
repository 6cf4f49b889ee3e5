# SPDX-License-Identifier: MIT
"""The KiCad schematics: read back as KiCad reads them, each pin has its label or its cross, and the nets are those of the wiring."""

from __future__ import annotations

import re
from typing import Any

import pytest

from board_runs import ROOT
from hardware.wiring import POWER, WiredBoard, boards

BOARDS = pytest.mark.parametrize("board", boards(), ids=lambda board: board.name)
TOKENS = re.compile(r'\(|\)|"(?:[^"\\]|\\.)*"|[^\s()]+')


def parsed(board: WiredBoard) -> list[Any]:
    """The file's S-expression as nested lists of words."""
    text = (ROOT / f"firmware/hardware/schematic/{board.name}.kicad_sch").read_text()
    stack: list[list[Any]] = [[]]
    for token in TOKENS.findall(text):
        if token == "(":
            stack.append([])
        elif token == ")":
            done = stack.pop()
            stack[-1].append(done)
        else:
            stack[-1].append(token.strip('"'))
    (root,) = stack[0]
    return list(root)


def all_of(node: list[Any], name: str) -> list[list[Any]]:
    return [child for child in node if isinstance(child, list) and child and child[0] == name]


def one(node: list[Any], name: str) -> list[Any]:
    (found,) = all_of(node, name)
    return found


def place(node: list[Any]) -> tuple[float, float]:
    _, x, y, *_ = one(node, "at")
    return round(float(x), 2), round(float(y), 2)


def pins_on_the_sheet(root: list[Any]) -> dict[tuple[float, float], tuple[str, str]]:
    """Value and pin's name by the place of the pin's end; a symbol's y points up."""
    found: dict[tuple[float, float], tuple[str, str]] = {}
    library = {symbol[1]: symbol for symbol in all_of(one(root, "lib_symbols"), "symbol")}
    for instance in all_of(root, "symbol"):
        x, y = place(instance)
        name = one(instance, "lib_id")[1]
        reference = next(p[2] for p in all_of(instance, "property") if p[1] == "Reference")
        for body in all_of(library[name], "symbol"):
            for pin in all_of(body, "pin"):
                dx, dy = place(pin)
                at = (round(x + dx, 2), round(y - dy, 2))
                assert at not in found, "two pins at one place"
                found[at] = (reference, one(pin, "name")[1])
    return found


@BOARDS
def test_each_pin_has_a_label_or_a_cross_and_nothing_hangs_in_the_air(board: WiredBoard) -> None:
    root = parsed(board)
    ends = [place(node) for name in ("global_label", "no_connect") for node in all_of(root, name)]
    assert sorted(ends) == sorted(pins_on_the_sheet(root))
    assert all(0.0 < x < 400.0 and 0.0 < y < 287.0 for x, y in ends), "beyond the sheet"


@BOARDS
def test_the_nets_are_those_of_the_wiring(board: WiredBoard) -> None:
    root = parsed(board)
    at = pins_on_the_sheet(root)
    nets: dict[str, list[str]] = {}
    for label in all_of(root, "global_label"):
        nets.setdefault(label[1], []).append(at[place(label)][1])
    wired: dict[str, list[str]] = {net: [f"{pin.board} {pin.port}"] for net, pin in board.pins.items()}
    for device in board.devices:
        for pin, net in device.pins.items():
            wired.setdefault(net, [net] if net in POWER else []).append(pin)
    assert {net: sorted(names) for net, names in nets.items()} == {net: sorted(names) for net, names in wired.items()}


@BOARDS
def test_identifiers_and_references_are_unique(board: WiredBoard) -> None:
    text = (ROOT / f"firmware/hardware/schematic/{board.name}.kicad_sch").read_text()
    identifiers = re.findall(r"\(uuid ([0-9a-f-]{36})\)", text)
    assert len(identifiers) == len(set(identifiers)) > 10
    references = re.findall(r'\(reference "(\w+)"\)', text)
    assert len(references) == len(set(references)) == len(board.devices) + 1
    assert "Not built yet" in text


@BOARDS
def test_a_part_has_a_footprint_with_as_many_pads_as_pins(board: WiredBoard) -> None:
    root = parsed(board)
    for instance in all_of(root, "symbol"):
        pins, footprint = (
            len(all_of(instance, "pin")),
            next(p[2] for p in all_of(instance, "property") if p[1] == "Footprint"),
        )
        pads = 2 if "R_Axial" in footprint else int((re.search(r"_1x(\d+)_", footprint) or [0, 0])[1])
        assert pads == (0 if one(instance, "lib_id")[1].startswith("echostep:micro") else pins)
