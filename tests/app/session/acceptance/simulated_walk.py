# SPDX-License-Identifier: MIT
"""A recording of a simulated acceptance walk with the Python board, made faster than it is walked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path

from board_runs import ELF, TWIN
from echostep.board.frames import encode
from echostep.board.messages import Identify
from echostep.ports.chunks import POINT, Chunk
from echostep.walk.recorded import SIMULATED
from echostep_app.ports.tap import Tap
from echostep_app.recording.recorder import Recorder
from echostep_app.session.acceptance.protocol import Protocol
from echostep_app.session.acceptance.survey import corridor
from echostep_app.session.metadata import run_metadata
from echostep_simulation.devices.board import BoardProcess, PythonBoard
from echostep_simulation.scenario import START_NS, Scenario
from twin.acceptance_walk import WEARER, times_s, waypoints

CORRIDOR, ROUNDS = "8x2", 2


@cache
def walk(lengths: str = CORRIDOR, *, twin: bool = False) -> tuple[Protocol, tuple[Chunk, ...], tuple[Chunk, ...]]:
    """The protocol of a corridor, the chunks of both ports, the taps when the trunk is at the points. `twin`: of the real firmware."""
    protocol = corridor(lengths)
    plan, visits = protocol.plan(), protocol.visits(ROUNDS)
    board = BoardProcess([str(TWIN), "--elf", str(ELF)]) if twin else PythonBoard(3)
    if twin:
        board.send(encode(Identify(), 0))
    scenario = Scenario(plan, waypoints(protocol.points, visits, plan), 3, board, WEARER)
    taps = tuple(
        Chunk(POINT, t_ns := START_NS + round(t_s * 1e9), Tap(visit.point, visit.standing, t_ns).encode())
        for t_s, visit in zip(times_s(scenario.walk, protocol.points, visits), visits, strict=True)
    )
    chunks = tuple(scenario.chunks())
    scenario.close()
    return protocol, chunks, taps


def record(
    path: Path, protocol: Protocol, *streams: Sequence[Chunk], metadata: Mapping[str, str] | None = None
) -> Path:
    """The chunks of these streams in the order of their arrival, as a recording with the protocol in its metadata, or other fields."""
    plan = protocol.plan()
    fields = run_metadata(plan, plan.start, 3, "acceptance", source=SIMULATED)
    recorder = Recorder(path, {**fields, **(protocol.metadata if metadata is None else metadata)})
    for chunk in ordered(streams):
        recorder.write(chunk)
    recorder.close()
    return path


def ordered(streams: Sequence[Sequence[Chunk]]) -> Iterator[Chunk]:
    """Chunks of several streams in the order of their arrival."""
    yield from sorted((chunk for stream in streams for chunk in stream), key=lambda chunk: chunk.t_arrival_ns)
