# SPDX-License-Identifier: MIT
"""The two passes of the vertical filter over a whole record: forward, and backward smoothing.

In: rows of observations. Out: weight and height of each hypothesis at each sample. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from echostep.arrays import Floats
from echostep_studies.barometer import vertical_kernels as kernels
from echostep_studies.barometer import vertical_model as vertical

BLOCK = 256  # samples whose joint weights are in memory at once


def smooth(seen: Floats, heights_m: Floats, prior: Floats, *, free: bool) -> tuple[Floats, Floats]:
    """Height and its variance of each hypothesis by the samples so far (n, 15 k, 3), and its weight given all samples (n, 15 k).

    Hypotheses are over levels at `heights_m` (k,), or over level ground at any height (`free`); `prior` (k,) of the level at the start.
    """
    size = len(heights_m) * vertical.MODES
    filtered, before = np.zeros((len(seen), size, vertical.RESULTS)), list[vertical.State]()
    state = kernels.start(heights_m, prior, seen[0, vertical.CLAIMED], seen[0, vertical.NOISE])
    for block in _blocks(len(seen)):
        before.append((state[0].copy(), state[1].copy(), state[2].copy()))
        kernels.filter_samples(state, heights_m, free, seen[block], filtered[block], np.zeros((0, size, size)))
    smoothed = filtered[:, :, vertical.RESULT_WEIGHT].copy()
    for block, state_before in zip(reversed(list(_blocks(len(seen)))), reversed(before), strict=True):
        joint = np.zeros((block.stop - block.start, size, size))
        kernels.filter_samples(state_before, heights_m, free, seen[block], filtered[block], joint)
        earlier = kernels.smooth_backward(joint, smoothed[block.stop - 1])
        smoothed[block.start : block.stop - 1] = earlier[1:]
        if block.start:
            smoothed[block.start - 1] = earlier[0]
    return filtered, smoothed


def _blocks(n: int) -> Iterator[slice]:
    for first in range(0, n, BLOCK):
        yield slice(first, min(first + BLOCK, n))
