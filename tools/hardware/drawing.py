# SPDX-License-Identifier: MIT
"""The wiring drawing of a board, from its nets: the processor board in the middle, parts left and right, a vertical lane for each net.

In: a `WiredBoard`. Out: SVG. Each wire is labelled at both ends, so that colours are an aid only; they are near those of Okabe and Ito, which differ
for all kinds of colour vision. Owns the layout: ends of parts lie half a row beside those of the processor, so that no two wires lie on each
other.
Lanes of vertical wires: the left-edge algorithm of channel routing.
"""

from __future__ import annotations

from dataclasses import dataclass

from hardware.pen import SOFT, Pen
from hardware.wiring import POWER, Device, WiredBoard

LANE_GAP = 24.0  # least distance of two wires in one lane, pixels


def lanes(ends: dict[str, list[float]]) -> dict[str, int]:
    """Lane of each net, counted from 0. [Hashimoto and Stevens 1971]"""
    free_from: list[float] = []  # height from which each lane is free
    lane_of: dict[str, int] = {}
    for net in sorted(ends, key=lambda net: (min(ends[net]), net)):
        top, bottom = min(ends[net]), max(ends[net])
        lane = next((n for n, free in enumerate(free_from) if free <= top), len(free_from))
        if lane == len(free_from):
            free_from.append(0.0)
        free_from[lane] = bottom + LANE_GAP
        lane_of[net] = lane
    return lane_of


ROW, LANE = 24.0, 18.0  # pixels
# Of the first part; above and below its pins; between two parts: whole rows together
TOP, HEAD, FOOT, GAP = (110.0, 72.0, 6.0, 18.0)
PART, PROCESSOR = 290.0, 250.0  # widths
STUB = 62.0  # of a wire beside a part, for its label
MARGIN = 30.0
INKS = ("#0072B2", "#D55E00", "#009E73", "#B04080", "#1b1f24", "#8A6D00", "#56707E")
DASHES = ("", "9 4", "2 4")


@dataclass(frozen=True, slots=True)
class Column:
    """One side of the drawing: x of the processor's edge and of the parts', heights of the ends of each net, and its lanes."""

    parts: tuple[Device, ...]
    edge_x: float
    parts_x: float
    processor_y: dict[str, float]
    device_y: dict[tuple[str, str], float]
    lane_of: dict[str, int]

    @property
    def sign(self) -> float:
        """Direction from the processor to the parts."""
        return 1.0 if self.parts_x > self.edge_x else -1.0

    def lane_x(self, net: str) -> float:
        """Place of a net's vertical wire."""
        return self.edge_x + self.sign * LANE * (self.lane_of[net] + 1.5)


def drawing(board: WiredBoard) -> str:
    """The SVG of a board's wiring."""
    sides = {side: tuple(d for d in board.devices if d.side == side) for side in ("left", "right")}
    left_x = MARGIN + (PART if sides["left"] else 0.0)
    left = _column(board, sides["left"], left_x, -1.0)
    right_edge = left.edge_x + PROCESSOR
    right = _column(board, sides["right"], right_edge, 1.0)
    width = right.parts_x + PART + MARGIN
    height = max(_bottom(sides["left"]), _bottom(sides["right"]), _processor_bottom(left, right)) + 70.0
    pen = Pen(round(width), round(height), f"Wiring: {board.title}")
    pen.label(MARGIN, 40, f"{board.title}: wiring", 22, bold=True)
    note = "Not built yet. Dots are joints; wires that cross without a dot are not joined. At each part: the processor board's pin."
    for line, text in enumerate(_wrapped(note, int(width / 7.0))):
        pen.label(MARGIN, 62 + 18 * line, text, 13, ink=SOFT)
    _processor(pen, board, left.edge_x, _processor_bottom(left, right))
    for column in (left, right):
        _wires(pen, board, column)
        for device in column.parts:
            _part(pen, device, column)
    return pen.svg()


def _wrapped(text: str, length: int) -> list[str]:
    lines = [""]
    for word in text.split():
        if len(lines[-1]) + len(word) >= length:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


def _height(device: Device) -> float:
    return HEAD + ROW * len(device.wires()) + FOOT


def _bottom(parts: tuple[Device, ...]) -> float:
    return TOP + sum(_height(part) + GAP for part in parts)


def _processor_bottom(left: Column, right: Column) -> float:
    return max([TOP + 200.0, *left.processor_y.values(), *right.processor_y.values()]) + 2.5 * ROW


