"""State of a walk under way: the gyros' biases, the bout since its beginning, and what its first and last swings tell.

In: measured rates, angles of the knee, positions of the foot. Out: `GyroBias`, `Bout`, the pace at either end of a walk, stairs or none.
Owns nothing but these records.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echostep.legs.stride import Flag
from echostep.legs.swing_detection import GRID_HZ

USUAL_STRIDE_S = 1.2
BENT_RAD = math.radians(
    33.0
)  # of the knee at the strike (up) or half a stride later (down); on the flat 5 to 25 degrees
BIAS_SD_RAD_S = math.radians(3.0)
AT_LEAST = 0.5  # of the pace, in a swing that begins or ends a walk with the feet together; all of it when the foot comes from or to a whole stride


@dataclass(slots=True)
class GyroBias:
    """A gyro's bias by its estimate and variance (rad/s)."""

    value: float = 0.0
    variance: float = BIAS_SD_RAD_S**2

    def learn(self, measured: float, sd: float) -> None:
        """Kalman update by a measured bias."""
        gain = self.variance / (self.variance + sd * sd)
        self.value += gain * (measured - self.value)
        self.variance = max((1.0 - gain) * self.variance, math.radians(0.02) ** 2)


@dataclass(slots=True)
class Bout:
    """A walk under way, in indices of the grid: its beginning, whether it begins with standing, the middles of its swings.

    `level`: angles of thigh and shank at index `level_at`; None until known. `cycle`, `reach_m`,
    `trail_m` of its newest stride.
    """

    begin: int
    stood: bool
    peaks: list[int] = field(default_factory=list)
    level: tuple[float, float] | None = None
    level_at: int = 0
    cycle: int = int(USUAL_STRIDE_S * GRID_HZ)
    pace_m_s: float | None = None
    reach_m: float = 0.0  # of the foot before the hips at the strike
    trail_m: float = 0.0  # behind them at toe off
    blind: Flag = Flag.NONE  # of the newest stride


def edge_pace(reach_m: float, usual_m: float) -> float:
    """The hips' pace against the usual one while this leg swings for the first or the last time, by how far its foot is from under them.

    A walk that begins or ends with this foot beside the other hardly moves in that swing; with the other foot it moves at full pace [Jian 1993].
    """
    share = min(max(reach_m / usual_m, 0.0), 1.0) if usual_m > 0.0 else 0.0
    return AT_LEAST + (1.0 - AT_LEAST) * share


def stairs_flag(knee_at_strike: float, knee_half_later: float) -> Flag:
    """Up stairs a foot is set down with a bent knee; down stairs the knee that carries gives way [Riener 2002]."""
    if knee_at_strike > BENT_RAD:
        return Flag.STAIRS_UP
    return Flag.STAIRS_DOWN if knee_half_later > BENT_RAD else Flag.NONE
