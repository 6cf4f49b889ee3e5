# SPDX-License-Identifier: MIT
"""A simulated run: a walk through a building with a board, and an MTx or a foot board.

In: a plan, waypoints, a seed, a board or two. Out: the chunks of both ports in order of arrival, and the truth. Owns the boards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.board.frames import encode
from echostep.board.messages import Configure
from echostep.board.reports import SUBSCRIBE
from echostep.plan import Plan, Pose
from echostep.ports.chunks import BOARD, MTX, Chunk
from echostep_simulation.devices.board import Board, PythonBoard
from echostep_simulation.devices.board_sensors import WornGyro
from echostep_simulation.devices.foot_board import FootBoardPort, foot_rng
from echostep_simulation.devices.kit_2026 import Kit2026Sensors
from echostep_simulation.devices.mtx import MtxModel, stream
from echostep_simulation.devices.serial_delivery import usb_chunks
from echostep_simulation.kits import Kit
from echostep_simulation.people.walker import Person, Walk, Waypoint, walk
from echostep_simulation.stimulus import TEMPERATURE_C, BoardSensors
from echostep_simulation.world.magnetic_field import MagneticField

BLOCK_MS = 50
START_NS = 1_000_000_000  # the host's clock when the board is switched on
TRUTH_MS = 20
DEMO_WAYPOINTS: tuple[Waypoint, ...] = (
    (2.0, 7.5), (9.5, 7.5), (9.5, 10.8, 2.0), (9.5, 7.5), (24.0, 7.5), (24.0, 2.0), (17.6, 2.0), (17.6, 4.4, 2.0),
    (17.6, 2.0), (2.0, 2.0), (2.0, 7.5), (16.0, 7.5),
)  # fmt: skip


class Scenario:
    """One walk; equal arguments give equal chunks."""

    def __init__(
        self, plan: Plan, waypoints: Sequence[Waypoint], seed: int, board: Board,
        person: Person | None = None, model: MtxModel | None = None, configure: Configure | None = None,
        kit: Kit = Kit.PAPERS, foot_board: Board | None = None, worn: WornGyro | None = None,
        celsius: float = TEMPERATURE_C, befalls: Callable[[Walk], Walk] = lambda walk: walk,
    ) -> None:  # fmt: skip
        """`configure` is sent to the board before it starts; `foot_board` is the one on the foot, instead of an MTx.

        `worn`: how the belt's gyro is worn, perfectly by default; of the papers' kit. `celsius`: of the air. `befalls`: what else moves the wearer.
        """
        streams = [np.random.default_rng([seed, k]) for k in range(3, 7)]
        magnetism = MagneticField(streams[3])
        self.walk = befalls(walk(waypoints, person or Person(), streams[0]))
        self.mtx = stream(self.walk, model or MtxModel(), streams[1], magnetism)
        kind = partial(Kit2026Sensors if kit is Kit.OF_2026 else partial(BoardSensors, worn=worn), celsius=celsius)
        self.sensors: BoardSensors | Kit2026Sensors = kind(self.walk, plan.levels, self.mtx.t_s, streams[2], magnetism)
        self._board = board
        self.foot = None if foot_board is None else FootBoardPort(self.walk, foot_rng(seed), foot_board)
        if kit is Kit.OF_2026:
            board.fault("kit=2026")
            board.send(encode(SUBSCRIBE, 0))
        self.fraction = 0.0  # of the walk that is over
        if configure is not None:
            board.send(encode(configure, 0))
        x, y = self.walk.trunk_m[0].tolist()
        begin_m = float(self.walk.height_m[0])
        level = min(range(len(plan.levels)), key=lambda k: abs(plan.levels[k].height_m - begin_m))
        self.start = Pose(x, y, float(self.walk.heading_rad[0]), level)

    @property
    def truth(self) -> Floats:
        """Where the trunk was, 50 times a second: (n, 5) t_s, x, y, heading_rad, height of the floor, map frame."""
        w = self.walk
        return np.column_stack([w.t_s, w.trunk_m, w.heading_rad, w.height_m])[::TRUTH_MS]

    def chunks(self) -> Iterator[Chunk]:
        """Chunks of both ports in order of arrival, a block's chunks as soon as the board has run through it."""
        mtx = self._mtx_chunks() if self.foot is None else iter(())
        coming: list[Chunk] = []
        following = next(mtx, None)
        for start in range(0, len(self.walk.t_s), BLOCK_MS):
            self.fraction = start / len(self.walk.t_s)
            coming += self._board_chunks(start, start + BLOCK_MS)
            if self.foot is not None:
                coming += self.foot.chunks(start, start + BLOCK_MS, START_NS)
            now_ns = START_NS + (start + BLOCK_MS) * 1_000_000
            while following is not None and following.t_arrival_ns <= now_ns:
                coming.append(following)
                following = next(mtx, None)
            coming.sort(key=attrgetter("t_arrival_ns"))
            while coming and coming[0].t_arrival_ns <= now_ns:
                yield coming.pop(0)
        late = [*coming, *([following] if following else []), *mtx]
        yield from sorted(late, key=attrgetter("t_arrival_ns"))

    def write_truth(self, path: Path, begin_s: float = 0.0) -> None:
        """The truth as CSV; `begin_s`: board time at which the walk begins."""
        table = self.truth + [begin_s, 0.0, 0.0, 0.0, 0.0]
        np.savetxt(path, table, delimiter=",", header="t_s,x,y,heading_rad,z", comments="", fmt="%.6f")

    def close(self) -> None:
        """Switch the boards off."""
        self._board.close()
        if self.foot is not None:
            self.foot.board.close()

    def _board_chunks(self, start: int, stop: int) -> list[Chunk]:
        """The board's bytes of these milliseconds."""
        ranging = self._board.may_range(stop - start) if isinstance(self._board, PythonBoard) else None
        return usb_chunks(BOARD, self._board.advance(self.sensors.rows(start, stop, ranging)), START_NS)

    def _mtx_chunks(self) -> Iterator[Chunk]:
        arrivals = START_NS + np.rint(self.mtx.portion_s * 1e9).astype(np.int64)
        for t_ns, part in zip(arrivals.tolist(), self.mtx.portions, strict=True):
            yield Chunk(MTX, t_ns, part)


def start_of(plan: Plan, waypoints: Sequence[Waypoint]) -> Pose:
    """Where a walk along these waypoints begins, and in which direction."""
    (x, y), (to_x, to_y) = waypoints[0][:2], waypoints[1][:2]
    begin_m = waypoints[0][3] if len(waypoints[0]) > 3 else 0.0
    level = min(range(len(plan.levels)), key=lambda k: abs(plan.levels[k].height_m - begin_m))
    return Pose(x, y, math.atan2(to_y - y, to_x - x), level)


def demo_scenario(plan: Plan, seed: int, board: Board) -> Scenario:
    """A minute and a half through the corridors and two rooms of the demo plan."""
    return Scenario(plan, DEMO_WAYPOINTS, seed, board)
