# SPDX-License-Identifier: MIT
"""Thigh, calf and pelvis over the gait cycle.

In: phase (0 at heel strike of the right foot) and effort (length of the stride against a usual one). Out: angles and sway. Owns the curves.
The angles are the normal ones for natural walking, read every 5 % of the cycle to a degree [Perry 1992; Winter 2009], as a Fourier series.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats

# Of the thigh against the vertical, forward positive, and flexion of the knee
THIGH_DEG = (22, 21, 20, 17, 13, 8, 3, -3, -9, -14, -18, -19, -13, -3, 9, 18, 23, 25, 25, 23)
KNEE_DEG = (5, 10, 16, 18, 17, 14, 11, 8, 6, 7, 11, 21, 37, 52, 60, 58, 47, 30, 13, 4)
# Stairs, from a foot's contact on, against the vertical and flexion [Riener 2002; McFadyen and Winter 1988], read to a few degrees.
UP_THIGH_DEG = (50, 49, 46, 41, 35, 28, 21, 15, 9, 4, 0, -3, -2, 6, 20, 35, 47, 54, 56, 53)
UP_KNEE_DEG = (62, 61, 58, 52, 45, 38, 31, 25, 19, 14, 11, 12, 22, 42, 65, 83, 91, 88, 79, 69)
DOWN_THIGH_DEG = (12, 11, 9, 8, 7, 6, 6, 6, 7, 9, 13, 19, 25, 29, 31, 29, 25, 20, 15, 12)
DOWN_KNEE_DEG = (10, 17, 22, 23, 22, 21, 22, 25, 30, 38, 50, 65, 80, 88, 88, 78, 60, 38, 18, 9)
TERMS = 5
SWAY_M = 0.02  # of the trunk toward the foot that stands [Perry 1992]
TWIST_RAD = math.radians(4.0)  # of the pelvis, forward with the leg that lands [Perry 1992]
MID_STANCE = 0.27  # phase
HALF_PELVIS_M = 0.085  # from the middle to a hip joint [Winter 2009]
SURGE_M = 0.010  # of the trunk about its even way
VAULT, LOWEST = 0.63, 0.05
STRAIGHT = 0.998  # of the leg's length: knees do not lock in walking


@dataclass(frozen=True, slots=True)
class LegDimensions:
    """Hip to knee, and knee to ankle (m)."""

    thigh_m: float = 0.43
    shank_m: float = 0.43


def stair_angles(phase: Floats, up: bool) -> tuple[Floats, Floats]:
    """Thigh and calf against the vertical (n,) on stairs of 17 x 29 cm, forward positive."""
    thigh = series(UP_THIGH_DEG if up else DOWN_THIGH_DEG, phase)
    return thigh, thigh - series(UP_KNEE_DEG if up else DOWN_KNEE_DEG, phase)


def leg_angles(ankle_m: Floats, hip_m: Floats, leg: LegDimensions) -> tuple[Floats, Floats]:
    """Thigh and calf against the vertical (n,), forward positive: the one way in which a knee can join hip and ankle, (n, 2) each, forward and up.

    Where the ankle is out of reach the knee is straight.
    """
    to_ankle = ankle_m - hip_m
    reach = np.clip(
        np.hypot(*to_ankle.T), abs(leg.thigh_m - leg.shank_m) + 1e-6, STRAIGHT * (leg.thigh_m + leg.shank_m)
    )
    direction = np.arctan2(to_ankle[:, 0], -to_ankle[:, 1])
    at_hip = np.arccos((leg.thigh_m**2 + reach**2 - leg.shank_m**2) / (2.0 * leg.thigh_m * reach))
    at_ankle = np.arccos((leg.shank_m**2 + reach**2 - leg.thigh_m**2) / (2.0 * leg.shank_m * reach))
    return direction + at_hip, direction - at_ankle


def hip_path(phase: Floats, effort: Floats, stride_m: float, leg: LegDimensions) -> tuple[Floats, Floats]:
    """Offset of one hip ahead of the trunk's even motion and below its height at rest (m), (n,) each.

    Trunk: fastest and lowest while both feet carry [Perry 1992]. A vault over stiff legs would drop it by stride^2 / 32 legs; knees and ankles
    take a third.
    """
    drop_m = VAULT * (effort * stride_m) ** 2 / (32.0 * (leg.thigh_m + leg.shank_m))
    low = 0.5 * drop_m * (1.0 + np.cos(4.0 * np.pi * (phase - LOWEST)))
    surge = -SURGE_M * effort * np.cos(4.0 * np.pi * phase)
    turned: Floats = HALF_PELVIS_M * np.sin(TWIST_RAD * effort * np.cos(2.0 * np.pi * phase))
    return surge + turned, low


def sway(phase: Floats, effort: Floats) -> tuple[Floats, Floats]:
    """How far the trunk is to the left of its line (m) and turned to the left (rad), (n,) each."""
    left_m: Floats = -SWAY_M * effort * np.cos(2.0 * np.pi * (phase - MID_STANCE))
    twist: Floats = TWIST_RAD * effort * np.cos(2.0 * np.pi * phase)
    return left_m, twist


def series(degrees: tuple[int, ...], phase: Floats) -> Floats:
    """The curve in radians, by its first terms."""
    c = np.fft.rfft(np.radians(degrees)) / len(degrees)
    angles = np.full(len(phase), c[0].real)
    for k in range(1, TERMS + 1):
        angles += 2.0 * (c[k].real * np.cos(2.0 * np.pi * k * phase) - c[k].imag * np.sin(2.0 * np.pi * k * phase))
    return angles
