# SPDX-License-Identifier: MIT
"""Travel of the hips over one standing leg: thigh and shank over a foot that rolls.

In: angles of thigh and shank against the vertical over a stance (rad, positive when the lower end is in front), phases of the stride, phase of the
heel strike. Out: travel of the hips over the floor, forward and up. Owns the constants of the model and nothing else.

              hip       ankle - hip, forward: L1 sin(thigh) + L2 sin(shank)
     thigh L1 |         hip - ankle, up:      L1 cos(thigh) + L2 cos(shank)
             knee
     shank L2 |
            ankle       The foot turns about the heel until it is flat, later about the ball.
         heel --- ball

The ankle itself moves forward as the foot comes down about the heel, and again as the foot rises about the ball [Perry 1992, heel and forefoot
rocker]. The pitch of the foot is the lean of the shank less the angle of the ankle, which is taken from its normal curve. Both legs are assumed to
move alike, half a stride apart: so the travel in any half stride of this leg's stance is a step. Pelvic rotation adds to the travel of one hip joint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import cos, sin

GRAVITY_M_S2 = 9.81
# Of thigh and shank alike, if not known: adults of both sexes are 1.65 m tall on average [NCD-RisC 2016, world], times 0.245 and 0.246
# [Winter 2009].
USUAL_M = 0.405
# Dorsiflexion of the ankle every 4 % of the stride from heel strike to toe off, degrees [Perry 1992; Winter 2009; Kadaba 1990, read to a degree].
DORSIFLEXION_DEG = (2, 1, -1, 1, 3, 6, 8, 9, 10, 11, 13, 13, 12, 8, 1, -7, -13, -16, -16)
DORSIFLEXION_STEP = 0.04  # phase between two values
# With speed the push-off comes earlier and goes farther [Schwartz 2008]: this much more plantarflexion per unit of speed / sqrt(g leg) beyond the
# curve's speed (1.35 m/s with legs of 0.86 m), at a phase of 0.56; half of it below. The foot's own gyros show 70 degrees per unit between
# 1.55 and 1.95 m/s (two legs of one person), and about 30 down to 1.05 m/s (two of another).
PUSH_OFF_RAD, CURVE_SPEED = math.radians(60.0), 0.465
# From none to all of this change; at 0.4 it is a third of its value at 0.56, at 0.5 three quarters (the same feet)
PUSH_OFF_PHASES = (0.33, 0.56)
# In lengths of the shank: 0.039 of the body's height over 0.246 [Winter 2009, after Drillis and Contini].
ANKLE_HEIGHT = 0.16
# In lengths of the shank, from the ankle to the ball of the foot and to the rolling point of the heel: a foot is about 0.62 of a shank
# long (0.152 of the body's height over 0.246), nearly half of it between ankle and ball, a sixth behind the ankle.
BALL_AHEAD, HEEL_BEHIND = 0.30, 0.11
FLAT = 0.08  # phase from which the foot is flat on the floor [Perry 1992, loading response]
HEEL_RISES = 0.25  # earliest phase of heel rise: a little before mid stance, TOE_OFF / 2
TOE_OFF = 0.62  # phase: a foot stands for about 60 % of a stride
PELVIS = 1.017  # factor on a stride: two hips 17 cm apart turn by 4 degrees either way with steps of 0.7 m [Perry 1992]
# Phases at which half strides begin: about FLAT, and half a stride later the same foot still stands (TOE_OFF).
HALVES = (0.06, 0.08, 0.10)
# Phases between which the foot carries alone: the other one leaves at TOE_OFF - 0.5 and lands at 0.5, with a margin at both ends.
SINGLE_SUPPORT = (0.14, 0.42)
# Least ratio of shank to thigh for a shank measured to the floor: to the floor it is 0.285 of the height, to the ankle 0.246, the thigh is 0.245
# [Winter 2009]; the limit lies between 1.00 and 1.16, as persons differ.
SHANK_TO_FLOOR_RATIO = 1.14
FLOOR_TO_ANKLE_RATIO = 0.285 / 0.246


@dataclass(frozen=True, slots=True)
class LegLengths:
    """`thigh_m`: hip to knee. `shank_m`: knee to ankle, or to the floor. `scale`: factor on all lengths, from a walk of known length."""

    thigh_m: float = USUAL_M
    shank_m: float = USUAL_M
    scale: float = 1.0

    @property
    def measured(self) -> bool:
        """Whether the lengths are the wearer's own, not the usual ones."""
        return (self.thigh_m, self.shank_m) != (USUAL_M, USUAL_M)

    @property
    def measured_to_floor(self) -> bool:
        """Whether the shank is so long that it must include the foot."""
        return self.shank_m > SHANK_TO_FLOOR_RATIO * self.thigh_m

    @property
    def to_ankle_m(self) -> float:
        """Length from knee to ankle."""
        return self.shank_m / FLOOR_TO_ANKLE_RATIO if self.measured_to_floor else self.shank_m

    def relative_speed(self, speed_m_s: float) -> float:
        """Speed over the root of gravity and length of the leg: the root of the Froude number [Alexander 1989]."""
        return speed_m_s / math.sqrt(GRAVITY_M_S2 * (self.thigh_m + self.to_ankle_m))

    def ankle_ahead_m(self, thigh: float, shank: float) -> float:
        """Distance (m, not scaled) of the ankle in front of the hip, for angles in rad."""
        return self.thigh_m * math.sin(thigh) + self.to_ankle_m * math.sin(shank)


