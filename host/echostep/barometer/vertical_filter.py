"""The state of `vertical.py`'s filter and its two ways through samples: forward as they come, and back from the end of a record.

In: rows for the kernel. Out: each hypothesis' weight and height at each sample. Owns the state.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from echostep.arrays import Floats
from echostep.barometer import vertical_kernels as vertical

BLOCK = 256  # samples whose transitions are in memory at once


class Hypotheses:
    """Hypotheses over storeys (k,), or over one level that is anywhere (`free`); `prior` (k,) of where he stands at first."""

    def __init__(self, heights_m: Floats, prior: Floats, *, free: bool) -> None:
        self._heights_m, self._prior, self._free = heights_m, prior, free
        self._state: tuple[Floats, Floats, Floats] | None = None

    def follow(self, seen: Floats) -> Floats:
        """(n, 15 k, 5): weight by what was known at each sample, h, v, d and the variance of h."""
        return self._follow(seen, joint=False)[0]

    def smooth(self, seen: Floats) -> tuple[Floats, Floats]:
        """As `follow`, and the weights (n, 15 k) by all samples of the record; nothing can follow on it."""
        found = np.zeros((len(seen), len(self._heights_m) * vertical.MODES, 5))
        states = []
        for block in _blocks(len(seen)):
            states.append(None if self._state is None else tuple(part.copy() for part in self._state))
            found[block], _ = self._follow(seen[block], joint=False)
        smooth = found[:, :, 0].copy()
        for block, state in zip(reversed(list(_blocks(len(seen)))), reversed(states), strict=True):
            self._state = state  # type: ignore[assignment]
            _, joint = self._follow(seen[block], joint=True)
            before = vertical.backward(joint, smooth[block.stop - 1])
            smooth[block.start : block.stop - 1] = before[1:]
            if block.start:
                smooth[block.start - 1] = before[0]
        return found, smooth

    def _follow(self, seen: Floats, *, joint: bool) -> tuple[Floats, Floats]:
        size = len(self._heights_m) * vertical.MODES
        found, pairs = np.zeros((len(seen), size, 5)), np.zeros((len(seen) if joint else 0, size, size))
        if self._state is None and len(seen):
            first = seen[0]
            self._state = vertical.start(self._heights_m, self._prior, first[vertical.CLAIMED], first[vertical.NOISE])
        if self._state is not None:
            vertical.follow(self._state, self._heights_m, self._free, seen, found, pairs)
        return found, pairs


def _blocks(n: int) -> Iterator[slice]:
    for first in range(0, n, BLOCK):
        yield slice(first, min(first + BLOCK, n))
