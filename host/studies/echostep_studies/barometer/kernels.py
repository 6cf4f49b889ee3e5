# SPDX-License-Identifier: MIT
"""The kernels of a barometer's record, called once.

In: nothing. Out: kernels in the cache. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep_studies.barometer.altitude import Pressures, heights_above_start
from echostep_studies.barometer.floor_filter import smooth_floors


def heights() -> None:
    """A minute on one floor."""
    samples = Pressures(np.arange(60.0), np.full(60, 101_325.0))
    heights_above_start(samples, 3.0)
    smooth_floors(samples, np.array([0.0, 3.5]), 3.0)
