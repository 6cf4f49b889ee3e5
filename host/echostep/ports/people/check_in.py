# SPDX-License-Identifier: MIT
"""Check-in: the wearer's position, entered by hand, and its undoing; a call for help, and its end.

In: a position from the page, or a call. Out: the bytes of a chunk of the port `PERSON`; `CheckIn`s, `Undo`s or `Call`s from them. Owns nothing.
The bytes are recorded like those of any port, so a replay has the same check-ins in the same order. They may be damaged or hostile.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any

from echostep.plan.json_fields import LIMIT_M

PERSON = "person"  # name of the port
# Assumed, all of them.
MOST_BYTES = 512  # of one encoded check-in
MOST_LEVELS = 1000
LEAST_SD_M, MOST_SD_M = 0.05, 100.0  # m, per axis; an entered value is limited to this range
HEADING_SD_RAD = math.radians(15.0)  # of an entered heading


@dataclass(frozen=True, slots=True)
class CheckIn:
    """A position (x_m, y_m) on a level, with standard deviation `sd_m` per axis. `heading_rad` is None when only a position was entered."""

    x_m: float
    y_m: float
    heading_rad: float | None
    sd_m: float
    level: int = 0

    def encode(self) -> bytes:
        """The check-in as JSON: the bytes of a chunk."""
        return json.dumps(asdict(self)).encode()


@dataclass(frozen=True, slots=True)
class Undo:
    """Takes back check-in number `undo`, counted from 1, if it is still the newest."""

    undo: int

    def encode(self) -> bytes:
        """The undoing as JSON: the bytes of a chunk."""
        return json.dumps(asdict(self)).encode()


@dataclass(frozen=True, slots=True)
class Call:
    """The wearer asks for help (`help` True), or withdraws the call."""

    help: bool

    def encode(self) -> bytes:
        """The call as JSON: the bytes of a chunk."""
        return json.dumps(asdict(self)).encode()


def parse_person(payload: bytes) -> CheckIn | Undo | Call | None:
    """The check-in, the undoing or the call of a chunk; None when the bytes are none of them."""
    if len(payload) > MOST_BYTES:
        return None
    try:
        tree = json.loads(payload)
    except (ValueError, RecursionError):
        return None
    if isinstance(tree, dict) and "help" in tree:
        return call_of(tree)
    return undo_of(tree) if isinstance(tree, dict) and "undo" in tree else check_in_of(tree)


def call_of(tree: Any) -> Call | None:
    """The call in a JSON object; None when it is none."""
    wanted = tree.get("help") if isinstance(tree, dict) else None
    return Call(wanted) if isinstance(wanted, bool) else None


def undo_of(tree: Any) -> Undo | None:
    """The undoing in a JSON object; None when its number is not one."""
    number = tree.get("undo") if isinstance(tree, dict) else None
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number < 1 << 31:
        return None
    return Undo(number)


def check_in_of(tree: Any) -> CheckIn | None:
    """The check-in in a JSON object; None when a field is missing or out of range. Other fields are ignored."""
    if not isinstance(tree, dict):
        return None
    x, y, sd, heading = (_number(tree.get(name)) for name in ("x_m", "y_m", "sd_m", "heading_rad"))
    level = tree.get("level", 0)
    if x is None or y is None or sd is None or (heading is None and tree.get("heading_rad") is not None):
        return None
    if isinstance(level, bool) or not isinstance(level, int) or not 0 <= level < MOST_LEVELS:
        return None
    wrapped = None if heading is None else math.remainder(heading, 2.0 * math.pi)
    return CheckIn(x, y, wrapped, min(max(sd, LEAST_SD_M), MOST_SD_M), level)


def _number(value: Any) -> float | None:
    """The value as a float; None when it is not a finite number within the limits of a plan's coordinates."""
    fits = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LIMIT_M
    return float(value) if fits else None
