# SPDX-License-Identifier: MIT
"""The offer to undo the newest check-in.

In: states of the tracker. Out: `UndoOffer`: plain data. Owns when the offer ends: by the host's clock, since people need as long in a demo that runs
faster.
"""

from __future__ import annotations

from dataclasses import dataclass

from echostep.particles.limits import BELIEVED, PROBABLE
from echostep.tracker.state import TrackerState

UNDO_NS = 10_000_000_000  # the page offers for this long to undo a check-in, and again once echoes contradict it


@dataclass(frozen=True, slots=True)
class UndoOffer:
    """Check-in `undo` can be taken back for `left_s`. `contradicted`: the echoes since then do not fit the plan. The names are keys of the JSON."""

    undo: int
    left_s: float
    contradicted: bool


def echoes_fit(state: TrackerState) -> bool:
    """Whether the plan explains the last echoes at the estimate."""
    return state.right > BELIEVED


class UndoClock:
    """Decides how long the undoing of the newest check-in is offered."""

    def __init__(self) -> None:
        self._number: int | None = None
        self._until_ns = 0
        self._contradicted = False

    def offer(self, state: TrackerState, now_ns: int) -> UndoOffer | None:
        """The offer after a state of the tracker; echoes that contradict the check-in prolong it once."""
        if state.undoable != self._number:
            self._number, self._until_ns, self._contradicted = state.undoable, now_ns + UNDO_NS, False
        if self._number is None:
            return None
        contradicted = state.right < PROBABLE
        if contradicted and not self._contradicted:
            self._until_ns, self._contradicted = now_ns + UNDO_NS, True
        left_s = (self._until_ns - now_ns) * 1e-9
        return UndoOffer(self._number, left_s, contradicted) if left_s > 0.0 else None
