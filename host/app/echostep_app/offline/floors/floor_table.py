# SPDX-License-Identifier: MIT
"""Heights of floors as text and from a record; the floors of a record as CSV and in words.

In: text, `HeightRecord`, `Floors`. Out: heights, a CSV file, visits and climbs. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.file_mode import write_csv
from echostep_app.offline.floors.floors import CLIMBING, Floors
from echostep_app.offline.floors.stays import HeightRecord
from echostep_app.printing.lines import as_error

COLUMNS = ("t_s", "floor", "probability", "height_m")
CLOSEST_M, HIGHEST_M, MOST_STOREYS = 1.5, 2000.0, 64
VISIT_S = 4.0  # shortest visit without a stay that is printed
SURE_P = 0.9  # median probability from which the floor is stated without a warning


@dataclass(frozen=True, slots=True)
class Visit:
    """Time on one floor, given by its index."""

    floor: int
    from_s: float
    to_s: float


def parse_heights(text: str) -> Floats:
    """Heights (k,) of the floors from text such as "0,3.5,7"; raises EchostepError."""
    try:
        heights = [float(cell) for cell in text.split(",")]
    except ValueError as error:
        raise EchostepError(f"--heights {text}: metres between commas are expected, as 0,3.5,7, or auto") from error
    return checked_heights(np.array(heights))


def checked_heights(heights_m: Floats) -> Floats:
    """The heights of the storeys; raises EchostepError when they cannot be a building's."""
    heights = np.asarray(heights_m, dtype=float)
    if heights.ndim != 1 or not 1 <= len(heights) <= MOST_STOREYS:
        raise EchostepError(f"heights: {heights.size} storeys, expected 1 to {MOST_STOREYS}")
    if not np.isfinite(heights).all() or np.abs(heights).max() > HIGHEST_M:
        raise EchostepError(f"heights: metres between {-HIGHEST_M:.0f} and {HIGHEST_M:.0f} are expected")
    for k, gap in enumerate(np.diff(heights)):
        if gap < CLOSEST_M:
            raise EchostepError(
                f"heights: storey {k + 1} ({heights[k + 1]:g} m) is not {CLOSEST_M} m or more above storey {k} ({heights[k]:g} m): "
                "give them ascending, in metres"
            )
    return heights


def find_levels(record: HeightRecord, name: str) -> Floats:
    """Heights (k,) above the lowest level of all levels with a stay in the file `name`; raises EchostepError for a single one.

    Each stay is on a known level, whose height becomes the mean over its stays, or on a new one.
    """
    known, count, here = [0.0], [1], 0
    for (last, stay), gust in zip(pairwise(record.stays), record.gust[1:], strict=True):
        if gust:
            continue
        height_m = known[here] + stay.first_m - last.last_m
        here = int(np.argmin(np.abs(np.array(known) - height_m)))
        if abs(known[here] - height_m) > CLOSEST_M:
            here = len(known)
            known.append(0.0)
            count.append(0)
        count[here] += 1
        known[here] += (height_m - known[here]) / count[here]
    if len(known) < 2:
        raise EchostepError(f"{name}: heights: the record shows one storey only: give the heights as --heights 0,3.5,7")
    return np.round(np.sort(known) - min(known), 2)


def visits(floors: Floors, record: HeightRecord) -> list[Visit]:
    """The floors with a stay, and those at which the way turned, in order of time; floors that are only passed are left out."""
    still = np.zeros(len(record.t_s), bool)
    for stay in record.stays:
        still[stay.begin : stay.end] = True
    edges = np.flatnonzero(np.diff(floors.floor, prepend=-1, append=-1)).tolist()
    found: list[Visit] = []
    for begin, end in pairwise(edges):
        floor, t_s = int(floors.floor[begin]), floors.t_s[begin:end]
        next_ = int(floors.floor[min(end, edges[-1] - 1)])
        turns = not found or not min(found[-1].floor, next_) < floor < max(found[-1].floor, next_)
        if not (still[record.segment[begin:end]].any() or (turns and t_s[-1] - t_s[0] >= VISIT_S)):
            continue
        on_level = t_s[np.abs(floors.height_m[begin:end] - floors.heights_m[floor]) < CLIMBING.landing_sd_m]
        from_s, to_s = (on_level if len(on_level) else t_s)[[0, -1]].tolist()
        if found and found[-1].floor == floor:
            from_s = found.pop().from_s
        found.append(Visit(floor, from_s, to_s))
    return found


def describe(floors: Floors, record: HeightRecord) -> str:
    """Visits, metres climbed between them, and a warning when the floor is uncertain, a line each."""
    found = visits(floors, record)
    lines = [
        f"floor {each.floor} ({floors.heights_m[each.floor]:g} m): {round(each.from_s, 2)} to {round(each.to_s, 2)} s"
        for each in found
    ]
    rises_m = np.diff([floors.heights_m[each.floor] for each in found])
    up_m, down_m = rises_m[rises_m > 0.0].sum(), np.abs(rises_m[rises_m < 0.0]).sum()
    lines.append(
        f"{len(found)} stays on {len({each.floor for each in found})} floors; climbed {up_m:.1f} m up, {down_m:.1f} m down; {len(floors.t_s)} samples"
    )
    sure = float(np.median(floors.probability))
    if sure < SURE_P:
        lines.append(
            f"which floor it is, is not certain (median probability {sure:.2f}): the climbs fit several; "
            "give the first with --start FLOOR"
        )
    return "\n".join(lines)


def write_floors(path: Path, floors: Floors) -> None:
    """COLUMNS for every sample; raises EchostepError when the file cannot be written."""
    columns = (floors.t_s, floors.floor, floors.probability, floors.height_m)
    rows = zip(*(each.tolist() for each in columns), strict=True)
    with as_error(f"{path}: cannot write the floors"):
        write_csv(path, COLUMNS, ((f"{t:.6f}", k, f"{p:.4f}", f"{h:.3f}") for t, k, p, h in rows))
