# SPDX-License-Identifier: MIT
"""The two SRF02 of the Python board: their schedule and their echoes.

In: rows of one millisecond. Out: pings, with the time at which each is read. Owns the schedule, which is the firmware's (firmware/ranger.h).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.board.messages import Outcome, Ping, Ranger, Schedule, Sensors

START_US = 100_000
HALF_US = {Schedule.CONCURRENT: 33_000, Schedule.SEQUENTIAL: 70_000, Schedule.SIMULTANEOUS: 33_000}
JITTER_US = 4_096
RANGING_US = 61_000  # [SRF02 technical specification: up to 65 ms; measured about 61]
POLL_US = 1_000  # it is read later than that by up to this
FIRST_US, LAST_US = 875, 35_000  # 15 cm and 6 m, out and back
TICKS_US = 2


@dataclass(slots=True)
class _Ranger:
    slot_us: int = 0  # on the grid
    due_us: int = 0
    reads_us: int | None = None  # while it is ranging: when the result is fetched
    own_us: int = 0
    # When, and how long to the other ranger
    triggers: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=4))


class Rangers:
    """Both rangers on one grid, the right one half a period after the left one, or with it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._both = (_Ranger(), _Ranger())
        self.start(0, Schedule.CONCURRENT)

    def start(self, now_us: int, schedule: Schedule) -> None:
        """Lay the grid again; a ping under way is still read."""
        self._half_us = HALF_US[schedule]
        self._jitter_us = JITTER_US if schedule == Schedule.CONCURRENT else 0
        for index, ranger in enumerate(self._both):
            ranger.slot_us = now_us + START_US + (0 if schedule == Schedule.SIMULTANEOUS else index * self._half_us)
            ranger.due_us = ranger.slot_us + self._delay_us()

    def advance(self, start_us: int, rows: NDArray[Any], sensors: int) -> list[tuple[int, Ping]]:
        """Pings read during these rows, and when (us), in order."""
        end_us = start_us + 1000 * len(rows)
        pings: list[tuple[int, Ping]] = []
        while True:
            index = min((0, 1), key=self._next_us)
            now_us = max(self._next_us(index), start_us)
            if now_us >= end_us:
                return pings
            ranger = self._both[index]
            if ranger.reads_us is not None:
                pings.append((now_us, self._read(index)))
                ranger.reads_us = None
                self._next_slot(ranger, now_us)
            elif sensors & (Sensors.RANGER_LEFT, Sensors.RANGER_RIGHT)[index]:
                self._fire(index, now_us, rows[(now_us - start_us) // 1000])
            else:
                self._next_slot(ranger, now_us)

    def may_fire(self, start_us: int, count: int) -> NDArray[np.bool_]:
        """In which of the next `count` milliseconds a ranger may fire (count,): echoes of the others are never requested.

        A ranger that is ranging fires next in the slot after, at a moment that is drawn when it has been read.
        """
        if 1000 * count > RANGING_US:
            return np.ones(count, bool)  # a ranger may fire twice
        possible = np.zeros(count, bool)
        for ranger in self._both:
            due_us = ranger.due_us, ranger.due_us
            if ranger.reads_us is not None:
                slot_us = self._slot_after(ranger, ranger.reads_us)
                due_us = max(slot_us, ranger.reads_us), max(slot_us + self._jitter_us, ranger.reads_us)
            first, last = ((max(us, start_us) - start_us) // 1000 for us in due_us)
            possible[first : last + 1] = True
        return possible

    def _next_us(self, index: int) -> int:
        ranger = self._both[index]
        return ranger.due_us if ranger.reads_us is None else ranger.reads_us

    def _fire(self, index: int, now_us: int, row: Any) -> None:
        ranger = self._both[index]
        ranger.triggers.append((now_us, int(row["cross_us"][1 - index])))
        ranger.own_us = int(row["own_us"][index])
        ranger.reads_us = now_us + RANGING_US + int(self._rng.integers(POLL_US))

    def _read(self, index: int) -> Ping:
        """The earliest audible arrival: its own echo, or the other ranger's."""
        ranger = self._both[index]
        fired_us = ranger.triggers[-1][0]
        came = [ranger.own_us] if ranger.own_us else []
        came += [at - fired_us + cross for at, cross in self._both[1 - index].triggers if cross]
        echoes_us = [us for us in came if FIRST_US <= us <= LAST_US]
        outcome = Outcome.ECHO if echoes_us else Outcome.NO_ECHO
        return Ping((fired_us * TICKS_US) & 0xFFFFFFFF, Ranger(index), outcome, min(echoes_us, default=0))

    def _next_slot(self, ranger: _Ranger, now_us: int) -> None:
        ranger.slot_us = self._slot_after(ranger, now_us)
        ranger.due_us = ranger.slot_us + self._delay_us()

    def _slot_after(self, ranger: _Ranger, now_us: int) -> int:
        """A ranger that lags by more than half a period gives up slots; the grid stays."""
        period_us = 2 * self._half_us
        slot_us = ranger.slot_us + period_us
        return slot_us + period_us * max(0, (now_us - slot_us + self._half_us) // period_us)

    def _delay_us(self) -> int:
        return int(self._rng.integers(self._jitter_us)) if self._jitter_us else 0
