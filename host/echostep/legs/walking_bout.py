# SPDX-License-Identifier: MIT
"""State of a walk under way, and the rules for stairs and pace.

In: angles of the knee, speeds. Out: `Bout`, flags. Owns nothing but these records.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag
from echostep.legs.swing_detection import GRID_HZ

USUAL_STRIDE_S = 1.2  # duration before a stride is known; by reason
# Knee (rad) on stairs at the strike (up) or half a stride later (down), and its change between these moments. On the flat 5 to 15 degrees and +4
# to -20, up stairs 62 and -48, down stairs 40 and +33 [curves of Riener 2002]. A drift of the angles, or a turn that leaks into them, changes the
# difference less than the angle itself: both are needed, and the hips must rise or sink over the standing foot.
BENT_RAD = math.radians(25.0)
EXTENDS_RAD, BENDS_RAD = math.radians(30.0), math.radians(20.0)
LEAST_RISE_M = 0.04  # in half a stride; a step is 0.15 to 0.2 m high [DIN 18065]
PACES = (0.32, 0.55)  # speed / sqrt(g leg): 0.9 and 1.6 m/s with legs of 0.86 m [Froude number 0.10 and 0.30]


@dataclass(slots=True)
class Bout:
    """A walk under way, in grid indices: `begin`, whether it begins with standing, `peaks`: its mid swings.

    The fields from `cycle` (grid samples) on are those of the newest stride.
    """

    begin: int
    stood: bool
    peaks: list[int] = field(default_factory=list)
    cycle: int = int(USUAL_STRIDE_S * GRID_HZ)
    pace_m_s: float | None = None
    trail_m: float = 0.0  # ankle behind the hip at toe off
    strike: int = 0  # grid samples after the mid swing before
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
