# SPDX-License-Identifier: MIT
"""Electrical checks of a board's nets, the simple part of what KiCad calls ERC.

In: a `WiredBoard`. Out: problems in words; none when every pin is wired or meant to be open, every net has one driver or parts that take
turns, supplies are in range, and no level exceeds what an input withstands. Currents and rise times are not checked. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

from hardware.wiring import POWER, Device, WiredBoard

DRIVERS = ("out", "tri")
PROCESSOR_V = 5.0  # level of its outputs


def problems(board: WiredBoard) -> list[str]:
    """All problems of a board."""
    texts = [f"{board.name}, {device.name}: {text}" for device in board.devices for text in _of_device(device)]
    return texts + [f"{board.name}, net {net}: {text}" for net in sorted(_nets(board)) for text in _of_net(board, net)]


def _nets(board: WiredBoard) -> set[str]:
    return {net for device in board.devices for net in device.wires().values()}


def _of_device(device: Device) -> Iterator[str]:
    kinds = device.symbol.pins
    for pin in device.pins.keys() - kinds.keys():
        yield f"it has no pin {pin}"
    for pin, kind in kinds.items():
        net = device.pins.get(pin)
        if net is None and kind in ("supply", "ground", "in", "io", "tri"):
            yield f"pin {pin} is not wired"
        elif net is not None and kind == "open":
            yield f"pin {pin} must stay open"
        elif net is not None and kind == "ground" and net != "GND":
            yield f"ground pin {pin} is wired to {net}"
        elif net is not None and kind == "supply":
            low, high = device.symbol.supply_v
            if not low <= POWER.get(net, -1.0) <= high:
                yield f"supply pin {pin} is wired to {net}: needs {low:g} to {high:g} V"


def _of_net(board: WiredBoard, net: str) -> Iterator[str]:
    ends = [(d, pin, d.symbol.pins.get(pin, "open")) for d in board.devices for pin, at in d.pins.items() if at == net]
    processor = board.pins.get(net)
    if len(ends) + (processor is not None) < 2:
        yield "it ends nowhere"
    fixed = sum(kind == "out" for _, _, kind in ends) + (processor is not None and processor.direction == "out")
    shared = sum(kind == "tri" for _, _, kind in ends)
    either = any(kind == "io" for _, _, kind in ends) or (processor is not None and processor.direction == "io")
    if fixed > 1 or (fixed and shared):
        yield "it has several drivers"
    if not (fixed or shared or either):
        yield "nothing drives it"
    for device, pin, kind in ends:
        others = [_level(d, k) for d, p, k in ends if (d, p) != (device, pin)]
        if processor and processor.direction != "in":
            others.append(PROCESSOR_V)
        limit = device.symbol.bus_v if kind in DRIVERS else device.symbol.input_v
        if max(others, default=0.0) > limit:
            yield f"{device.name}, pin {pin} withstands {limit:g} V, another drives {max(others):g} V"


def _level(device: Device, kind: str) -> float:
    """Level at which a pin drives, V. A pin that goes either way follows its net: the shifter, open drains."""
    return device.symbol.logic_v if kind in DRIVERS else 0.0
