# SPDX-License-Identifier: MIT
"""Gyros on a leg: peaks that were clipped, reconstructed; the axis of walking in the frame of three axes at any mounting.

In: angular rates of one sensor of a leg that walks. Out: `Mounting`: a unit vector, how well it is defined. Owns the frequencies.

The axis is the first principal axis of the rates at the frequency of strides [de Vries 2010, functional calibration], at which a leg swings by 20 to
30 degrees either way and turns about itself by 5. Slower rates are turns of the whole body. Faster ones come from soft tissue, which at each heel
strike turns the sensor about the leg: they are as large as the swing, on a thigh at 2 m/s already at twice the frequency of strides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.legs.clipping import ClippingRepair

GRID_HZ = 50.0  # of the rates: far above BAND_HZ
BAND_HZ = (0.4, 1.4)  # of strides: from a slow walk (1.6 s a stride, 0.6 Hz) to a run, with a margin below; assumed
FEWEST_S = 1.5  # of samples: more than a stride
# Least ratio of the first to the second principal rate: below it another axis swings as far
CLEAR_RATIO = 1.3


@dataclass(frozen=True, slots=True)
class Mounting:
    """`axis` (3,): unit vector; its sign is arbitrary. `ratio`: rms rate about it over the rms rate about the next principal axis."""

    axis: Floats
    ratio: float

    @property
    def clear(self) -> bool:
        """Whether one axis dominates, as in a walk."""
        return self.ratio > CLEAR_RATIO


def walking_axis(t_s: Floats, rates: Floats) -> Mounting:
    """The axis of walking of one sensor, from times (n,) and rates (n, 3) in rad/s."""
    if len(t_s) < 2 or t_s[-1] - t_s[0] < FEWEST_S:
        return Mounting(np.eye(3)[int(np.argmax(rates.std(axis=0)))] if len(rates) else np.eye(3)[0], 1.0)
    grid = np.arange(t_s[0], t_s[-1], 1.0 / GRID_HZ)
    spectrum = np.fft.rfft([np.interp(grid, t_s, column) for column in rates.T])
    hz = np.fft.rfftfreq(len(grid), 1.0 / GRID_HZ)
    band = spectrum[:, (hz >= BAND_HZ[0]) & (hz <= BAND_HZ[1])]
    powers, axes = np.linalg.eigh((band @ band.conj().T).real)
    axis = axes[:, -1]
    ratio = float(np.sqrt(powers[-1] / max(powers[-2], 1e-12)))
    return Mounting(axis * np.sign(axis[int(np.argmax(np.abs(axis)))]), ratio)


SLOWEST_LIMIT_RAD_S = 2.0  # no gyro on a leg has a smaller range
SAME_PAIRS = 3  # equal neighbours at an extreme, which a sensor within its range does not show


def find_clipping_limits(rates: Floats) -> tuple[Floats, Floats]:
    """Lower and upper limits (k,) of sensors with rates (n, k), by equal neighbouring readings at their extremes; infinite where none are found."""
    low, high = np.full(rates.shape[1], -np.inf), np.full(rates.shape[1], np.inf)
    for k, column in enumerate(rates.T):
        for limits, extreme in ((low, float(column.min())), (high, float(column.max()))):
            cut = column == extreme
            if abs(extreme) > SLOWEST_LIMIT_RAD_S and (cut[1:] & cut[:-1]).sum() >= SAME_PAIRS:
                limits[k] = extreme
    return low, high


def repair_clipping(t_s: Floats, rates: Floats) -> Floats:
    """The rates (n, k) of a whole record, with peaks reconstructed at the limits found in it."""
    repair = ClippingRepair(*find_clipping_limits(rates))
    _, first = repair.feed(t_s, rates)
    _, rest = repair.finish()
    return np.vstack([first, rest])
