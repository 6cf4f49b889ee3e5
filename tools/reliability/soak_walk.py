# SPDX-License-Identifier: MIT
"""A walk without end for the twin and the MTx: a round through the demo building with pauses, again and again, without a seam.

In: a plan, a seed, a board. Out: the chunks of both ports in order of arrival, as long as they are asked for. Owns the stimulus of one round.

A round begins and ends while the wearer stands at the same place with the same heading. It is as long as a whole number of samples of the MTx,
so samples, counter and SyncOut edges go on evenly from one round to the next. The stimulus repeats; the firmware's own timing does not.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Sequence
from itertools import count
from operator import attrgetter

import numpy as np

from echostep.plan import Plan
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep.xsens import MTDATA, MtxReader, encode_frame, pack_mtdata
from echostep_simulation.devices.board import Board
from echostep_simulation.devices.mtx import MtxModel
from echostep_simulation.devices.serial_delivery import usb_chunks
from echostep_simulation.people.walker import Person, Waypoint
from echostep_simulation.scenario import BLOCK_MS, START_NS, Scenario

MODEL = MtxModel(drift_ppm=50.0)
SAMPLES, SPAN_MS = 2000, 20_001  # samples of MODEL's crystal that take a whole number of milliseconds
STAND_S = 25.0  # at both ends of a round: longer than SPAN_MS, so that its seam can be chosen
CUT_MS = 1000  # of the first standing


def _once(room_s: float) -> tuple[Waypoint, ...]:
    """The demo's way from the corridor's middle and back there, `room_s` seconds in each of its two rooms."""
    return (
        (16.0, 7.5), (24.0, 7.5), (24.0, 2.0), (17.6, 2.0), (17.6, 4.4, room_s), (17.6, 2.0), (2.0, 2.0), (2.0, 7.5),
        (9.5, 7.5), (9.5, 10.8, room_s), (9.5, 7.5), (16.0, 7.5),
    )  # fmt: skip


ROUND = _once(2.0) + _once(60.0)[1:] + _once(5.0)[1:]


class EndlessWalk:
    """`chunks` gives the bytes of a walk without end; `t_s`: how far it is (s). A round has `length_ms`, and a `truth` (n, 3): t_s, x, y."""

    def __init__(self, plan: Plan, seed: int, board: Board, way: Sequence[Waypoint] = ROUND) -> None:
        self.board, self.t_s = board, 0.0
        scenario = Scenario(plan, way, seed, board, Person(stand_s=STAND_S), MODEL)
        self.start, self.truth = scenario.start, scenario.truth[:, :3] - [1e-3 * CUT_MS, 0.0, 0.0]
        spans = (len(scenario.walk.t_s) - 2 * CUT_MS) // SPAN_MS
        self.length_ms = spans * SPAN_MS
        self.rows = scenario.sensors.rows(CUT_MS, CUT_MS + self.length_ms)
        first = int(np.searchsorted(scenario.mtx.t_s, 1e-3 * CUT_MS))
        span = slice(first, first + spans * SAMPLES)
        self.samples = MtxReader().feed(b"".join(scenario.mtx.frames))[span]
        self._arrival_ns = START_NS + np.rint(1e9 * scenario.mtx.arrival_s[span]).astype(np.int64) - CUT_MS * 1_000_000

    def chunks(self) -> Iterator[Chunk]:
        """Chunks of both ports in order of arrival."""
        return heapq.merge(self._board_chunks(), self.mtx_chunks(), key=attrgetter("t_arrival_ns"))

    def _board_chunks(self) -> Iterator[Chunk]:
        """The board's bytes; the last block of a round may be shorter."""
        for begin_ms in count(0, self.length_ms):
            for start in range(0, self.length_ms, BLOCK_MS):
                rows = self.rows[start : start + BLOCK_MS]
                sent = self.board.advance(rows)
                self.t_s = 1e-3 * (begin_ms + start + len(rows))
                yield from usb_chunks(BOARD, sent, START_NS)

    def mtx_chunks(self) -> Iterator[Chunk]:
        """The MTx's frames, their counter going on from round to round."""
        counter = count()
        for begin_ns in count(0, self.length_ms * 1_000_000):
            for t_ns, sample in zip(self._arrival_ns.tolist(), self.samples, strict=True):
                counted = sample._replace(counter=next(counter) & 0xFFFF)
                yield Chunk(MTX, begin_ns + t_ns, encode_frame(MTDATA, pack_mtdata(counted)))
