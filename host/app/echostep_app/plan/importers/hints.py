# SPDX-License-Identifier: MIT
"""Hints from the person who imports a file, where the file lacks a value or states a wrong one.

In: nothing. Out: `Hints`. Owns the usual height of a storey.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

STOREY_HEIGHT_M = 3.5  # from level to level, for formats without heights: a usual storey


@dataclass(frozen=True, slots=True)
class Hints:
    """`storey_height_m` where the file has no heights; `doors_m`: width of doors that are to be assumed (IMDF).

    For drawings: `units`; `scale_m`, metres a unit, instead of units; patterns of `layers` by kind; `windows` (x0, y0, x1, y1 in drawing units), each
    a level, the lowest first; `level_names`; `align`: lay the levels over each other.
    """

    storey_height_m: float = STOREY_HEIGHT_M
    units: str | None = None
    layers: Mapping[str, Sequence[str]] = field(default_factory=dict)
    doors_m: float | None = None
    scale_m: float | None = None
    windows: Sequence[Sequence[float]] = ()
    level_names: Sequence[str] = ()
    align: bool = False
