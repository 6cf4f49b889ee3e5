# SPDX-License-Identifier: MIT
"""The plan of a drawing for others: put by the thread that draws, taken by the run that publishes it.

In: the bytes of plan.json, each newer one in place of the one before. Out: the newest, once. Owns it; neither side waits.
"""

from __future__ import annotations

import threading

from echostep.plan.model import Pose


class SharedDrawing:
    """`start`: pose at which the walk begins in the plan; `name`: of the plan; `most_bytes`: a longer plan is not kept, and counted in `too_long`."""

    def __init__(self, start: Pose, name: str, most_bytes: int) -> None:
        self.start, self.name = start, name
        self.too_long = 0
        self._most_bytes = most_bytes
        self._lock = threading.Lock()
        self._newest: bytes | None = None

    def put(self, plan: bytes) -> None:
        """A newer plan; empty: nothing is drawn yet."""
        with self._lock:
            if len(plan) > self._most_bytes:
                self.too_long += 1
            elif plan:
                self._newest = plan

    def take(self) -> bytes | None:
        """The newest plan, if it was not taken yet."""
        with self._lock:
            newest, self._newest = self._newest, None
            return newest
