# SPDX-License-Identifier: MIT
"""The axis about which a leg swings in walking, in the frame of a gyro of three axes that is strapped on anyhow.

In: angular rates of one sensor of a leg that walks. Out: `Mounting`: a unit vector, how well it is defined. Owns the frequencies.

The axis is the first principal axis of the rates near the frequency of strides [de Vries 2010, functional calibration]. Slower rates are
turns of the whole body, and faster ones come from soft tissue, which at each heel strike turns the sensor about the leg by more than the leg swings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats

GRID_HZ = 50.0  # ten times the highest frequency that is used
SLOW_S = 2.4  # running mean that is subtracted: twice the time of a usual stride
FAST_S = 0.2  # running mean: halves 3 Hz, the third harmonic of strides; removes impacts [soft tissue, 10 to 20 Hz: Wakeling 2003]
FEWEST_S = 3.0  # of samples: two strides
# Least ratio of the first to the second principal rate: below it another axis swings as far
CLEAR_RATIO = 1.3


@dataclass(frozen=True, slots=True)
class Mounting:
    """`axis` (3,): unit vector; its sign is arbitrary. `ratio`: rms rate about it over that about the next principal axis."""

    axis: Floats
    ratio: float

    @property
    def clear(self) -> bool:
        """Whether one axis stands out, as in a walk."""
        return self.ratio > CLEAR_RATIO


def walking_axis(t_s: Floats, rates: Floats) -> Mounting:
    """The axis of walking of one sensor, from times (n,) and rates (n, 3) in rad/s."""
    if len(t_s) < 2 or t_s[-1] - t_s[0] < FEWEST_S:
        return Mounting(np.eye(3)[int(np.argmax(rates.std(axis=0)))] if len(rates) else np.eye(3)[0], 1.0)
    grid = np.arange(t_s[0], t_s[-1], 1.0 / GRID_HZ)
    even = np.column_stack([np.interp(grid, t_s, column) for column in rates.T])
    band = _running_mean(even, FAST_S) - _running_mean(even, SLOW_S)
    powers, axes = np.linalg.eigh(band.T @ band / len(band))
    axis = axes[:, -1]
    ratio = float(np.sqrt(powers[-1] / max(powers[-2], 1e-12)))
    return Mounting(axis * np.sign(axis[int(np.argmax(np.abs(axis)))]), ratio)


def _running_mean(rates: Floats, span_s: float) -> Floats:
    """Running mean of rates (n, 3) on the grid, ends repeated."""
    half = round(0.5 * span_s * GRID_HZ)
    padded = np.pad(rates, ((half + 1, half), (0, 0)), mode="edge")
    total = np.cumsum(padded, axis=0)
    mean: Floats = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return mean
