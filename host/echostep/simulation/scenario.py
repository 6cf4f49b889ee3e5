"""A whole simulated run: somebody walks through a building, wearing a board and an MTx.

In: a plan, waypoints, a seed, a board. Out: the chunks of both ports in order of arrival, and the truth. Owns the board.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from echostep.plan import Plan, Pose
from echostep.simulation.board import Board
from echostep.simulation.mtx import MtxModel, stream
from echostep.simulation.stimulus import BoardSensors
from echostep.simulation.walker import Person, walk
from echostep.sources import BOARD, MTX, Chunk

BLOCK_MS = 50
USB_LATENCY_NS = 1_000_000
START_NS = 1_000_000_000  # the host's clock when the board is switched on
DEMO_WAYPOINTS = (
    (2.0, 7.5), (9.5, 7.5), (9.5, 10.8), (9.5, 7.5), (24.0, 7.5), (24.0, 2.0), (17.6, 2.0), (17.6, 4.4), (17.6, 2.0),
    (2.0, 2.0), (2.0, 7.5), (6.0, 7.5),
)  # fmt: skip


class Scenario:
    """One walk; equal arguments give equal chunks."""

    def __init__(
        self, plan: Plan, waypoints: Sequence[tuple[float, float]], seed: int, board: Board,
        person: Person | None = None, model: MtxModel | None = None,
    ) -> None:  # fmt: skip
        streams = [np.random.default_rng([seed, k]) for k in range(3, 6)]
        self.walk = walk(waypoints, person or Person(), streams[0])
        self.mtx = stream(self.walk, model or MtxModel(), streams[1])
        self.sensors = BoardSensors(self.walk, plan.levels[0].walls, self.mtx.t_s, streams[2])
        self._board = board
        x, y = self.walk.trunk_m[0].tolist()
        self.fraction = 0.0  # of the walk that is over
        self.start = Pose(x, y, float(self.walk.heading_rad[0]))

    def chunks(self) -> Iterator[Chunk]:
        """Chunks of both ports in order of arrival."""
        mtx = self._mtx_chunks()
        waiting = next(mtx, None)
        for chunk in self._board_chunks():
            while waiting is not None and waiting.t_arrival_ns <= chunk.t_arrival_ns:
                yield waiting
                waiting = next(mtx, None)
            yield chunk
        if waiting is not None:
            yield waiting
            yield from mtx

    def write_truth(self, path: Path, begin_s: float = 0.0) -> None:
        """Where the trunk was, 50 times a second, as CSV; `begin_s`: board time at which the walk begins."""
        w = self.walk
        table = np.column_stack([begin_s + w.t_s, w.trunk_m, w.heading_rad])[::20]
        np.savetxt(path, table, delimiter=",", header="t_s,x,y,heading_rad", comments="", fmt="%.6f")

    def close(self) -> None:
        """Switch the board off."""
        self._board.close()

    def _board_chunks(self) -> Iterator[Chunk]:
        """The board's bytes as a USB host gets them, a millisecond's worth at a time."""
        for start in range(0, len(self.walk.t_s), BLOCK_MS):
            self.fraction = start / len(self.walk.t_s)
            sent = self._board.advance(self.sensors.rows(start, start + BLOCK_MS))
            gathered: dict[int, bytes] = {}
            for t_ns, part in sent:
                arrival = START_NS + t_ns + USB_LATENCY_NS
                gathered[arrival] = gathered.get(arrival, b"") + part
            for t_ns in sorted(gathered):
                yield Chunk(BOARD, t_ns, gathered[t_ns])

    def _mtx_chunks(self) -> Iterator[Chunk]:
        arrivals = START_NS + np.rint(self.mtx.arrival_s * 1e9).astype(np.int64)
        for t_ns, frame in zip(arrivals.tolist(), self.mtx.frames, strict=True):
            yield Chunk(MTX, t_ns, frame)


def demo_scenario(plan: Plan, seed: int, board: Board) -> Scenario:
    """A minute and a half through the corridors and two rooms of the demo plan."""
    return Scenario(plan, DEMO_WAYPOINTS, seed, board)
