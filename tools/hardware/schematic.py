# SPDX-License-Identifier: MIT
"""The nets of a board's KiCad schematic, compared with its wiring.

In: a `WiredBoard`, its .kicad_sch [file format of KiCad 6, version 20211123]. Out: problems in words. Owns nothing. Read are global labels and
crosses at the ends of pins, which is how the sheets are drawn; wires, junctions and sheets inside sheets are not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hardware import HARDWARE
from hardware.wiring import POWER, WiredBoard

TOKENS = re.compile(r'\(|\)|"(?:[^"\\]|\\.)*"|[^\s()]+')
Place = tuple[float, float]


def file_of(board: WiredBoard) -> Path:
    """The schematic of a board."""
    return HARDWARE / "schematic" / f"{board.name}.kicad_sch"


def problems(board: WiredBoard, text: str) -> list[str]:
    """Pins without a label or a cross, labels and crosses at no pin, and nets whose pins are not those of the wiring."""
    root = parsed(text)
    pins = dict(pins_of(root))
    labels = {_place(label): label[1] for label in all_of(root, "global_label")}
    crosses = {_place(cross) for cross in all_of(root, "no_connect")}
    found = [f"{pins[at]} has neither label nor cross" for at in pins.keys() - labels.keys() - crosses]
    found += [f"a label or cross at {at}, where no pin ends" for at in (labels.keys() | crosses) - pins.keys()]
    drawn = {(net, pins[at]) for at, net in labels.items() if at in pins}
    wired = {(net, f"{device.name} {pin}") for device in board.devices for pin, net in device.pins.items()}
    wired |= {(net, f"processor {net}") for net in POWER.keys() & {net for net, _ in wired}}
    wired |= {(net, f"processor {pin.board} {pin.port}") for net, pin in board.pins.items()}
    found += [f"net {net}: {pin} is wired, but not in the schematic" for net, pin in wired - drawn]
    found += [f"net {net}: {pin} is not wired, but in the schematic" for net, pin in drawn - wired]
    return [f"{file_of(board).name}: {words}" for words in sorted(found)]


def parsed(text: str) -> list[Any]:
    """The file's S-expression as nested lists of words."""
    stack: list[list[Any]] = [[]]
    for token in TOKENS.findall(text):
        if token == "(":
            stack.append([])
        elif token == ")":
            stack[-2].append(stack.pop())
        else:
            stack[-1].append(token.strip('"'))
    return list(stack[0][0])


def all_of(node: list[Any], name: str) -> list[list[Any]]:
    return [child for child in node if isinstance(child, list) and child[0] == name]


def _place(node: list[Any]) -> Place:
    _, x, y, *_ = all_of(node, "at")[0]
    return round(float(x), 2), round(float(y), 2)


def pins_of(root: list[Any]) -> Iterator[tuple[Place, str]]:
    """Place of the end of each pin, and its name behind that of its device, which the property Place begins with.

    The y of a library's symbol points up.
    """
    library = {symbol[1]: symbol for symbol in all_of(all_of(root, "lib_symbols")[0], "symbol")}
    for part in all_of(root, "symbol"):
        x, y = _place(part)
        device = next(row[2].partition(":")[0] for row in all_of(part, "property") if row[1] == "Place")
        for body in all_of(library[all_of(part, "lib_id")[0][1]], "symbol"):
            for pin in all_of(body, "pin"):
                dx, dy = _place(pin)
                yield (round(x + dx, 2), round(y - dy, 2)), f"{device} {all_of(pin, 'name')[0][1]}"
