# SPDX-License-Identifier: MIT
"""The right foot between two footprints: flat and still, rolling over its ball, swinging, landing on its heel.

In: times and places of the stances. Out: the path and the attitude of the sensor on its instep. Owns nothing.
A stride runs from the middle of one stance to the middle of the next. Timing of heel off, toe off and heel strike as in [Perry 1992].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Bools, Floats
from echostep_simulation.people.attitude import rotations
from echostep_simulation.people.rolling_foot import glide

HEEL_OFF, TOE_OFF, HEEL_STRIKE, FLAT = 0.20, 0.35, 0.73, 0.80  # shares of the stride, from the middle of the stance
BALL = np.array([0.10, 0.0, -0.08])  # from the sensor, foot frame (m)
HEEL = np.array([-0.12, 0.0, -0.08])
KNOCK_M, KNOCK_HZ = 0.0003, 35.0  # shaking after heel strike, about 1.5 g


@dataclass(frozen=True, slots=True)
class FootPath:
    """How one foot moves: its distance from the trunk's line (negative: right), toe angle, lift, and pitch at toe off and heel strike."""

    left_m: float = -0.08
    toe_out_rad: float = math.radians(7.0)
    lift_m: float = 0.05
    toe_down_rad: float = math.radians(60.0)
    toe_up_rad: float = math.radians(22.0)
    roll_rad: float = math.radians(5.0)


@dataclass(frozen=True, slots=True)
class Strides:
    """Middles of stances `t_s` (k,), and the trunk above the foot at each: `trunk_m` (k, 2), `heading_rad` (k,), `ground_m` (k,) the floor's height.

    `moves` (k - 1,): whether the foot moves between them.
    """

    t_s: Floats
    moves: Bools
    trunk_m: Floats
    heading_rad: Floats
    ground_m: Floats

    def at(self, t_s: Floats) -> tuple[NDArray[np.intp], Floats]:
        """Number of the stride at each time, and the share of it that is over."""
        k = np.clip(np.searchsorted(self.t_s, t_s, side="right") - 1, 0, len(self.moves) - 1)
        share: Floats = np.clip((t_s - self.t_s[k]) / np.diff(self.t_s)[k], 0.0, 1.0)
        return k, share

    def phase(self, t_s: Floats) -> Floats:
        """Phase of the gait cycle, 0 at heel strike, 1 at the next one."""
        k, share = self.at(t_s)
        phases: Floats = (k + share + 1.0 - HEEL_STRIKE) % 1.0
        return phases

    def effort(self, t_s: Floats, usual_m: float) -> Floats:
        """Length of the stride at each time against a usual one; 0 when standing, a little when turning on the spot."""
        k, _ = self.at(t_s)
        lengths = np.hypot(*np.diff(self.trunk_m, axis=0).T) / usual_m
        efforts: Floats = np.where(self.moves, np.clip(lengths, 0.25, 1.3), 0.0)[k]
        return efforts


def foot_path(t_s: Floats, strides: Strides, foot: FootPath, height_m: Floats) -> tuple[Floats, Floats, Bools]:
    """Position (n, 3) of the sensor, its roll, pitch, yaw (n, 3), and whether the foot is flat: then nothing moves at all.

    `height_m` (n,): of the floor below the foot, which moves in a lift; on stairs the foot is over the next step before it comes down.
    """
    k, share = strides.at(t_s)
    share = np.where(strides.moves[k], share, 0.0)
    effort = strides.effort(t_s, 1.3)
    yaw = strides.heading_rad - foot.toe_out_rad
    left = np.column_stack([-np.sin(strides.heading_rad), np.cos(strides.heading_rad)])
    prints = strides.trunk_m + foot.left_m * left
    gone = glide(share, 0.5 * (HEEL_OFF + TOE_OFF), 0.5 * (HEEL_STRIKE + FLAT))
    rpy = np.zeros((len(t_s), 3))
    rpy[:, 0] = foot.roll_rad * effort * _bump(share, TOE_OFF, HEEL_STRIKE)
    rpy[:, 1] = effort * (foot.toe_down_rad * _bump(share, HEEL_OFF, 0.55) - foot.toe_up_rad * _bump(share, 0.55, FLAT))
    rpy[:, 2] = yaw[k] + gone * (yaw[np.minimum(k + 1, len(yaw) - 1)] - yaw[k])
    place = np.zeros((len(t_s), 3))
    place[:, :2] = prints[k] + gone[:, None] * (prints[np.minimum(k + 1, len(prints) - 1)] - prints[k])
    place[:, 2] = -BALL[2] + effort * foot.lift_m * _bump(share, TOE_OFF - 0.05, HEEL_STRIKE + 0.02)
    place[:, 2] += effort * _knock(share, np.diff(strides.t_s)[k])
    rise = np.diff(strides.ground_m)[k]
    lifted = np.where(rise > 0.0, glide(share, HEEL_OFF + 0.05, 0.60), glide(share, 0.45, 0.5 * (HEEL_STRIKE + FLAT)))
    place[:, 2] += np.where(strides.moves[k], strides.ground_m[k] + lifted * rise, height_m)
    return place + _roll_over(share, rpy), rpy, (share <= HEEL_OFF) | (share >= FLAT)


def _roll_over(share: Floats, rpy: Floats) -> Floats:
    """How the sensor moves (n, 3) because the foot turns about the ball of the toes, then, from mid swing on, about the heel."""
    late = glide(share, TOE_OFF, HEEL_STRIKE)[:, None]
    lever = -(BALL + late * (HEEL - BALL))
    upright = np.column_stack([np.zeros((len(rpy), 2)), rpy[:, 2]])
    shift_m: Floats = np.einsum("nij,nj->ni", rotations(rpy) - rotations(upright), lever)
    return shift_m


def _knock(share: Floats, span_s: Floats) -> Floats:
    """The sole gives a little at heel strike, over before the foot is flat."""
    since_s = np.clip(share - HEEL_STRIKE, 0.0, None) * span_s
    shift_m: Floats = KNOCK_M * _bump(share, HEEL_STRIKE, FLAT) * np.sin(2.0 * np.pi * KNOCK_HZ * since_s)
    return shift_m


def _bump(share: Floats, start: float, end: float) -> Floats:
    """A smooth rise to 1 and back, with two vanishing derivatives at either end."""
    v = np.clip((share - start) / (end - start), 0.0, 1.0)
    bump: Floats = 64.0 * v**3 * (1.0 - v) ** 3
    return bump
