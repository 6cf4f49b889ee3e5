# SPDX-License-Identifier: MIT
"""Arrays that the kernels of the filter share: particles, a move, the pings on it.

In: nothing. Out: named tuples of arrays, as compiled kernels take them. Owns nothing.
"""

from __future__ import annotations

from typing import NamedTuple

from echostep.arrays import Floats, Ints


class ParticleArrays(NamedTuple):
    """n particles, each array (n,): place on the sheet (m), rotation walk -> map (rad), true length / measured length, log-weight."""

    x_m: Floats
    y_m: Floats
    turn_rad: Floats
    scale: Floats
    log_weight: Floats


class DrawnPoses(NamedTuple):
    """Poses (n,) on the sheet: places (m), rotations walk -> map (rad), heights and offsets of the height by pressure (m)."""

    x_m: Floats
    y_m: Floats
    turn_rad: Floats
    z_m: Floats
    lag_m: Floats


class Move(NamedTuple):
    """A piece of the path in the walk frame, its bend [PathSegment], and standard deviations: per axis, of the rotation, of the scale."""

    dx_m: float
    dy_m: float
    sd_m: float
    turn_sd_rad: float
    scale_sd: float = 0.0
    bend_x_m: float = 0.0
    bend_y_m: float = 0.0


class PingBatch(NamedTuple):
    """k pings on a move: share of the move at the trigger (ascending), axis of the ranger in the walk frame, range (0: none), power.

    `power`: share of independent information in the ping, the power of its densities. `ranger`: 0 left, 1 right. `travel_m`: length of
    the path since this ranger's previous ping. `stray`: probability of a second reflection where nothing answers. `missed`: odds that a silent
    ping missed its echo, 0 for an echo, and `alike`: density of a range that is like the one before, `unplanned`: density without any plan, to
    the power (all four: `echoes.unplanned`).
    """

    share: Floats
    axis_rad: Floats
    range_m: Floats
    power: Floats
    ranger: Ints
    travel_m: Floats
    stray: Floats
    missed: Floats
    alike: Floats
    unplanned: Floats
