# SPDX-License-Identifier: MIT
"""Electrical checks of the boards' nets, the simple part of what KiCad calls ERC; `make hardware` runs them.

In: a `WiredBoard`. Out: problems in words; none when every pin is wired or meant to be open, every net has one driver or parts that take
turns, supplies are in range, no level exceeds what an input withstands, and MISO rests at a one or a zero. Currents and rise times are not
checked. Owns the processor's thresholds.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator

from hardware import schematic
from hardware.wiring import POWER, Device, WiredBoard, boards

DRIVERS = ("out", "tri")
PROCESSOR_V = 5.0  # level of its outputs
PULL_UP_OHM = (20e3, 50e3)  # of the processor [ATmega32U4 data sheet, table 29-1]
# What it reads for certain: 0.2 VCC - 0.1 V and 0.2 VCC + 0.9 V [the same, from memory]
LOW_MAX_V, HIGH_MIN_V = 0.9, 1.9
# For 8 s, its LEDs [Caterina.h of Leonardo and Micro; tools/twin/mcu/board.c]
BOOTLOADER_DRIVES = ("PC7", "PB0", "PD5")


def problems(board: WiredBoard) -> list[str]:
    """All problems of a board."""
    texts = [f"{board.name}, {device.name}: {text}" for device in board.devices for text in _of_device(device)]
    return texts + [f"{board.name}, net {net}: {text}" for net in sorted(_nets(board)) for text in _of_net(board, net)]


def idle_v(board: WiredBoard, net: str, pull_up_ohm: float = math.inf) -> float:
    """Voltage of a net that nothing drives, by the resistors on it and the processor's pull-up; NaN without any."""
    pulls = [(PROCESSOR_V, pull_up_ohm)]
    for device in board.devices:
        pulls += [
            device.symbol.pulls[pin] for pin, at in device.pins.items() if at == net and pin in device.symbol.pulls
        ]
        if device.symbol.title == "resistor" and net in device.pins.values():
            (other,) = (at for at in device.pins.values() if at != net)
            pulls += [(POWER[other], ohm_of(device))] if other in POWER else []
    siemens = sum(1.0 / ohm for _, ohm in pulls)
    return sum(volts / ohm for volts, ohm in pulls) / siemens if siemens else math.nan


def ohm_of(resistor: Device) -> float:
    """The resistance that the note of a resistor begins with: `2.2 kohm`."""
    return 1e3 * float(resistor.note.split(" kohm")[0])


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
    if processor and processor.port in BOOTLOADER_DRIVES and (fixed or shared):
        yield f"the bootloader drives {processor.port} for its LED: 1 kohm in series is missing"
    if not (fixed or shared or either or _is_driven_through(board, net)):
        yield "nothing drives it"
    if shared and processor and not all(_is_certain(idle_v(board, net, ohm)) for ohm in PULL_UP_OHM):
        yield "it rests between the processor's thresholds"
    for device, pin, kind in ends:
        others = [_level(d, k) for d, p, k in ends if (d, p) != (device, pin)]
        if processor and processor.direction != "in":
            others.append(PROCESSOR_V)
        limit = device.symbol.bus_v if kind in DRIVERS else device.symbol.input_v
        if max(others, default=0.0) > limit:
            yield f"{device.name}, pin {pin} withstands {limit:g} V, another drives {max(others):g} V"


def _is_certain(volts: float) -> bool:
    return not LOW_MAX_V < volts < HIGH_MIN_V


def _is_driven_through(board: WiredBoard, net: str) -> bool:
    """Whether a resistor joins the net to one that a part drives."""
    joined = {
        at for d in board.devices if d.symbol.title == "resistor" and net in d.pins.values() for at in d.pins.values()
    }
    drives = {at for d in board.devices for pin, at in d.pins.items() if d.symbol.pins.get(pin) in (*DRIVERS, "io")}
    return bool((joined - {net} - POWER.keys()) & drives)


def _level(device: Device, kind: str) -> float:
    """Level at which a pin drives, V. A pin that goes either way follows its net: the shifter, open drains."""
    return device.symbol.logic_v if kind in DRIVERS else 0.0


def main() -> int:
    argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0]).parse_args()
    found = [text for board in boards() for text in problems(board)]
    found += [text for board in boards() for text in schematic.problems(board, schematic.file_of(board).read_text())]
    print(
        "\n".join(found)
        or f"wiring: {sum(len(_nets(board)) for board in boards())} nets, each with one driver at a time"
    )
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
