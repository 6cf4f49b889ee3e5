# SPDX-License-Identifier: MIT
"""Units of a drawing: as stated, if the drawing then has the size of a building.

In: lengths of a drawing in its own units. Out: metres a unit, and how that was decided; or EchostepError with the unit that makes sense. Owns
the usual sizes of buildings. Most drawings state the unit of the template that they started from, whatever they were drawn in.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from echostep.errors import EchostepError
from echostep_app.plan.importers.dxf.frame import METRES
from echostep_app.plan.importers.report import ImportReport

INSUNITS = {
    1: "in", 2: "ft", 3: "mi", 4: "mm", 5: "cm", 6: "m", 7: "km", 10: "yd", 14: "dm", 15: "dam", 16: "hm",
    21: "ft", 22: "in", 23: "yd", 24: "mi",
}  # fmt: skip  # 21 to 24: US survey units, longer by 2e-6
RARE = {"dm": 0.1, "yd": 0.9144, "dam": 10.0, "hm": 100.0, "km": 1000.0, "mi": 1609.344}  # too rare to be proposed
STATED = METRES | RARE
NAMES = {
    "mm": "millimetres", "cm": "centimetres", "m": "metres", "in": "inches", "ft": "feet",
    "dm": "decimetres", "yd": "yards", "dam": "decametres", "hm": "hectometres", "km": "kilometres", "mi": "miles",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Usual:
    """A length in buildings: least and greatest (m), typical (m), and the spread of buildings about that (standard deviation of ln)."""

    least_m: float
    most_m: float
    typical_m: float
    spread: float
    words: str


# Assumed, from dimensions of rooms and doors in DIN 18040 and Neufert; the bounds are wide, because the import asks about a building outside them.
USUAL = {
    "size": Usual(2.5, 1500.0, 30.0, 1.2, "the building is {} long"),
    "door": Usual(0.45, 2.2, 0.9, 0.25, "its doors are {} wide"),
    "wall": Usual(0.4, 120.0, 5.0, 0.7, "half of its walls are pieces of {} or more"),
    "thickness": Usual(0.03, 1.3, 0.2, 0.5, "its walls are {} thick"),
    "text": Usual(0.015, 3.0, 0.25, 0.6, "its letters are {} high"),
}
MUCH_ODDER = 6.0  # difference of the sums of squares from which another unit is worth a question: as unusual as 2.4 standard deviations; assumed
LEAST_PIECE = 1e-9


def scale_of(
    drawing: Any, lengths: Mapping[str, float], given: str | None, file: Path, report: ImportReport
) -> tuple[float, str]:
    """Metres a unit, and the words for the summary; raises EchostepError when the units are not stated or contradict the lengths.

    `lengths`: measured lengths, by the keys of `USUAL`, in drawing units. `given`: the unit of --units.
    """
    if given is not None:
        return METRES[given], f"{given} (--units)"
    stated = stated_unit(drawing)
    sensible = likely_unit(lengths)
    advice = f"give --units {sensible}" if sensible else f"give --units {'|'.join(METRES)}"
    if stated is None:
        would = f"; in {NAMES[sensible]} the building is {_size(lengths, sensible)} long" if sensible else ""
        raise EchostepError(f"{file}: the drawing does not say its units ($INSUNITS){would}: {advice}")
    wrong = _contradictions(lengths, STATED[stated])
    if wrong and not (sensible is None and "size" not in wrong):
        words = " and ".join(USUAL[key].words.format(_metres(lengths[key] * STATED[stated])) for key in wrong[:2])
        right = f"--units {stated}" if stated in METRES else f"--scale {STATED[stated]:g}"
        ask = f"is it in {NAMES[sensible]}? {advice} (or {right} if it is right)" if sensible else advice
        raise EchostepError(f"{file}: the drawing states {NAMES[stated]} ($INSUNITS), but then {words}: {ask}")
    if wrong:
        words = " and ".join(USUAL[key].words.format(_metres(lengths[key] * STATED[stated])) for key in wrong[:2])
        report.doubt(f"{file.name}: {words} in {NAMES[stated]} as stated, and no other unit is better: --scale?")
    if sensible and _oddity(lengths, STATED[stated]) - _oddity(lengths, METRES[sensible]) > MUCH_ODDER:
        sizes = f"{_size(lengths, stated)} long in {NAMES[stated]} as stated, {_size(lengths, sensible)} in {NAMES[sensible]}"
        report.doubt(f"{file.name} would be a more usual building in another unit: {sizes}: --units {sensible}?")
    return STATED[stated], f"{stated} ($INSUNITS; sizes fit)" if lengths else f"{stated} ($INSUNITS)"


def stated_unit(drawing: Any) -> str | None:
    """The unit in the drawing's header; None if missing or unknown."""
    try:
        return INSUNITS.get(int(drawing.header.get("$INSUNITS", 0)))
    except (TypeError, ValueError):
        return None


def likely_unit(lengths: Mapping[str, float]) -> str | None:
    """The unit with which the lengths are most usual for a building; None when none fits."""
    fitting = [unit for unit, metre in METRES.items() if lengths and not _contradictions(lengths, metre)]
    return min(fitting, key=lambda unit: _oddity(lengths, METRES[unit]), default=None)


def _contradictions(lengths: Mapping[str, float], metre: float) -> list[str]:
    """The lengths that no building has, with `metre` metres a unit."""
    return [key for key, length in lengths.items() if not USUAL[key].least_m <= length * metre <= USUAL[key].most_m]


def _oddity(lengths: Mapping[str, float], metre: float) -> float:
    """How unusual the lengths are: the sum of squares of their deviations in standard deviations."""
    return sum(
        (math.log(max(length * metre, LEAST_PIECE) / USUAL[key].typical_m) / USUAL[key].spread) ** 2
        for key, length in lengths.items()
    )


def _size(lengths: Mapping[str, float], unit: str) -> str:
    return _metres(lengths["size"] * STATED[unit]) if "size" in lengths else "of a usual size"


def _metres(length_m: float) -> str:
    return f"{length_m:.3g} m" if length_m < 1000 else f"{length_m / 1000:.3g} km"
