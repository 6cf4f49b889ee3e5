# SPDX-License-Identifier: MIT
"""The vertical filter's state, and its two passes: forward as samples come, and backward smoothing of a whole record.

In: rows of observations. Out: weight and height of each hypothesis at each sample. Owns the state.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from echostep.arrays import Floats
from echostep_studies.barometer import vertical_kernels as kernels
from echostep_studies.barometer import vertical_model as vertical

BLOCK = 256  # samples whose joint weights are in memory at once


class Hypotheses:
    """Hypotheses over levels at `heights_m` (k,), or over level ground at any height (`free`); `prior` (k,) of the level at the start."""

    def __init__(self, heights_m: Floats, prior: Floats, *, free: bool) -> None:
        self._heights_m, self._prior, self._free = heights_m, prior, free
        self._state: tuple[Floats, Floats, Floats] | None = None

    def filter(self, seen: Floats) -> Floats:
        """(n, 15 k, 5): weight given the samples so far, height, rate, weather and variance of the height at each sample."""
        return self._run(seen, joint=False)[0]

    def smooth(self, seen: Floats) -> tuple[Floats, Floats]:
        """As `filter`, and the weights (n, 15 k) given all samples of the record; the last call on these hypotheses."""
        filtered = np.zeros((len(seen), len(self._heights_m) * vertical.MODES, 5))
        states = []
        for block in _blocks(len(seen)):
            states.append(None if self._state is None else tuple(part.copy() for part in self._state))
            filtered[block], _ = self._run(seen[block], joint=False)
        smooth = filtered[:, :, vertical.RESULT_WEIGHT].copy()
        for block, state in zip(reversed(list(_blocks(len(seen)))), reversed(states), strict=True):
            self._state = state  # type: ignore[assignment]
            _, joint = self._run(seen[block], joint=True)
            before = kernels.smooth_backward(joint, smooth[block.stop - 1])
            smooth[block.start : block.stop - 1] = before[1:]
            if block.start:
                smooth[block.start - 1] = before[0]
        return filtered, smooth

    def _run(self, seen: Floats, *, joint: bool) -> tuple[Floats, Floats]:
        size = len(self._heights_m) * vertical.MODES
        states, pairs = np.zeros((len(seen), size, 5)), np.zeros((len(seen) if joint else 0, size, size))
        if self._state is None and len(seen):
            first = seen[0]
            self._state = kernels.start(self._heights_m, self._prior, first[vertical.CLAIMED], first[vertical.NOISE])
        if self._state is not None:
            kernels.filter_samples(self._state, self._heights_m, self._free, seen, states, pairs)
        return states, pairs


def _blocks(n: int) -> Iterator[slice]:
    for first in range(0, n, BLOCK):
        yield slice(first, min(first + BLOCK, n))
