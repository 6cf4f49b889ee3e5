"""Thigh, calf and pelvis over the gait cycle.

In: phase (0 at heel strike of the right foot) and effort (length of the stride against a usual one). Out: rates and sway. Owns the curves.
The angles are the normal ones for natural walking, read every 5 % of the cycle to a degree [Perry 1992; Winter 2009], as a Fourier series.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

THIGH_DEG = (
    22,
    21,
    20,
    17,
    13,
    8,
    3,
    -3,
    -9,
    -14,
    -18,
    -19,
    -13,
    -3,
    9,
    18,
    23,
    25,
    25,
    23,
)  # against the vertical, forward positive
KNEE_DEG = (5, 10, 16, 18, 17, 14, 11, 8, 6, 7, 11, 21, 37, 52, 60, 58, 47, 30, 13, 4)  # flexion
TERMS = 5
SWAY_M = 0.02  # of the trunk toward the foot that stands [Perry 1992]
TWIST_RAD = math.radians(4.0)  # of the pelvis, forward with the leg that lands [Perry 1992]
MID_STANCE = 0.27  # phase


def leg_rates(phase: Floats, effort: Floats, rate_hz: float) -> tuple[Floats, Floats]:
    """Pitch rates (n,) of thigh and calf in rad/s, forward positive."""
    thigh = effort * _series(THIGH_DEG, phase)
    calf = thigh - effort * _series(KNEE_DEG, phase)
    return np.gradient(thigh) * rate_hz, np.gradient(calf) * rate_hz


def sway(phase: Floats, effort: Floats) -> tuple[Floats, Floats]:
    """How far the trunk is to the left of its line (m) and turned to the left (rad), (n,) each."""
    left_m: Floats = -SWAY_M * effort * np.cos(2.0 * np.pi * (phase - MID_STANCE))
    twist: Floats = TWIST_RAD * effort * np.cos(2.0 * np.pi * phase)
    return left_m, twist


def _series(degrees: tuple[int, ...], phase: Floats) -> Floats:
    """The curve in radians, by its first terms."""
    c = np.fft.rfft(np.radians(degrees)) / len(degrees)
    found = np.full(len(phase), c[0].real)
    for k in range(1, TERMS + 1):
        found += 2.0 * (c[k].real * np.cos(2.0 * np.pi * k * phase) - c[k].imag * np.sin(2.0 * np.pi * k * phase))
    return found
