# SPDX-License-Identifier: MIT
"""Recorded rates with their clipped peaks reconstructed.

In: the rates of a whole record. Out: the same without clipping. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.legs.clipping import ClippingRepair

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