def _column(board: WiredBoard, parts: tuple[Device, ...], start_x: float, sign: float) -> Column:
    """Lay out one side. `start_x` is the edge of the parts on the left side, of the processor on the right one."""
    y, device_y = TOP, {}
    for part in parts:
        for row, pin in enumerate(part.wires()):
            device_y[part.name, pin] = y + HEAD + ROW * row + ROW / 2
        y += _height(part) + GAP
    nets = {net for part in parts for net in part.wires().values()}
    here = [net for net in board.pins if net in nets]
    processor_y = {net: TOP + HEAD + ROW * (row + 1) for row, net in enumerate(here)}
    ends = {net: [processor_y[net]] if net in processor_y else [] for net in nets}
    for part in parts:
        for pin, net in part.wires().items():
            ends[net].append(device_y[part.name, pin])
    lane_of = lanes(ends)
    span = LANE * (max(lane_of.values(), default=-1) + 2.5) + STUB if parts else 0.0
    other_x = start_x + span
    edge_x, parts_x = (start_x, other_x) if sign > 0 else (other_x, start_x)
    return Column(parts, edge_x, parts_x, processor_y, device_y, lane_of)


def _processor(pen: Pen, board: WiredBoard, x: float, bottom: float) -> None:
    pen.box(x, TOP, PROCESSOR, bottom - TOP, "#e8f1fb")
    middle = x + PROCESSOR / 2
    pen.label(middle, TOP + 24, "Arduino Micro", 16, "middle", bold=True)
    pen.label(middle, TOP + 42, "ATmega32U4, 5 V, 16 MHz", 12, "middle", SOFT)
    used = [net for net in POWER if any(net in d.pins.values() for d in board.devices)]
    pen.label(middle, bottom - 30, "pins " + ", ".join("5V" if n == "5V" else n for n in used), 12, "middle", SOFT)
    pen.label(middle, bottom - 12, "USB to the host", 12, "middle", SOFT)


def _style(column: Column, net: str) -> tuple[str, str]:
    order = sorted(column.lane_of).index(net)
    return INKS[order % len(INKS)], DASHES[order // len(INKS) % len(DASHES)]


def _wires(pen: Pen, board: WiredBoard, column: Column) -> None:
    for net in sorted(column.lane_of):
        ink, dash = _style(column, net)
        x = column.lane_x(net)
        ys = [
            y
            for part in column.parts
            for pin, at in part.wires().items()
            if at == net
            for y in [column.device_y[part.name, pin]]
        ]
        joints = sorted(ys)
        if net in column.processor_y:
            y = column.processor_y[net]
            pen.wire([(column.edge_x, y), (x, y)], ink, 2.0, dash)
            anchor = "end" if column.sign > 0 else "start"
            pen.label(column.edge_x - column.sign * 8, y + 4, f"{board.pins[net].board}", 13, anchor, bold=True)
            pen.label(column.edge_x - column.sign * 52, y + 4, net, 10, anchor, SOFT)
            joints = sorted([*ys, y])
        pen.wire([(x, joints[0]), (x, joints[-1])], ink, 2.0, dash)
        for y in ys:
            pen.wire([(x, y), (column.parts_x, y)], ink, 2.0, dash)
        for y in joints[1:-1]:
            pen.dot(x, y, ink)
        for y in ys:
            text = board.pins[net].board if net in board.pins else net
            anchor = "end" if column.sign > 0 else "start"
            pen.label(column.parts_x - column.sign * 5, y - 5, text, 11, anchor, ink, bold=True)


def _part(pen: Pen, device: Device, column: Column) -> None:
    first = next(iter(device.wires()))
    y = column.device_y[device.name, first] - HEAD - ROW / 2
    x = column.parts_x if column.sign > 0 else column.parts_x - PART
    pen.box(x, y, PART, _height(device))
    pen.label(x + 12, y + 20, f"{device.name}: {device.symbol.title}", 13, bold=True)
    pen.label(x + 12, y + 38, device.note, 12, ink=SOFT)
    tied = device.tied()
    text = "; ".join(
        f"{', '.join(pin for pin, at in tied.items() if at == net)} to {net}" for net in dict.fromkeys(tied.values())
    )
    pen.label(x + 12, y + 56, text, 11, bold=True)
    for pin in device.wires():
        anchor = "start" if column.sign > 0 else "end"
        pen.label(x + (12 if column.sign > 0 else PART - 12), column.device_y[device.name, pin] + 4, pin, 12, anchor)
