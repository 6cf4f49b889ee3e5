# SPDX-License-Identifier: MIT
"""Falls: an impact just after an upright posture, then lying with little motion.

In: tenths of a second of the belt (with the thigh's force) and of the foot, and strides, in order of their messages. Out: `Fall`s; the
trunk's tilt. Owns the standing directions and the last upright part.

The phases are from [Kangas et al. 2008, Gait & Posture 28, 285-291] at the waist: impact of at least 2 g, then posture, lying when the vertical
force is at most half of gravity, a tilt of 60 degrees; their dip below 0.6 g before the impact is not required, since slow falls lack it. To exclude
work on the knees the thigh must lie too, where it has an accelerometer; to exclude impacts of walking, running and jumps, the impact must come after
the trunk was last upright (or just before), and the wearer must then move little.

At the foot each step is an impact, and a kneeling or crawling wearer's foot does not stand. There a fall is an impact after the foot last stood,
and then a foot that lies on its side: reported only while the belt has no accelerometer. Falls that neither detects are left to `alarm.py`: no
motion.
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from echostep.foot.ins import GRAVITY_M_S2
from echostep_app.wearer.standing_direction import StandingDirection, Vector
from echostep_app.wearer.tenths import TENTH_S, Tenth

# Assumed, not measured, where no source is named.
# A stride of a wearer on foot is longer and takes less time; on the knees it is half as long
STRIDE_M, STRIDE_S = 0.9, 2.0
CALM_M_S2, CALM_RAD_S = 1.0, 1.0  # unrest and turning of a standing foot in mid-stance
QUIET_M_S2, QUIET_RAD_S = 0.5, 0.25  # of a wearer who moves little: five times noise and breath, a third of crawling
AROUND_GRAVITY_M_S2 = 3.5  # of a mean force that shows a posture
UPRIGHT_RAD, LYING_RAD = math.radians(35.0), math.radians(60.0)  # lying: [Kangas et al. 2008]
THIGH_RAD = math.radians(45.0)  # of a lying wearer's thigh; on the knees it is upright
SIDEWAYS = math.sin(math.radians(45.0))  # of gravity along a foot that lies on its side
MOSTLY = 0.9  # of the tenths of a quiet time: a twitch does not end it
FRESH_S = 1.0  # the belt is used while its newest tenth is not older
MOST_RAD_S = 70.0  # that a gyro measures [ICM-20649 data sheet DS-000192: 4000 deg/s]
KEPT = 50  # tenths, for the strides that are known later


class FallLimits(NamedTuple):
    """`impact_m_s2`: at most `before_s` before the wearer was last upright; `quiet_s` of lying, at most `within_s` after that moment.

    `smooth`: tenths over which the force is averaged.
    """

    impact_m_s2: float
    before_s: float
    quiet_s: float
    within_s: float
    smooth: int


# 2 g: [Kangas et al. 2008]. Half a second: knees that give way meet the floor before the trunk tips, and the mean follows it by a quarter.
BELT = FallLimits(2.0 * GRAVITY_M_S2, 0.5, 3.0, 5.0, 5)
# 5 g: as much as an MTx shows on an axis; a foot that is put down on purpose meets less. Only after the foot stood: before that it was a step.
FOOT = FallLimits(5.0 * GRAVITY_M_S2, -0.5 * TENTH_S, 5.0, 4.0, 1)


class Fall(NamedTuple):
    """The wearer fell: the impact was at `t_s`; known at `known_s`, after lying for a while."""

    t_s: float
    known_s: float


class Watch:
    """Detector of lying from the tenths of one place; a fall is reported once for each time upright."""

    def __init__(self, limits: FallLimits) -> None:
        self._limits = limits
        self._forces: deque[Vector] = deque(maxlen=limits.smooth)
        self._lies: deque[bool] = deque(maxlen=round(limits.quiet_s / TENTH_S))
        self._upright_s = self._impact_s = -math.inf
        self.newest_s = -math.inf
        self.tilt_rad = math.nan

    def add(self, tenth: Tenth, up: StandingDirection, *, may_lie: bool) -> Fall | None:
        """The fall that a tenth completes; `may_lie`: no other sensor contradicts lying."""
        limits = self._limits
        if math.isnan(tenth.force[0]):
            return None
        if tenth.end_s - self.newest_s > 2.5 * TENTH_S:
            self._forces.clear()
            self._lies.clear()
        self.newest_s = tenth.end_s
        self._forces.append(tenth.force)
        force = _mean(self._forces)
        shows = abs(math.hypot(*force) - GRAVITY_M_S2) < AROUND_GRAVITY_M_S2
        self.tilt_rad = up.tilt_rad(force)
        if shows and self.tilt_rad < UPRIGHT_RAD:
            self._upright_s = tenth.end_s
            self._lies.clear()
        if tenth.peak >= limits.impact_m_s2:
            self._impact_s = tenth.end_s
        quiet = tenth.unrest < QUIET_M_S2 and not tenth.turning > QUIET_RAD_S
        self._lies.append(shows and self.tilt_rad > LYING_RAD and may_lie and quiet)
        needed = self._lies.maxlen or 1
        if len(self._lies) < needed or sum(self._lies) < MOSTLY * needed:
            return None
        in_time = tenth.end_s - limits.quiet_s - self._upright_s <= limits.within_s
        if not in_time or self._impact_s < self._upright_s - limits.before_s:
            return None
        self._upright_s = -math.inf
        return Fall(self._impact_s, tenth.end_s)


class Falls:
    """Call `add_belt`, `add_foot` and `add_stride` in order of the messages."""

    def __init__(self) -> None:
        self._trunk, self._thigh, self._sole = StandingDirection(), StandingDirection(), StandingDirection()
        self._belt, self._foot = Watch(BELT), Watch(FOOT)
        self._belt_tenths: deque[Tenth] = deque(maxlen=KEPT)
        self._foot_tenths: deque[Tenth] = deque(maxlen=KEPT)

    def trunk_tilt_rad(self, now_s: float) -> float:
        """Tilt of the trunk over the last half second against its direction in walking; NaN without the belt's accelerometer.

        A lift, a turn or a blow shifts it for as long as it lasts: 1 m/s2 to the side is 6 degrees.
        """
        return self._belt.tilt_rad if now_s - self._belt.newest_s <= FRESH_S else math.nan

    def add_stride(self, t0_s: float, t1_s: float, length_m: float) -> None:
        """A stride between two times: the standing directions are learnt from strides of a wearer on foot."""
        if length_m < STRIDE_M or not 0.0 < t1_s - t0_s < STRIDE_S:
            return
        belt, foot = (
            [x for x in tenths if t0_s < x.end_s <= t1_s] for tenths in (self._belt_tenths, self._foot_tenths)
        )
        self._trunk.add_stride([x.force for x in belt], [])
        self._thigh.add_stride([x.beside for x in belt], [])
        calm = [x.force for x in foot if x.unrest < CALM_M_S2 and x.turning < CALM_RAD_S]
        self._sole.add_stride(calm, [x.rate for x in foot if x.turning < MOST_RAD_S])

    def add_belt(self, tenth: Tenth) -> Fall | None:
        """A tenth of the belt's accelerometer and gyro; with the thigh's force."""
        self._belt_tenths.append(tenth)
        thigh_rad = self._thigh.tilt_rad(tenth.beside)
        return self._belt.add(tenth, self._trunk, may_lie=not thigh_rad < THIGH_RAD)

    def add_foot(self, tenth: Tenth) -> Fall | None:
        """A tenth of the foot's accelerometer and gyro."""
        self._foot_tenths.append(tenth)
        fall = self._foot.add(tenth, self._sole, may_lie=self._sole.sideways(tenth.force) > SIDEWAYS)
        belt_tells = self._trunk.is_known and tenth.end_s - self._belt.newest_s <= FRESH_S
        return None if belt_tells else fall


def _mean(forces: deque[Vector]) -> Vector:
    n = len(forces)
    return sum(f[0] for f in forces) / n, sum(f[1] for f in forces) / n, sum(f[2] for f in forces) / n
