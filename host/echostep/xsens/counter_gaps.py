# SPDX-License-Identifier: MIT
"""Gaps in the counters of one device.

In: counters of 16 bits in order of arrival. Out: how many never came. Owns the last counter.
"""

from __future__ import annotations

from dataclasses import dataclass, field

SHARED_GAP = 500  # counters; a longer step is called a jump, not lost messages; by reason


@dataclass(slots=True)
class CounterGaps:
    """Counters of one device: those that never came, and steps that are no gap (a restart, or a long silence)."""

    lost: int = 0
    jumps: int = 0
    _last: int = -1
    _others: set[int] = field(default_factory=set)

    def note(self, counter: int, *, sample: bool) -> None:
        """Count the step from the last sample. Other messages share the counter or have their own: they only explain a gap."""
        if not sample:
            if len(self._others) <= SHARED_GAP:
                self._others.add(counter)
            return
        step = (counter - self._last) & 0xFFFF
        if self._last >= 0 and step > SHARED_GAP:
            self.jumps += 1
        elif self._last >= 0 and step > 1:
            self.lost += sum((self._last + k) & 0xFFFF not in self._others for k in range(1, step))
        self._last = counter
        self._others.clear()
