# SPDX-License-Identifier: MIT
"""Cells of a grid that are near a wall.

In: walls, in cells. Out: a mask. Owns nothing.
"""

from __future__ import annotations

from echostep.arrays import Bools, Floats
from echostep.jit import kernel


@kernel
def mark_near_walls(walls: Floats, reach: float, blocked: Bools) -> None:
    """Mark the cells whose centre is nearer than `reach` to a wall (n, 4); all lengths in cells."""
    rows, columns = blocked.shape
    for k in range(len(walls)):
        ax, ay, bx, by = walls[k]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        for r in range(max(int(min(ay, by) - reach - 1), 0), min(int(max(ay, by) + reach + 2), rows)):
            for c in range(max(int(min(ax, bx) - reach - 1), 0), min(int(max(ax, bx) + reach + 2), columns)):
                px, py = c + 0.5 - ax, r + 0.5 - ay
                s = min(max((px * dx + py * dy) / square, 0.0), 1.0) if square > 0.0 else 0.0
                if (px - s * dx) ** 2 + (py - s * dy) ** 2 < reach * reach:
                    blocked[r, c] = True
