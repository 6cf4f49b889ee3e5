# SPDX-License-Identifier: MIT
"""From when to when each port has sent, for the last lines of a run.

In: portions, as they are tracked. Out: how long something was worn; a line for each port that fell silent before the end. Owns the first and the
newest arrival of each port.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from echostep.ports.arrival_clock import now_ns
from echostep.ports.chunks import BOARD, FOOT, MTX, Portion

NAMES = {BOARD: "the board", MTX: "the MTx", FOOT: "the foot board"}
SILENT_S = (
    3.0  # before the end of a run, from which a port has fallen silent: an order more than between two chunks; assumed
)


class Arrivals:
    """Notes the arrival times of a run. `urls`: the ports of a live run by name; its end is the host's clock, else the newest chunk is the end."""

    def __init__(self) -> None:
        self.urls: Mapping[str, str] = {}
        self._first_ns, self._newest_ns = math.inf, -math.inf
        self._newest: dict[str, int] = {}

    def note(self, portion: Portion) -> None:
        """Note the chunks of a portion."""
        if not len(portion.t_arrival_ns):
            return
        self._first_ns = min(self._first_ns, int(portion.t_arrival_ns[0]))
        self._newest_ns = max(self._newest_ns, int(portion.t_arrival_ns[-1]))
        for name in set(portion.ports) & NAMES.keys():
            last_ns = portion.t_arrival_ns[portion.port == portion.ports.index(name)]
            if len(last_ns):
                self._newest[name] = int(last_ns[-1])

    @property
    def worn_s(self) -> float:
        """From the first bytes to the end, s; 0 without bytes."""
        return max(self._end_ns - self._first_ns, 0.0) * 1e-9 if self._newest else 0.0

    @property
    def _end_ns(self) -> float:
        return now_ns() if self.urls else self._newest_ns

    def silent(self) -> list[str]:
        """A sentence for each port from which nothing came at the end, or at all."""
        lines = []
        for name, words in NAMES.items():
            if name not in self.urls and name not in self._newest:
                continue
            port = f" ({self.urls[name]})" if name in self.urls else ""
            if name not in self._newest:
                lines.append(f"nothing came from {words}{port} at all")
            elif (silent_s := (self._end_ns - self._newest[name]) * 1e-9) > SILENT_S:
                since_s = (self._newest[name] - self._first_ns) * 1e-9
                lines.append(f"nothing came from {words}{port} since {since_s:.0f} s, for the last {silent_s:.0f} s")
        return lines
