# SPDX-License-Identifier: MIT
"""What may befall a wearer: the foot's sensor falls off, he is carried, he stands on a trolley or in a lift, he only stands.

In: a simulated `Walk`, a time span. Out: the same walk with another foot and other legs; the trunk, and so belt and echoes, stay. Owns nothing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep_simulation.people.attitude import rotations
from echostep_simulation.people.rolling_foot import glide
from echostep_simulation.people.walker import Walk
from echostep_simulation.world.tower import STOREY_M

Span = tuple[float, float]  # s
BLEND_S = 1.0  # from standing to being carried, and back
# Held under the arms and by the thighs: the foot hangs before the trunk; bobbing of those who carry
HELD = np.array([0.4, -0.1, 0.9])
TILT_RAD = np.radians(70.0)
BOB_M, BOB_HZ = 0.02, 1.8
RIDE_S = 6.0  # a storey at 1.1 m/s at most


def fallen_off(walk: Walk, span_s: Span) -> Walk:
    """The foot's sensor lies where the foot stood last."""
    first = int(np.argmax(walk.flat & (walk.t_s >= span_s[0])))
    lies = np.arange(len(walk.t_s)) >= first
    return replace(
        walk,
        foot_m=np.where(lies[:, None], walk.foot_m[first], walk.foot_m),
        foot_rpy_rad=np.where(lies[:, None], walk.foot_rpy_rad[first], walk.foot_rpy_rad),
        flat=walk.flat | lies,
    )


def carried(walk: Walk, span_s: Span) -> Walk:
    """Others carry the wearer: the foot is off the floor, the legs hang."""
    bob = BOB_M * np.sin(2.0 * np.pi * BOB_HZ * walk.t_s)
    rpy = np.column_stack([np.zeros_like(walk.t_s), np.full_like(walk.t_s, -TILT_RAD), walk.heading_rad])
    return _moved(walk, span_s, HELD, rpy, bob)


def on_trolley(walk: Walk, span_s: Span) -> Walk:
    """The wearer stands on a trolley that is pushed."""
    at = int(np.searchsorted(walk.t_s, span_s[0]))
    east, north, up = walk.foot_m[at] - (*walk.trunk_m[at], 0.0)
    c, s = np.cos(walk.heading_rad[at]), np.sin(walk.heading_rad[at])
    offset = np.array([c * east + s * north, c * north - s * east, up])
    rpy = np.column_stack(
        [np.zeros((len(walk.t_s), 2)), walk.heading_rad + walk.foot_rpy_rad[at, 2] - walk.heading_rad[at]]
    )
    return _moved(walk, span_s, offset, rpy, np.zeros_like(walk.t_s))


def lifted(walk: Walk, span_s: Span) -> Walk:
    """A lift that the plan lacks takes the wearer up to an equal floor."""
    rise_m = STOREY_M * glide(walk.t_s - span_s[0], 0.0, RIDE_S)
    return replace(
        walk, height_m=walk.height_m + rise_m, foot_m=walk.foot_m + rise_m[:, None] * np.array([0.0, 0.0, 1.0])
    )


def _moved(walk: Walk, span_s: Span, offset: Floats, rpy: Floats, bob: Floats) -> Walk:
    """The foot at an offset from the trunk (forward, left, up), the legs at rest, for a while."""
    begin, end = span_s
    share = np.clip(np.minimum(walk.t_s - begin, end - walk.t_s) / BLEND_S, 0.0, 1.0)
    share = (share**3 * (10.0 - 15.0 * share + 6.0 * share**2))[:, None]
    upright = np.column_stack([np.zeros((len(walk.t_s), 2)), walk.heading_rad])
    there = np.column_stack([walk.trunk_m, bob]) + rotations(upright) @ offset
    rests = 1.0 - share[:, 0]
    return replace(
        walk, foot_m=(1.0 - share) * walk.foot_m + share * there, foot_rpy_rad=(1.0 - share) * walk.foot_rpy_rad + share * rpy,
        thigh_rad_s=rests * walk.thigh_rad_s, calf_rad_s=rests * walk.calf_rad_s, flat=walk.flat & (share[:, 0] == 0.0),
    )  # fmt: skip
