# SPDX-License-Identifier: MIT
"""Results of an import besides the plan: units, layers, elements left out, doubts.

In: notes of an importer. Out: `ImportReport`. Owns nothing. `summary` makes the text that a person reads.
"""

from __future__ import annotations

from dataclasses import dataclass, field


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