@dataclass(frozen=True, slots=True)
class Travel:
    """`forward_m`, `up_m` (n,): position of the hips during a stance, with arbitrary zero; `phase` (n,) of the stride, 0 at heel strike."""

    phase: Floats
    forward_m: Floats
    up_m: Floats

    def half(self, begin: float) -> tuple[float, float]:
        """Travel (m) forward and up in the half stride that begins at a phase."""
        ends = np.array([begin, begin + 0.5])
        forward, up = (np.interp(ends, self.phase, c) for c in (self.forward_m, self.up_m))
        return float(forward[1] - forward[0]), float(up[1] - up[0])

    def passed(self) -> float:
        """Travel (m) forward in single support, with a flat foot."""
        begin, end = np.interp(SINGLE_SUPPORT, self.phase, self.forward_m)
        return float(end - begin)

    def stride(self) -> tuple[float, float]:
        """Travel (m) forward and up in a whole stride: twice the mean of the half strides, as both legs move alike."""
        halves = np.array([self.half(begin) for begin in HALVES]).mean(axis=0)
        return 2.0 * PELVIS * float(halves[0]), 2.0 * float(halves[1])


def travel(
    phase: Floats,
    thigh: Floats,
    shank: Floats,
    segments: LegLengths,
    struck: float | None = 0.0,
    *,
    rolls: bool = True,
    speed: float = CURVE_SPEED,
) -> Travel:
    """Travel of the hips over the standing foot at phases (n,); `struck`: phase of the heel strike, None if the foot stood before.

    `rolls`: whether the foot rises about its ball; on stairs it hardly does while it carries. `speed`: relative speed of the walk.
    """
    shank_m = segments.to_ankle_m
    ankle_ahead = segments.thigh_m * sin(thigh) + shank_m * sin(shank)
    above = segments.thigh_m * cos(thigh) + shank_m * cos(shank)
    pitch = heel_rise(phase, shank, speed) if rolls else np.zeros_like(shank)
    rise_x, rise_z = _about_ball(pitch, shank_m)
    down_x = _about_heel(phase, shank, struck, shank_m) if struck is not None else 0.0
    forward = (rise_x + down_x - ankle_ahead) * segments.scale
    return Travel(phase, forward, (above + rise_z) * segments.scale)


def heel_rise(phase: Floats, shank: Floats, speed: float = CURVE_SPEED) -> Floats:
    """Pitch of the foot (n,), rad, toe down: the forward lean of the shank less the dorsiflexion of the ankle at this relative speed."""
    grid = DORSIFLEXION_STEP * np.arange(len(DORSIFLEXION_DEG))
    ankle = np.interp(phase, grid, np.radians(DORSIFLEXION_DEG))
    faster = speed - CURVE_SPEED
    ankle -= PUSH_OFF_RAD * (faster if faster > 0.0 else 0.5 * faster) * np.interp(phase, PUSH_OFF_PHASES, (0.0, 1.0))
    return np.where(phase > HEEL_RISES, np.clip(-shank - ankle, 0.0, None), 0.0)


def _about_ball(pitch: Floats, shank_m: float) -> tuple[Floats, Floats]:
    """Displacement (m) of the ankle forward and up when the foot has turned about the ball by `pitch` (n,)."""
    ahead, high = BALL_AHEAD * shank_m, ANKLE_HEIGHT * shank_m
    c, s = cos(pitch), sin(pitch)
    return ahead * (1.0 - c) + high * s, ahead * s - high * (1.0 - c)


def _about_heel(phase: Floats, shank: Floats, struck: float, shank_m: float) -> Floats:
    """Forward displacement (m) of the ankle relative to the flat foot; the ankle is neutral at the strike [Perry 1992]."""
    toe_up = max(float(np.interp(struck, phase, shank)), 0.0) * np.clip(1.0 - (phase - struck) / FLAT, 0.0, 1.0)
    high, behind = ANKLE_HEIGHT * shank_m, HEEL_BEHIND * shank_m
    return -high * sin(toe_up) - behind * (1.0 - cos(toe_up))
