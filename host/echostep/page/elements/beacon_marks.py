# SPDX-License-Identifier: MIT
"""Beacon marks: beacons as a page draws them.

In: a tracker, in its thread. Out: `BeaconMark`s that any thread may read. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from echostep.localization.estimate import CHI2_95
from echostep.tracker import Tracker

HEARD_S = 1.5  # a beacon counts as heard this long after its last reading. By reason: longer than a step, at whose end readings are used


@dataclass(frozen=True, slots=True)
class BeaconMark:
    """A beacon by its number, at the mean of its position over the particles. The field names are keys of the frame's JSON.

    `radius95_m`: radius of a circle with the beacon's spread, scaled as a 95 % ellipse. `state`: value of a `BeaconState`.
    `heard`: whether a reading came within the last `HEARD_S`.
    """

    number: int
    x_m: float
    y_m: float
    radius95_m: float
    level: int
    state: str
    heard: bool


def beacon_marks(tracker: Tracker, t_s: float) -> tuple[BeaconMark, ...]:
    """Marks of all beacons with a known position at time `t_s`."""
    numbers = tracker.state.beacon_numbers
    if not numbers:
        return ()
    return tuple(
        BeaconMark(
            numbers[b.slot], b.x_m, b.y_m, math.sqrt(CHI2_95) * b.sd_m, b.level, b.state.value,
            t_s - b.heard_s < HEARD_S,
        )
        for b in tracker.beacon_places(t_s)
    )  # fmt: skip
