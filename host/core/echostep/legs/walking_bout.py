# SPDX-License-Identifier: MIT
"""State of a walk under way, and the rules for stairs and pace.

In: angles of the knee, speeds. Out: `Bout`, flags. Owns nothing but these records.

At its edges, the first and the last swing, this leg does not carry the hips; it measures their speed only while it stands. In a swing between two
stances the speed is taken to change evenly from toe off to after heel strike. In a steady walk both are the pace. A walk begins and ends within about
a step [Breniere and Do 1986; Jian 1993]: the first swing leaves from slow hips and lands under hips at pace; the closing one leaves at pace and lands
beside the other foot under hips that are nearly at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echostep.legs.kinematics import LegLengths, Travel
from echostep.legs.stride import Flag
from echostep.legs.swing_detection import GRID_HZ

USUAL_STRIDE_S = 1.2  # duration before a stride is known, assumed
# Knee (rad) on stairs at the strike (up) or half a stride later (down), and its change between these moments. On the flat 5 to 15 degrees and +4
# to -20, up stairs 62 and -48, down stairs 40 and +33 [curves of Riener 2002]. A drift of the angles, or a turn that leaks into them, changes the
# difference less than the angle itself: both are needed, and the hips must rise or sink over the standing foot.
BENT_RAD = math.radians(25.0)
EXTENDS_RAD, BENDS_RAD = math.radians(30.0), math.radians(20.0)
LEAST_RISE_M = 0.04  # in half a stride; a step is 0.15 to 0.2 m high [DIN 18065]
PACES = (0.32, 0.55)  # speed / sqrt(g leg): 0.9 and 1.6 m/s with legs of 0.86 m [Froude number 0.10 and 0.30]
SPEED_S = 0.15  # over which a speed is taken: long compared with noise, short compared with a step
SETTING_OFF = 0.25  # speed over the pace when the first foot leaves the floor [Breniere and Do 1986; Jian 1993]


@dataclass(slots=True)
class Bout:
    """A walk under way, in grid indices: `begin`, whether it begins with standing, `peaks`: its mid swings.

    The fields from `cycle` (grid samples) on belong to the newest stride.
    """

    begin: int
    stood: bool
    peaks: list[int] = field(default_factory=list)
    cycle: int = int(USUAL_STRIDE_S * GRID_HZ)
    pace_m_s: float | None = None
    trail_m: float = 0.0  # ankle behind the hip at toe off
    strike: int = 0  # grid samples after the preceding mid swing
    toe_off: int = 0  # index
    blind: Flag = Flag.NONE  # UNSEEN or BACKWARD
    lead: float = math.nan  # of the thigh before the shank, mean of the last strides

    def add_lead(self, lead: float) -> None:
        """Add the lead of one stride: the direction does not change from stride to stride, but a stride that ends a walk has hardly any lead."""
        self.lead = lead if math.isnan(self.lead) else 0.5 * (lead + self.lead)


def climbs(knee_at_strike: float, knee_half_later: float) -> bool:
    """Whether the knee (rad) straightens or bends under load as on stairs; a drift of the angles does not matter."""
    return not -EXTENDS_RAD < knee_half_later - knee_at_strike < BENDS_RAD


def stairs_flag(knee_at_strike: float, knee_half_later: float, rise_m: float) -> Flag:
    """Stairs: up, the knee (rad) is bent at heel strike and straightens; down, it bends under load [Riener 2002]. `rise_m`: of the hips meanwhile."""
    if not climbs(knee_at_strike, knee_half_later):
        return Flag.NONE
    if knee_half_later < knee_at_strike:
        return Flag.STAIRS_UP if knee_at_strike > BENT_RAD and rise_m > LEAST_RISE_M else Flag.NONE
    return Flag.STAIRS_DOWN if knee_half_later > BENT_RAD and rise_m < -LEAST_RISE_M else Flag.NONE


def pace_flag(speed_m_s: float, lengths: LegLengths) -> Flag:
    """Slow or fast, relative to the length of the leg [Froude 1868; Alexander 1989]."""
    relative = lengths.relative_speed(speed_m_s)
    return Flag.SLOW if relative < PACES[0] else Flag.FAST if relative > PACES[1] else Flag.NONE


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
    """Speed of the hips over the pace when a foot leaves the floor for the first time, from its distance behind the hips over the usual distance.

    A foot that leaves from beside the other is the first to leave; a foot as far behind as usual leaves after a step of the other.
    """
    share = min(max(trail_m / usual_m, 0.0), 1.0) if usual_m > 0.0 else 0.0
    return SETTING_OFF + (1.0 - SETTING_OFF) * share


def speed(way: Travel, at: int, until: int, hz: float, most: float) -> float:
    """Speed (m/s) of the hips between two indices of a stance, from 0 to `most`."""
    first, last = max(min(at, until), 0), min(max(at, until), len(way.forward_m) - 1)
    if last <= first:
        return 0.0
    mean_m_s = (float(way.forward_m[last]) - float(way.forward_m[first])) * hz / (last - first)
    return float(np.clip(mean_m_s, 0.0, most))
