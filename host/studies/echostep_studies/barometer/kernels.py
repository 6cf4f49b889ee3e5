# SPDX-License-Identifier: MIT
"""The kernels of a barometer's record, called once.

In: nothing. Out: kernels in the cache. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep_studies.barometer.altitude import Altitude, Pressures
from echostep_studies.barometer.floor_filter import FloorFilter


def heights() -> None:
    """A minute on one floor."""
    samples = Pressures(np.arange(60.0), np.full(60, 101_325.0))
    Altitude().feed(samples)
    FloorFilter(np.array([0.0, 3.5])).smooth(samples)
