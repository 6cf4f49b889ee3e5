"""How far the hips go while one leg carries them: two segments over a foot that rolls.

In: angles of thigh and shank against the vertical over a stance (rad, positive when the lower end is in front), when the heel touched, the
stride's time. Out: travel of the hips over the floor, forward and up. Owns the constants of the model and nothing else.

The hip is L1 sin(thigh) + L2 sin(shank) behind the ankle. The ankle itself moves: it comes forward as the foot comes down about the heel, and
again as the foot rises about the ball [Perry 1992, heel and forefoot rocker]. How far the foot is pitched is what the shank says, less the angle
of the ankle, whose curve is the normal one. The legs do the same half a stride apart: so what this leg shows of any half stride in its stance is
a step of the hips. Their turn (pelvic rotation) adds to what one hip joint does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats

# Dorsiflexion of the ankle every 4 % of the stride from heel strike to toe off, degrees [Perry 1992; Winter 2009; Kadaba 1990, read to a degree].
DORSIFLEXION_DEG = (2, 1, -1, 1, 3, 6, 8, 9, 10, 11, 13, 14, 14, 11, 5, -4, -10, -14, -14)
DORSIFLEXION_STEP = 0.04
ANKLE_HEIGHT = (
    0.16  # of the shank: 0.039 of the body's height, the shank is 0.246 [Winter 2009, after Drillis and Contini]
)
BALL_AHEAD, HEEL_BEHIND = 0.30, 0.11  # of the shank: from the ankle to the ball of the foot and to where the heel rolls
FLAT = 0.08  # share of the stride at which the foot is flat on the floor [Perry 1992, loading response]
HEEL_RISES = 0.25  # not before
TOE_OFF = 0.62
PELVIS = 1.017  # of a stride: two hips 17 cm apart turn by 4 degrees either way with steps of 0.7 m [Perry 1992]
HALVES = (0.06, 0.08, 0.10)  # where half strides begin, foot all but flat
ALONE = (0.14, 0.42)  # phases
# A shank so much longer than the thigh is measured to the floor: 0.285 of the height, not 0.246; the thigh has 0.245 [Winter 2009]; people differ.
WITH_FOOT = 1.14
TO_FLOOR = 0.285 / 0.246

MEAN_THIGH_RAD, MEAN_SHANK_RAD = math.radians(7.0), math.radians(-14.2)  # over a normal stride, by the same curves
STANDING_THIGH_RAD, STANDING_SHANK_RAD = math.radians(0.0), math.radians(-3.0)  # the weight is before the ankles


@dataclass(frozen=True, slots=True)
class LegLengths:
    """`thigh_m` from hip to knee, `shank_m` from knee to ankle, `scale` of all that they make: what a walk of known length has told."""

    thigh_m: float = 0.43
    shank_m: float = 0.43
    scale: float = 1.0

    @property
    def measured_to_floor(self) -> bool:
        """Whether the shank given is so long that it must contain the foot."""
        return self.shank_m > WITH_FOOT * self.thigh_m

    @property
    def to_ankle_m(self) -> float:
        """Knee to ankle."""
        return self.shank_m / TO_FLOOR if self.measured_to_floor else self.shank_m


@dataclass(frozen=True, slots=True)
class Travel:
    """`forward_m`, `up_m` (n,): where the hips are during a stance, from an arbitrary zero; `phase` (n,) of the stride, 0 at heel strike."""

    phase: Floats
    forward_m: Floats
    up_m: Floats

    def half(self, begin: float) -> tuple[float, float]:
        """How far forward and up in the half stride from a phase on."""
        at = np.array([begin, begin + 0.5])
        forward, up = (np.interp(at, self.phase, c) for c in (self.forward_m, self.up_m))
        return float(forward[1] - forward[0]), float(up[1] - up[0])

    def passed(self) -> float:
        """How far forward while this leg carries alone and its foot is flat."""
        begin, end = np.interp(ALONE, self.phase, self.forward_m)
        return float(end - begin)

    def stride(self) -> tuple[float, float]:
        """Forward and up in a whole stride: both legs do what this one does."""
        halves = np.array([self.half(begin) for begin in HALVES]).mean(axis=0)
        return 2.0 * PELVIS * float(halves[0]), 2.0 * float(halves[1])


def knee_at(phase: Floats, thigh: Floats, shank: Floats, at: float) -> float:
    """Flexion of the knee at a phase."""
    return float(np.interp(at, phase, thigh - shank))


def travel(
    phase: Floats, thigh: Floats, shank: Floats, segments: LegLengths, struck: float | None = 0.0, *, rolls: bool = True
) -> Travel:
    """The hips over the standing foot at phases (n,) of the stride; `struck`: phase of the heel's strike, None when the foot stood already.

    `rolls`: the foot rises about its ball; on stairs it hardly does while it carries.
    """
    shank_m = segments.to_ankle_m
    ankle_ahead = segments.thigh_m * np.sin(thigh) + shank_m * np.sin(shank)
    above = segments.thigh_m * np.cos(thigh) + shank_m * np.cos(shank)
    pitch = heel_rise(phase, shank) if rolls else np.zeros_like(shank)
    rise_x, rise_z = _about_ball(pitch, shank_m)
    down_x = _about_heel(phase, shank, struck, shank_m) if struck is not None else 0.0
    forward = (rise_x + down_x - ankle_ahead) * segments.scale
    return Travel(phase, forward, (above + rise_z) * segments.scale)


def heel_rise(phase: Floats, shank: Floats) -> Floats:
    """How far the foot is pitched toe down (n,), rad: what of the shank's lean the ankle does not take."""
    grid = DORSIFLEXION_STEP * np.arange(len(DORSIFLEXION_DEG))
    ankle = np.interp(phase, grid, np.radians(DORSIFLEXION_DEG))
    found: Floats = np.where(phase > HEEL_RISES, np.clip(-shank - ankle, 0.0, None), 0.0)
    return found


def _about_ball(pitch: Floats, shank_m: float) -> tuple[Floats, Floats]:
    """The ankle's way forward and up when the foot turns about the ball."""
    ahead, high = BALL_AHEAD * shank_m, ANKLE_HEIGHT * shank_m
    c, s = np.cos(pitch), np.sin(pitch)
    return ahead * (1.0 - c) + high * s, ahead * s - high * (1.0 - c)


def _about_heel(phase: Floats, shank: Floats, struck: float, shank_m: float) -> Floats:
    """The ankle's way forward, until the foot is flat, from where it will stand; the ankle is neutral at the strike [Perry 1992]."""
    toe_up = max(float(np.interp(struck, phase, shank)), 0.0) * np.clip(1.0 - (phase - struck) / FLAT, 0.0, 1.0)
    high, behind = ANKLE_HEIGHT * shank_m, HEEL_BEHIND * shank_m
    found: Floats = -high * np.sin(toe_up) - behind * (1.0 - np.cos(toe_up))
    return found
