# SPDX-License-Identifier: MIT
"""The schematic of a board for KiCad 6 or newer, from its nets.

In: a `WiredBoard`. Out: the text of a .kicad_sch [file format of KiCad 6, version 20211123]: a box for the processor board and for each part, with a
global label at each wired pin and a cross at each open one. Nothing is random: identifiers are made from names. Owns the layout, mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from uuid import NAMESPACE_URL, uuid5

from hardware.wiring import POWER, WiredBoard

GRID, STUB, BODY = 2.54, 2.54, 25.4  # of the sheet; length of a pin; width of a box
COLUMN, TOP, BOTTOM = 96.52, 35.56, 200.0  # between two columns; first and last place on the sheet (A3)
TYPES = {
    "supply": "power_in", "ground": "power_in", "in": "input", "out": "output", "tri": "tri_state", "io": "bidirectional",
    "passive": "passive", "open": "passive", "source": "power_out",
}  # fmt: skip
SHAPES = {"in": "input", "out": "output", "tri": "tri_state", "io": "bidirectional"}
FONT = "(effects (font (size 1.27 1.27)))"
HIDDEN = "(effects (font (size 1.27 1.27)) hide)"


@dataclass(frozen=True, slots=True)
class Box:
    """A part on the sheet: its pins with their kinds, and the nets of those that are wired."""

    reference: str
    library: str
    value: str
    note: str
    kinds: dict[str, str]
    nets: dict[str, str]

    @property
    def footprint(self) -> str:
        """Of KiCad's own library: a resistor, or the header on a carrier into which a part or its cable is plugged, in the order of the pins here.

        None for the processor board, whose pins are those that are used, under their printed names.
        """
        if self.reference.startswith("R"):
            return "Resistor_THT:R_Axial_DIN0207_L6.3mm_D2.5mm_P10.16mm_Horizontal"
        pins = f"1x{len(self.kinds):02}"
        return f"Connector_PinHeader_2.54mm:PinHeader_{pins}_P2.54mm_Vertical" if self.reference.startswith("U") else ""

    def height(self) -> float:
        """Of the box, mm."""
        return GRID * (len(self.kinds) + 1)


def schematic(board: WiredBoard) -> str:
    """The text of the file."""
    boxes = _boxes(board)
    places = _places(boxes)
    symbols = {box.library: box for box in boxes}
    root = _identifier(board, "sheet")
    lines = [
        "(kicad_sch (version 20211123) (generator echostep)",
        f"  (uuid {root})",
        '  (paper "A3")',
        f'  (title_block (title "{board.title}") (company "echostep") (comment 1 "Not built yet") '
        '(comment 2 "Made by make docs from wiring.toml: do not edit"))',
        "  (lib_symbols",
        *(_library_symbol(box) for box in symbols.values()),
        "  )",
    ]
    for box, (x, y) in zip(boxes, places, strict=True):
        lines += _ends(board, box, x, y)
        lines.append(_instance(board, box, x, y))
    lines.append('  (sheet_instances (path "/" (page "1")))')
    instances = "".join(
        f'\n    (path "/{_identifier(board, box.reference)}" (reference "{box.reference}") (unit 1) (value "{box.value}")'
        f' (footprint "{box.footprint}"))'
        for box in boxes
    )
    return "\n".join([*lines, f"  (symbol_instances{instances}\n  )", ")"]) + "\n"


def _identifier(board: WiredBoard, *of: str) -> str:
    return str(uuid5(NAMESPACE_URL, "/".join(("echostep", board.name, *of))))


def _boxes(board: WiredBoard) -> list[Box]:
    """The processor board first; its supply pins are the sources."""
    kinds = {f"{pin.board} {pin.port}": pin.direction for pin in board.pins.values()}
    nets = {f"{pin.board} {pin.port}": net for net, pin in board.pins.items()}
    used = {net for device in board.devices for net in device.pins.values()}
    power = [net for net in POWER if net in used]
    made = [
        Box("A1", f"micro_{board.name}", "Arduino Micro", "USB to the host", kinds | dict.fromkeys(power, "source"),
            nets | {net: net for net in power})
    ]  # fmt: skip
    counts: dict[str, int] = {}
    for device in board.devices:
        letter = "R" if "passive" in device.symbol.pins.values() else "U"
        counts[letter] = counts.get(letter, 0) + 1
        library = device.symbol.title.replace(" ", "_")
        made.append(
            Box(f"{letter}{counts[letter]}", library, device.symbol.title, f"{device.name}: {device.note}",
                device.symbol.pins, device.pins)
        )  # fmt: skip
    return made


def _places(boxes: list[Box]) -> list[tuple[float, float]]:
    """The upper left corner of each box, in columns."""
    x, y, places = COLUMN / 2 + GRID * 6, TOP, []
    for box in boxes:
        if y + box.height() > BOTTOM:
            x, y = x + COLUMN, TOP
        places.append((_on_grid(x), _on_grid(y)))
        y += box.height() + 6 * GRID
    return places


def _on_grid(length: float) -> float:
    return round(round(length / GRID) * GRID, 2)


def _library_symbol(box: Box) -> str:
    """A box whose upper left corner is its origin; y points up in a symbol, and down on the sheet."""
    name = f"echostep:{box.library}"
    pins = "".join(
        f"\n        (pin {TYPES[kind]} line (at {-STUB:g} {-GRID * (row + 1):g} 0) (length {STUB:g}) "
        f'(name "{pin}" {FONT}) (number "{row + 1}" {FONT}))'
        for row, (pin, kind) in enumerate(box.kinds.items())
    )
    hidden = "".join(
        f' (property "{key}" "{text}" (id {n}) (at 0 0 0) {HIDDEN})'
        for n, (key, text) in enumerate((("Footprint", box.footprint), ("Datasheet", "")), 2)
    )
    return (
        f'    (symbol "{name}" (pin_names (offset 1.016)) (in_bom yes) (on_board yes)\n'
        f'      (property "Reference" "{box.reference[0]}" (id 0) (at 0 1.27 0) {FONT})'
        f' (property "Value" "{box.value}" (id 1) (at 0 3.81 0) {FONT}){hidden}\n'
        f'      (symbol "{box.library}_0_1" (rectangle (start 0 0) (end {BODY:g} {-box.height():g})'
        " (stroke (width 0.254) (type default) (color 0 0 0 0)) (fill (type background))))\n"
        f'      (symbol "{box.library}_1_1"{pins}))'
    )


def _ends(board: WiredBoard, box: Box, x: float, y: float) -> list[str]:
    """A label at each wired pin, a cross at each open one."""
    made = []
    for row, (pin, kind) in enumerate(box.kinds.items()):
        at = f"{x - STUB:.2f} {y + GRID * (row + 1):.2f}"
        identifier = _identifier(board, box.reference, pin, "end")
        net = box.nets.get(pin)
        if net is None:
            made.append(f"  (no_connect (at {at}) (uuid {identifier}))")
        else:
            made.append(
                f'  (global_label "{net}" (shape {SHAPES.get(kind, "passive")}) (at {at} 180) (fields_autoplaced)'
                f" (effects (font (size 1.27 1.27)) (justify right)) (uuid {identifier}))"
            )
    return made


def _instance(board: WiredBoard, box: Box, x: float, y: float) -> str:
    texts = (
        ("Reference", box.reference, x, y - 3 * GRID, False), ("Value", box.value, x, y - 2 * GRID, False),
        ("Footprint", box.footprint, x, y, True), ("Datasheet", "", x, y, True), ("Place", box.note, x, y - GRID, False),
    )  # fmt: skip
    properties = "".join(
        f'\n    (property "{key}" "{text}" (id {n}) (at {at_x:.2f} {at_y:.2f} 0)'
        f" (effects (font (size 1.27 1.27)) (justify left){' hide' if hide else ''}))"
        for n, (key, text, at_x, at_y, hide) in enumerate(texts)
    )
    pins = "".join(
        f'\n    (pin "{row + 1}" (uuid {_identifier(board, box.reference, pin)}))' for row, pin in enumerate(box.kinds)
    )
    return (
        f'  (symbol (lib_id "echostep:{box.library}") (at {x:.2f} {y:.2f} 0) (unit 1) (in_bom yes) (on_board yes)'
        f"\n    (uuid {_identifier(board, box.reference)}){properties}{pins}\n  )"
    )
