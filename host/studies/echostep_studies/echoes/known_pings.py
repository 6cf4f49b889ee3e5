# SPDX-License-Identifier: MIT
"""Pings at known poses, with the plan's echo sources before each.

In: walls, poses, ranges. Out: `KnownPings`; the log-density of each by an echo model. Owns nothing.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import EchoModel, after_source, echo_density, outlier_density, planned_density
from echostep.jit import kernel
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.index import EAR_REACH_M, WallIndex


class KnownPings(NamedTuple):
    """`range_m` (n,), 0: no echo. `listed` (n,) sources, nearest first: `distance_m`, `off_axis_rad`, `kind` (n, most)."""

    range_m: Floats
    listed: Ints
    distance_m: Floats
    off_axis_rad: Floats
    kind: Floats


def known_pings(walls: Walls, x_m: Floats, y_m: Floats, axis_rad: Floats, range_m: Floats) -> KnownPings:
    """Pings (n,) from these places along these axes; a range that is NaN or not positive is not an echo."""
    heard = np.where(range_m > 0.0, range_m, 0.0)
    x, y, axis = (np.ascontiguousarray(column, np.float64) for column in (x_m, y_m, axis_rad))
    return KnownPings(heard, *_sources(x, y, axis, walls.near(x, y)))


@kernel
def _sources(x: Floats, y: Floats, axis: Floats, index: WallIndex) -> tuple[Ints, Floats, Floats, Floats]:
    """Sources before each pose."""
    block, distances, angles, kinds = one_receiver()
    shape, count = (len(x), len(kinds)), np.zeros(len(x), np.int64)
    distance_m, off_axis_rad, kind = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    for i in range(len(x)):
        count[i] = echo_sources(x[i], y[i], axis[i], index, block)
        distance_m[i], off_axis_rad[i], kind[i] = distances, angles, kinds
    return count, distance_m, off_axis_rad, kind


@kernel
def log_densities(pings: KnownPings, m: EchoModel, limited: bool = True) -> Floats:
    """Log-density (n,) of the pings.

    `limited`: a range beyond the ranger's limits is an echo of a source, or an outlier uniform over the reach of any ranger: otherwise narrow
    limits would cost nothing.
    """
    found = np.empty(len(pings.range_m))
    for i in range(len(found)):
        range_m = pings.range_m[i]
        if limited and (range_m > m.maximum_m or 0.0 < range_m < m.minimum_m):
            (unheard, hit), rows = (1.0, 0.0), (pings.distance_m[i], pings.off_axis_rad[i], pings.kind[i])
            for k in range(pings.listed[i]):
                unheard, hit = after_source(range_m, unheard, hit, rows[0][k], rows[1][k], rows[2][k], m)
            density = planned_density(range_m, unheard, hit, m.stray, 0.0)
            density = (1.0 - m.outlier) * (1.0 - m.hidden) * density
            density += m.outlier * (1.0 - outlier_density(0.0, m)) / EAR_REACH_M
        else:
            density = echo_density(
                range_m, pings.listed[i], pings.distance_m[i], pings.off_axis_rad[i], pings.kind[i], m
            )
        found[i] = math.log(density)
    return found
