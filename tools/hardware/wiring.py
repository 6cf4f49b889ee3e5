# SPDX-License-Identifier: MIT
"""The wiring of the three processor boards, read from wiring.toml.

In: firmware/hardware/wiring.toml. Out: `WiredBoard`s with their devices, and the pins of the processor. Owns nothing; `nets` checks it.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache

from hardware import HARDWARE

POWER = {"5V": 5.0, "3V3": 3.3, "GND": 0.0}  # nets of the processor board's own pins, V


@dataclass(frozen=True, slots=True)
class Pin:
    """A pin of the processor, by its port and as printed on the board; `define` is its name in a file of the firmware."""

    nets: tuple[str, ...]
    port: str
    board: str
    direction: str
    file: str
    define: str


@dataclass(frozen=True, slots=True)
class Symbol:
    """A part as it is wired. Voltages in V: range of its supply, level of its outputs, limits of its inputs and of its three-state output."""

    title: str
    supply_v: tuple[float, float]
    logic_v: float
    input_v: float
    bus_v: float
    pins: dict[str, str]  # kind by name
    pulls: dict[str, tuple[float, float]]  # resistors on its board, from a pin to a voltage: V, ohm


@dataclass(frozen=True, slots=True)
class Device:
    """One part in one place; `pins` has the net of each pin that is wired."""

    name: str
    symbol: Symbol
    note: str
    pins: dict[str, str]

    def wires(self) -> dict[str, str]:
        """Nets of the pins that are neither supply nor ground."""
        return {pin: net for pin, net in self.pins.items() if net not in POWER}


@dataclass(frozen=True, slots=True)
class WiredBoard:
    """A processor board with all that is wired to it."""

    name: str
    title: str
    devices: tuple[Device, ...]
    pins: dict[str, Pin]  # of the processor, by net; only those that are wired


@cache
def pins() -> tuple[Pin, ...]:
    """All pins of the processor that the firmware uses."""
    return tuple(Pin(**{**row, "nets": tuple(row["nets"])}) for row in _table()["pin"])


@cache
def boards() -> tuple[WiredBoard, ...]:
    """The three boards."""
    table = _table()
    symbols = {
        name: Symbol(**{"pulls": {}, **row, "supply_v": tuple(row["supply_v"])})
        for name, row in table["symbol"].items()
    }
    made = []
    for row in table["board"]:
        devices = tuple(Device(**{**device, "symbol": symbols[device["symbol"]]}) for device in row["device"])
        wired = {net for device in devices for net in device.pins.values()}
        used = {net: pin for pin in pins() for net in pin.nets if net in wired}
        made.append(WiredBoard(row["name"], row["title"], devices, used))
    return tuple(made)


@cache
def _table() -> dict:  # type: ignore[type-arg]
    return tomllib.loads((HARDWARE / "wiring.toml").read_text(encoding="utf-8"))
