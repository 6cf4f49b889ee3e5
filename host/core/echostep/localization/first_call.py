# SPDX-License-Identifier: MIT
"""Calls of kernels that a filter needs later than at its first segment, so that they are compiled before.

In: nothing. Out: nothing. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep.localization.echoes.range_bias import RangeBias
from echostep.localization.particle_arrays import PingBatch
from echostep.localization.particles.kernels import systematic
from echostep.localization.settings import FilterSettings, echo_models
from echostep.walls.echo_sources import Walls


def call_kernels() -> None:
    """Resampling, and learning the rangers' common bias."""
    systematic(np.ones(2), 0.5, 2)
    zero = np.zeros(1)
    ping = PingBatch(zero, zero, zero, zero, np.zeros(1, np.int64), zero, zero, zero, zero, zero)
    model, _ = echo_models(FilterSettings())
    RangeBias(1.0).learn(ping, (zero, zero, zero), (0.0, 0.0, 0.0), Walls(np.empty((0, 4))), model)
