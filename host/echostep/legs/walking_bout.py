"""State of a walk under way, and the rules for its edges, stairs and pace.

In: measured biases, angles of the knee, positions of the foot, speeds. Out: `GyroBias`, `Bout`, the relative pace in an edge swing, flags. Owns
nothing but these records.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import Flag
from echostep.legs.swing_detection import GRID_HZ

# The source of a value without a citation is not recorded.
USUAL_STRIDE_S = 1.2  # duration before a stride is known
BENT_RAD = math.radians(
    33.0
)  # knee on stairs at the strike (up) or half a stride later (down); on the flat 5 to 25 degrees
BIAS_SD_RAD_S = math.radians(3.0)  # at the start
SMALLEST_BIAS_SD_RAD_S = math.radians(0.02)
SLOWEST_EDGE = (
    0.5  # relative pace in an edge swing with the feet together; 1 when the foot comes from or goes to a whole stride
)
PACES = (0.32, 0.55)  # speed / sqrt(g leg): 0.9 and 1.6 m/s with legs of 0.86 m [Froude number 0.10 and 0.30]
GRAVITY_M_S2 = 9.81


@dataclass(slots=True)
class GyroBias:
    """Bias of a gyro (rad/s) and its variance."""

    value: float = 0.0
    variance: float = BIAS_SD_RAD_S**2

    def learn(self, measured: float, sd: float) -> None:
        """Kalman update by a measured bias (rad/s) with standard deviation `sd`."""
        gain = self.variance / (self.variance + sd * sd)
        self.value += gain * (measured - self.value)
        self.variance = max((1.0 - gain) * self.variance, SMALLEST_BIAS_SD_RAD_S**2)


@dataclass(slots=True)
class Bout:
    """A walk under way, in grid indices: `begin`, whether it begins with standing, `peaks`: its mid swings.

    `level`: angles (rad) of thigh and shank at `level_index`; None until known. The fields from `cycle` (grid samples) on are those of the newest
    stride.
    """

    begin: int
    stood: bool
    peaks: list[int] = field(default_factory=list)
    level: tuple[float, float] | None = None
    level_index: int = 0
    cycle: int = int(USUAL_STRIDE_S * GRID_HZ)
    pace_m_s: float | None = None
    reach_m: float = 0.0  # ankle in front of the hip at heel strike
    trail_m: float = 0.0  # ankle behind the hip at toe off
    blind: Flag = Flag.NONE  # UNSEEN or BACKWARD


def edge_pace(reach_m: float, usual_m: float) -> float:
    """Pace of the hips over the usual pace in the first or last swing of this leg, by the foot's distance from the hips over the usual one.

    When this foot leaves from beside the other or comes to rest there, the hips are slow in this swing; otherwise they have full pace [Jian 1993].
    """
    share = min(max(reach_m / usual_m, 0.0), 1.0) if usual_m > 0.0 else 0.0
    return SLOWEST_EDGE + (1.0 - SLOWEST_EDGE) * share


def stairs_flag(knee_at_strike: float, knee_half_later: float) -> Flag:
    """Stairs by the knee (rad): up stairs it is bent at heel strike, down stairs it bends under load half a stride later [Riener 2002]."""
    if knee_at_strike > BENT_RAD:
        return Flag.STAIRS_UP
    return Flag.STAIRS_DOWN if knee_half_later > BENT_RAD else Flag.NONE


def pace_flag(speed_m_s: float, lengths: LegLengths) -> Flag:
    """Slow or fast, relative to the length of the leg [Froude 1868; Alexander 1989]."""
    relative = speed_m_s / math.sqrt(GRAVITY_M_S2 * (lengths.thigh_m + lengths.to_ankle_m))
    return Flag.SLOW if relative < PACES[0] else Flag.FAST if relative > PACES[1] else Flag.NONE
