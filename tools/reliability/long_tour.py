# SPDX-License-Identifier: MIT
"""A working day's walk for the twin and the MTx: a round through the demo building with pauses, again and again, without a seam.

In: a plan, a seed, a board. Out: the chunks of both ports in order of arrival, as long as they are asked for. Owns the stimulus of one round.

A round begins and ends while the wearer stands at the same place with the same heading. It is as long as a whole number of samples of the MTx,
so samples, counter and SyncOut edges go on evenly from one round to the next. The stimulus repeats; the firmware's own timing does not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Protocol

import numpy as np

from echostep.arrays import Floats
from echostep.plan.model import Plan
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.xsens import MTDATA, MtSample, MtxReader, encode_frame, pack_mtdata
from echostep_app.simulation.devices.board import Board
from echostep_app.simulation.devices.mtx import FIRST_S, MtxModel
from echostep_app.simulation.people.walker import Person, Waypoint
from echostep_app.simulation.scenario import BLOCK_MS, START_NS, USB_LATENCY_NS, Scenario

MODEL = MtxModel(drift_ppm=50.0)
SAMPLES, SPAN_MS = 2000, 20_001  # so many samples of MODEL's crystal are a whole number of milliseconds
STAND_S = 25.0  # at both ends of a round: longer than SPAN_MS, so that its seam can be chosen
CUT_MS = 1000  # of the first standing


def _once(room_s: float) -> tuple[Waypoint, ...]:
    """The demo's way from the corridor's middle and back there, so many seconds in each of its two rooms."""
    return (
        (16.0, 7.5), (24.0, 7.5), (24.0, 2.0), (17.6, 2.0), (17.6, 4.4, room_s), (17.6, 2.0), (2.0, 2.0), (2.0, 7.5),
        (9.5, 7.5), (9.5, 10.8, room_s), (9.5, 7.5), (16.0, 7.5),
    )  # fmt: skip


ROUND = _once(2.0) + _once(60.0)[1:] + _once(5.0)[1:]


class TracedBoard(Board, Protocol):
    """A board in a process, with the traces of its buses."""

    trace: list[tuple[int, str]]

    @property
    def pid(self) -> int:
        """Number of the process."""


class LongTour:
    """`chunks` gives the bytes of a walk without end; `t_s`: how far it is (s)."""

    def __init__(self, plan: Plan, seed: int, board: TracedBoard, way: Sequence[Waypoint] = ROUND) -> None:
        self.board, self.t_s = board, 0.0
        scenario = Scenario(plan, way, seed, board, Person(stand_s=STAND_S), MODEL)
        self.start = scenario.start
        spans = (len(scenario.walk.t_s) - 2 * CUT_MS) // SPAN_MS
        self._length_ms, self._sample_count = spans * SPAN_MS, spans * SAMPLES
        end = CUT_MS + self._length_ms
        assert end > len(scenario.walk.t_s) - round(STAND_S * 1e3), "the round ends before the wearer stands"
        self._rows = scenario.sensors.rows(CUT_MS, end)
        self._truth = scenario.truth[:, :3] - [1e-3 * CUT_MS, 0.0, 0.0]
        first = int(np.searchsorted(scenario.mtx.t_s, 1e-3 * CUT_MS))
        span = slice(first, first + self._sample_count)
        self._arrival_ns = START_NS + np.rint(1e9 * scenario.mtx.arrival_s[span]).astype(np.int64) - CUT_MS * 1_000_000
        self._samples: list[MtSample] = MtxReader().feed(b"".join(scenario.mtx.frames))[span]
        assert len(self._samples) == self._sample_count
        assert FIRST_S < 1e-3 * CUT_MS

    def true_m(self, t_s: Floats) -> Floats:
        """True positions (n, 2) of the trunk at times of the walk (n,)."""
        within_s = t_s % (1e-3 * self._length_ms)
        return np.column_stack([np.interp(within_s, self._truth[:, 0], self._truth[:, k]) for k in (1, 2)])

    def chunks(self) -> Iterator[Chunk]:
        """Chunks of both ports in order of arrival, those of a block as soon as the board has lived through it."""
        mtx, coming = self._mtx(), list[Chunk]()
        following = next(mtx)
        for start in self._blocks():
            rows = self._rows[start % self._length_ms :][:BLOCK_MS]
            coming += self._board(rows)
            now_ns = START_NS + (start + len(rows)) * 1_000_000
            self.t_s = (now_ns - START_NS) * 1e-9
            while following.t_arrival_ns <= now_ns:
                coming.append(following)
                following = next(mtx)
            coming.sort(key=attrgetter("t_arrival_ns"))
            while coming and coming[0].t_arrival_ns <= now_ns:
                yield coming.pop(0)

    def _blocks(self) -> Iterator[int]:
        """The first millisecond of each block; the last block of a round may be shorter."""
        begin = 0
        while True:
            yield from range(begin, begin + self._length_ms, BLOCK_MS)
            begin += self._length_ms

    def _board(self, rows: np.ndarray) -> list[Chunk]:
        """The board's bytes of these rows as a USB host gets them, those of one instant together."""
        gathered: dict[int, bytes] = {}
        for t_ns, part in self.board.advance(rows):
            arrival = START_NS + t_ns + USB_LATENCY_NS
            gathered[arrival] = gathered.get(arrival, b"") + part
        self.board.trace.clear()
        return [Chunk(BOARD, t_ns, part) for t_ns, part in gathered.items()]

    def _mtx(self) -> Iterator[Chunk]:
        """The MTx's frames, their counter going on from round to round."""
        counter, begin_ns = 0, 0
        while True:
            for t_ns, sample in zip(self._arrival_ns.tolist(), self._samples, strict=True):
                counted = sample._replace(counter=counter & 0xFFFF)
                yield Chunk(MTX, begin_ns + t_ns, encode_frame(MTDATA, pack_mtdata(counted)))
                counter += 1
            begin_ns += self._length_ms * 1_000_000
