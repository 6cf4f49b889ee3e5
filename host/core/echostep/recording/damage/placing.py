# SPDX-License-Identifier: MIT
"""Which messages of a damaged recording are in their original place: blocks of a disk may be duplicated or displaced.

In: the sequence numbers of messages in the order of the file; the recorder counts all its messages. Out: which of them to use. Owns the number of the
newest message in its place, and the count of the others.

The longest increasing subsequence is in its place [Schensted 1961]: of two exchanged blocks both are dropped, and nothing between
them; of a block written twice, the second copy. A single number that does not fit between its neighbours is a damaged number: its message
is used.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.jit import kernel


class Placement:
    """`misplaced` counts the messages that are not in their place."""

    def __init__(self) -> None:
        self.misplaced = 0
        self._newest = -1.0

    def keep(self, sequence: Ints, ahead: Ints) -> Bools:
        """Whether each of the messages with these numbers (n,) is in its place; `ahead` (m,): the numbers that follow, about as many."""
        numbers = _with_neighbours(np.concatenate((sequence, ahead)).astype(np.float64))
        kept = _longest_increasing(numbers, self._newest)[: len(sequence)]
        if kept.any():
            self._newest = float(numbers[: len(sequence)][kept].max())
        self.misplaced += int(len(kept) - kept.sum())
        return kept


@kernel
def _with_neighbours(number: Floats) -> Floats:
    """The numbers (n,); a number that is not between its neighbours is replaced by their middle."""
    repaired = number.copy()
    for k in range(1, len(number) - 1):
        before, after = number[k - 1], number[k + 1]
        if before < after and not before < number[k] < after:
            repaired[k] = (before + after) / 2.0
    return repaired


@kernel
def _longest_increasing(number: Floats, above: float) -> Bools:
    """Which of the numbers (n,) belong to their longest strictly increasing subsequence of numbers > `above`; by patience sorting."""
    count = 0
    last = np.empty(len(number), np.int64)  # by length: the smallest number that ends a subsequence of it
    before = np.full(len(number), -1, np.int64)
    for k in range(len(number)):
        if number[k] <= above:
            continue
        low, high = 0, count
        while low < high:
            middle = (low + high) // 2
            low, high = (middle + 1, high) if number[last[middle]] < number[k] else (low, middle)
        before[k] = last[low - 1] if low else -1
        last[low] = k
        count = max(count, low + 1)
    kept = np.zeros(len(number), np.bool_)
    k = last[count - 1] if count else -1
    while k >= 0:
        kept[k] = True
        k = before[k]
    return kept
