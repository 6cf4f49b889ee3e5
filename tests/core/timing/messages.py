# SPDX-License-Identifier: MIT
"""Messages of board and MTx told to a timeline."""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats
from echostep.ports.chunks import BOARD, MTX
from echostep.timing.timeline import Arrivals, Timeline

MS = 1_000_000
Message = tuple[str, int, int, int]  # port, ticks or counter, arrival (ns), kind


def times_of(timeline: Timeline, messages: list[Message]) -> Floats:
    """Times (s) of messages in order of arrival, as one portion; NaN for those dropped."""

    def of(port: str) -> Arrivals:
        rows = [(value, row, t_ns, kind) for row, (p, value, t_ns, kind) in enumerate(messages) if p == port]
        return Arrivals(*np.array(rows, np.int64).reshape(-1, 4).T.copy())

    times = timeline.times(of(BOARD), of(MTX))
    found = np.empty(len(messages))
    found[times.board_message_index], found[times.mtx_message_index] = times.board_s, times.mtx_s
    return found
