# SPDX-License-Identifier: MIT
"""An import besides the plan: what the person says beforehand, and the units, layers, elements left out and doubts that come out.

In: options; notes of an importer. Out: `Hints`, `ImportReport`. Owns the usual height of a storey. `summary` makes the text that a person reads.
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


@dataclass(slots=True)
class ImportReport:
    """Filled by one importer.

    `units`: the units, and how they were decided. `layers`: names of the layers used, by kind of element. `left_out`: number of elements that did not
    become a part of the plan, by a description ("LINE on A-FURN"). `doubts`: sentences for the person who imports, the gravest first.
    `doors_remedy`: the remedy for rooms without doors in this format.
    """

    units: str = ""
    layers: dict[str, list[str]] = field(default_factory=dict)
    left_out: dict[str, int] = field(default_factory=dict)
    doubts: list[str] = field(default_factory=list)
    doors_remedy: str = "echostep plan edit draws doors"

    def use(self, kind: str, layer: str) -> None:
        """Note a layer that elements of a kind were read from."""
        names = self.layers.setdefault(kind, [])
        if layer not in names:
            names.append(layer)

    def leave_out(self, what: str, count: int = 1) -> None:
        """Count elements that do not become a part of the plan."""
        self.left_out[what] = self.left_out.get(what, 0) + count
        if self.left_out[what] <= 0:
            del self.left_out[what]

    def take_back(self, what: str) -> None:
        """Uncount an element that became a part of the plan after all."""
        if what in self.left_out:
            self.leave_out(what, -1)

    def doubt(self, sentence: str) -> None:
        """Note a doubt once."""
        if sentence not in self.doubts:
            self.doubts.append(sentence)
