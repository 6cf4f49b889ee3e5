"""Marks: beacons as a page draws them.

In: a tracker, in its thread. Out: `Mark`s that any thread may read. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from echostep.localization.estimate import CHI2_95
from echostep.tracker import Tracker

HEARD_S = 1.5  # since it spoke: longer than a step, whose end brings the words


@dataclass(frozen=True, slots=True)
class Mark:
    """A beacon by its number, where the cloud believes it to be now.

    `radius95_m`: of a circle as wide as its spread, as a 95 % ellipse is drawn. `state`: a `BeaconState`; `heard`: it speaks now.
    """

    number: int
    x_m: float
    y_m: float
    radius95_m: float
    level: int
    state: str
    heard: bool


def marks(tracker: Tracker, t_s: float) -> tuple[Mark, ...]:
    """All beacons whose place is known at a moment."""
    numbers = tracker.state.beacon_numbers
    if not numbers:
        return ()
    return tuple(
        Mark(
            numbers[b.slot], b.x_m, b.y_m, math.sqrt(CHI2_95) * b.sd_m, b.level, b.state.value,
            t_s - b.heard_s < HEARD_S,
        )
        for b in tracker.beacon_places(t_s)
    )  # fmt: skip
