# SPDX-License-Identifier: MIT
"""The types that odometry and localization exchange: the trunk's path in pieces, and the measurements on each; the length of a path.

In: nothing. Out: `PathSegment`, `MeasuredSegment`, `Dropout`, `Odometer`. Owns nothing. Frame: walk (z up, origin and yaw arbitrary at the start).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeVar

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.elementary import wrap

# Share of an arc that the way in a turn follows. The simulated wearers walk whole arcs; in the one available turn with motion capture, on the spot,
# the pelvis went 0 to 0.4 of it [Sy 2020]
BENT = 0.5
Share = TypeVar("Share", float, Floats)

STANDING_PIECE_S = 0.5  # duration of the segments into which standing is cut: two estimates a second
UNOBSERVED_SD_M = 0.75  # a segment with a larger standard deviation was not observed: half a stride of an adult


def bend_of(turn_rad: float) -> float:
    """Bend of a way with this turn, as a share of its chord: BENT of an arc, whose height over the chord is chord / 2 * tan(turn / 4)."""
    return BENT * 2.0 * math.tan(0.25 * turn_rad)


class Odometer:
    """Length of a path so far. A mark on the path is the value of `path_m` there."""

    def __init__(self) -> None:
        self.path_m = 0.0

    def add(self, length_m: float) -> None:
        """Lengthen the path."""
        self.path_m += length_m

    def since_m(self, mark_m: float) -> float:
        """Length of the path since a mark; infinite since -inf, a mark that was never taken."""
        return self.path_m - mark_m


class StanceHeadings(NamedTuple):
    """Yaw of the foot and angle of the belt (rad, each from a zero of its own) at a time in a stance.

    `growth_rad2`: of the variance of the foot's yaw since the stance before. `bias_sd_rad_s`: how far the belt gyro's bias differed in between.
    `begins`: nothing joins the belt's angle to the one before.
    """

    t_s: float
    foot_rad: float
    belt_rad: float
    growth_rad2: float
    bias_sd_rad_s: float
    begins: bool


class BeltEvidence(NamedTuple):
    """Evidence of the belt's gyro for a step: stances since the step before; the error of the foot's heading that was removed from the step, and the
    standard deviation of its turn without that removal.
    """

    stances: tuple[StanceHeadings, ...]
    correction_rad: float
    foot_turn_sd_rad: float


@dataclass(frozen=True, slots=True)
class PathSegment:
    """The trunk moves evenly by (dx, dy) in the walk frame, from `t0_s` to `t1_s`, turning from `heading0_rad` to `heading1_rad`, on a curve.

    `sd_m`: standard deviation of the move per axis. `turn_sd_rad`: growth of the yaw's standard deviation. `step`: steps so far.
    `anchor_sd_m`: standard deviation of the end per axis, by itself. `rise_m`: height gained by the foot, with its standard deviation,
    infinite if no foot measured it. `scale_sd`: growth of the standard deviation of the scale that all lengths share. `belt`: of a foot's step.
    `running`: the foot rests too briefly for a walk. `aloft`: it has been off the floor for longer than a step takes.
    """

    t0_s: float
    t1_s: float
    dx_m: float
    dy_m: float
    heading0_rad: float
    heading1_rad: float
    sd_m: float
    turn_sd_rad: float
    step: int
    anchor_sd_m: float = 0.0
    rise_m: float = 0.0
    rise_sd_m: float = math.inf
    scale_sd: float = 0.0
    belt: BeltEvidence | None = None
    running: bool = False
    aloft: bool = False

    @property
    def unobserved(self) -> bool:
        """Whether the foot was silent for so long that the move is a guess, and the way to it unknown."""
        return self.sd_m > UNOBSERVED_SD_M

    @property
    def turn_rad(self) -> float:
        """From the heading at the beginning to the heading at the end, the shorter way round."""
        return wrap(self.heading1_rad - self.heading0_rad)

    @property
    def bend_m(self) -> tuple[float, float]:
        """Bend in the walk frame: the middle of the path lies a quarter of this vector off the chord.

        BENT of the arc of a circle that turns with the trunk, whatever the trunk's heading. A left turn bends the way to the right of the chord.
        """
        bend = bend_of(self.turn_rad)
        return bend * self.dy_m, -bend * self.dx_m

    def way_m(self, share: Share) -> tuple[Share, Share]:
        """Way east and north in the walk frame from the beginning to these shares of the segment, on a parabola."""
        bend_x, bend_y = self.bend_m
        return share * (self.dx_m + (1.0 - share) * bend_x), share * (self.dy_m + (1.0 - share) * bend_y)

    def heading_rad(self, t_s: float) -> float:
        """Heading of the trunk at a time on this segment."""
        share = (t_s - self.t0_s) / (self.t1_s - self.t0_s) if self.t1_s > self.t0_s else 1.0
        return self.heading0_rad + share * self.turn_rad


@dataclass(frozen=True, slots=True)
class MeasuredSegment:
    """A path segment with the pings triggered since the segment before it, oldest first.

    `t_s`, `ranger` (0 looks left, 1 right) and `range_m` (NaN: no echo) are (n,). `height_m` (k,): heights by pressure in the same time.
    `ranger_part`: kind of ranger of the last ping, as the board has named it [protocol/messages.toml, part]; 0: not named, or no ping.
    `barometer_starts`: how often the heights have restarted before these, by a restart of the board (maybe another board) or a reset value.
    `ahead_rad`: how far both rangers look ahead of abeam.
    """

    segment: PathSegment
    t_s: Floats
    ranger: Ints
    range_m: Floats
    height_m: Floats = field(default_factory=lambda: np.zeros(0))
    ranger_part: int = 0
    barometer_starts: int = 0
    ahead_rad: float = 0.0

    @property
    def off_heading_rad(self) -> Floats:
        """Axis of each ping's ranger (n,) from the trunk's heading."""
        return np.asarray(np.where(self.ranger == 0, 1.0, -1.0) * (0.5 * math.pi - self.ahead_rad))

    @property
    def without_pings(self) -> MeasuredSegment:
        """The same segment, heights and all, without its pings."""
        return replace(self, t_s=np.zeros(0), ranger=np.zeros(0, np.int64), range_m=np.zeros(0))

    def after(self, t_s: float) -> MeasuredSegment:
        """The part of the segment after a time on it, with the pings triggered since."""
        s = self.segment
        x_m, y_m = s.way_m((t_s - s.t0_s) / (s.t1_s - s.t0_s))
        rest = replace(s, t0_s=t_s, dx_m=s.dx_m - x_m, dy_m=s.dy_m - y_m, heading0_rad=s.heading_rad(t_s))
        later = self.t_s >= t_s
        return replace(self, segment=rest, t_s=self.t_s[later], ranger=self.ranger[later], range_m=self.range_m[later])


@dataclass(frozen=True, slots=True)
class Dropout:
    """At `t_s` the board sends, but neither foot nor legs have been observed for a second: the position is unknown from here on."""

    t_s: float
