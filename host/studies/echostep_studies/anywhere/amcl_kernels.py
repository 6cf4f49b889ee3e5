# SPDX-License-Identifier: MIT
"""The measurement update of the peer: p(echo | pose) of this project without a memory, for each particle.

In: particles, a ping, the walls. Out: the same particles, reweighted. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.jit import kernel
from echostep.localization import EchoModel, echo_density
from echostep.localization.particle_arrays import ParticleArrays
from echostep.walls.echo_sources import MOST_SOURCES, echo_sources
from echostep.walls.index import WallIndex


@kernel
def weight_by_ping(particles: ParticleArrays, axis: float, range_m: float, model: EchoModel, walls: WallIndex) -> float:
    """Multiply each weight by p(range | pose); returns the mean likelihood before. The greatest log-weight becomes 0."""
    x, y, turn, _, log_weight = particles
    distance_m, off_axis_rad, kind = np.empty(MOST_SOURCES), np.empty(MOST_SOURCES), np.empty(MOST_SOURCES)
    top, weight, evidence = -np.inf, 0.0, 0.0
    for i in range(len(x)):
        count = echo_sources(x[i], y[i], axis + turn[i], walls, distance_m, off_axis_rad, kind)
        likelihood = echo_density(range_m, count, distance_m, off_axis_rad, kind, model)
        w = math.exp(log_weight[i])
        weight += w
        evidence += w * likelihood
        log_weight[i] += math.log(likelihood)
        top = max(top, log_weight[i])
    for i in range(len(x)):
        log_weight[i] -= top
    return evidence / weight
