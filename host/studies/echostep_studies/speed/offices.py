# SPDX-License-Identifier: MIT
"""Blocks of offices of any size, and clouds of poses in them.

In: numbers of walls and of poses. Out: walls (n, 4), poses. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats


def offices(count: int) -> Floats:
    """About `count` walls (n, 4): corridors 2.5 m wide, rooms of 4 m x 5 m and doors of 0.9 m on both sides, stacked to a block about square."""
    pairs = max(count // 8, 1)
    floors = max(round(math.sqrt(pairs * 4.0 / 12.5)), 1)
    x, y = np.meshgrid(4.0 * np.arange(math.ceil(pairs / floors)), 12.5 * np.arange(floors))
    origin = np.stack([x.ravel(), y.ravel(), x.ravel(), y.ravel()], -1)
    room = []
    for back, front in ((0.0, 5.0), (12.5, 7.5)):
        room += [[0, back, 4, back], [0, back, 0, front], [0, front, 1.5, front], [2.4, front, 4, front]]
    return (origin[:, None] + np.array(room, dtype=np.float64)).reshape(-1, 4)


def cloud(walls: Floats, count: int, seed: int = 1) -> tuple[Floats, Floats, Floats]:
    """A cloud of x, y, heading in the corridor in the middle of the walls: 2 m along, 1 m across, 8 degrees."""
    rng = np.random.default_rng(seed)
    x = 4.0 * round(walls[:, ::2].mean() / 4.0) + 2.0 * rng.standard_normal(count)
    y = 12.5 * math.floor(walls[:, 1::2].mean() / 12.5 - 0.25) + 6.25 + 1.0 * rng.standard_normal(count)
    return x, y, math.radians(8.0) * rng.standard_normal(count)
