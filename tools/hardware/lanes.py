# SPDX-License-Identifier: MIT
"""Lanes for vertical wires in the channel between a board and a column of parts: the left-edge algorithm of channel routing.

In: for each net the heights at which it has ends, in pixels. Out: a lane number for each net, so that no two wires of one lane touch. Owns nothing.
"""

from __future__ import annotations

GAP = 24.0  # least distance of two wires in one lane, pixels


def lanes(ends: dict[str, list[float]]) -> dict[str, int]:
    """Lane of each net, counted from 0. [Hashimoto and Stevens 1971]"""
    free_from: list[float] = []  # height from which each lane is free
    lane_of: dict[str, int] = {}
    for net in sorted(ends, key=lambda net: (min(ends[net]), net)):
        top, bottom = min(ends[net]), max(ends[net])
        lane = next((n for n, free in enumerate(free_from) if free <= top), len(free_from))
        if lane == len(free_from):
            free_from.append(0.0)
        free_from[lane] = bottom + GAP
        lane_of[net] = lane
    return lane_of
