# SPDX-License-Identifier: MIT
"""First and last swing of a walk: the way of the hips while this leg does not carry them.

In: the hips' speed over this leg's stance before and after a swing, the swing's times. Out: ways (m). Owns the model.

This leg measures the hips' speed only while it stands. In a swing between two stances the speed is taken to change evenly from that at toe off to
that after heel strike. In a steady walk both are the pace. A walk begins and ends within about a step [Breniere and Do 1986; Jian 1993]: the first
swing leaves from slow hips and lands under hips at pace; the closing one leaves at pace and lands beside the other foot under hips that all but rest.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echostep.legs.kinematics import Travel

SPEED_S = 0.15  # over which a speed is taken; by reason: long against noise, short against a step
SETTING_OFF = 0.25  # speed over the pace when the first foot leaves the floor [Breniere and Do 1986; Jian 1993]


class Swing(NamedTuple):
    """Speeds (m/s) at toe off and heel strike, times (s) from toe off to mid swing and from there to the strike."""

    leaving: float
    landing: float
    before_s: float
    after_s: float

    @property
    def middle(self) -> float:
        """Speed at mid swing."""
        span = self.before_s + self.after_s
        return self.leaving + (self.landing - self.leaving) * (self.before_s / span if span > 0.0 else 0.5)

    def first_half_m(self) -> float:
        """Way from toe off to mid swing."""
        return 0.5 * (self.leaving + self.middle) * self.before_s

    def second_half_m(self) -> float:
        """Way from mid swing to heel strike."""
        return 0.5 * (self.middle + self.landing) * self.after_s


def leaving_share(trail_m: float, usual_m: float) -> float:
    """Speed of the hips over the pace when a foot leaves the floor for the first time, by its distance behind the hips over the usual one.

    A foot that leaves from beside the other is the first to leave; one that is as far behind as ever leaves after a step of the other.
    """
    share = min(max(trail_m / usual_m, 0.0), 1.0) if usual_m > 0.0 else 0.0
    return SETTING_OFF + (1.0 - SETTING_OFF) * share


def speed(way: Travel, at: int, until: int, hz: float, most: float) -> float:
    """Speed (m/s) of the hips between two indices of a stance, from 0 to `most`."""
    first, last = max(min(at, until), 0), min(max(at, until), len(way.forward_m) - 1)
    if last <= first:
        return 0.0
    found = (float(way.forward_m[last]) - float(way.forward_m[first])) * hz / (last - first)
    return float(np.clip(found, 0.0, most))
