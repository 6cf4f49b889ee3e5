"""`echostep demo`: track a simulated walk through the demo plan.

In: a seed, and a program that plays the sensor board, or the Python board. Out: recording, true path, track, summary. Owns the simulated board.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.resources import as_file, files

from echostep.localization.metrics import load_truth
from echostep.plan.importers.formats import open_plan
from echostep.plan.model import Plan
from echostep.plan.routing import RoutePlace
from echostep.ports.chunks import Chunk, Portion
from echostep.recording.recorder import Recorder
from echostep.session.chunk_streams import paced, portions_of, recorded, with_check_ins
from echostep.session.console import console, print_notices
from echostep.session.metadata import run_metadata
from echostep.session.options import OutputOptions
from echostep.session.results import output_folder
from echostep.session.session import Session
from echostep.simulation.devices.beacon_gateway import with_beacons
from echostep.simulation.devices.board import Board, BoardProcess, PythonBoard
from echostep.simulation.scenario import Scenario, demo_scenario
from echostep.tracker import Tracker

SHOWN_SPEED = 8.0  # times real time, for a run that is watched; by reason: a walk of 90 s is seen in 12 s
UNSEEN_PORTION = 1000  # chunks that are tracked together when nothing shows the run; by reason: fewer calls


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """`board_command` starts the program that plays the board; `guide` adds beacons and guidance to the end of the walk."""

    seed: int
    board_command: str | None = None
    guide: bool = False


def demo(options: DemoOptions, output: OutputOptions) -> None:
    """Simulate a walk, track and record it."""
    board = _board(options)
    output = replace(output, folder=output_folder(output.folder))
    with as_file(files("echostep") / "plans" / "demo.json") as plan_path:
        plan = open_plan(plan_path)
    scenario = demo_scenario(plan, options.seed, board)
    try:
        _track(scenario, plan, options, output)
    finally:
        scenario.close()


def _board(options: DemoOptions) -> Board:
    command = options.board_command
    player = "the real firmware in the simulator" if command else "the Python board, not the real firmware"
    board = BoardProcess(shlex.split(command)) if command else PythonBoard(seed=options.seed)
    console.print(f"A simulated walk in a simulated building; the sensor board is {player}.")
    return board


def _track(scenario: Scenario, plan: Plan, options: DemoOptions, output: OutputOptions) -> None:
    scenario.write_truth(output.folder / "truth.csv")
    truth = load_truth(output.folder / "truth.csv")
    tracker = Tracker(plan, scenario.start, seed=options.seed)
    end = RoutePlace(*scenario.truth[-1, 1:3].tolist()) if options.guide else None
    metadata = run_metadata(plan, scenario.start, options.seed, "simulated walk, simulated sensors")
    with Session(tracker, "echostep demo (simulated)", "simulated", output, end) as session:
        with Recorder(output.folder / "walk.mcap", metadata) as recorder:
            chunks = with_beacons(scenario, plan, options.seed) if options.guide else scenario.chunks()
            session.track(_portions(chunks, session, recorder), lambda: scenario.fraction, recorder)
        print_notices(recorder.notices)
        session.finish("simulated walk", truth)
        session.keep_page_open()


def _portions(chunks: Iterator[Chunk], session: Session, recorder: Recorder) -> Iterator[Portion]:
    """The simulated chunks, recorded; a run that is watched is slowed down and tracked chunk by chunk."""
    source = paced(chunks, SHOWN_SPEED) if session.watched else chunks
    with_people = with_check_ins(source, session.page, _arrival_ns)
    return portions_of(recorded(with_people, recorder, wait_for_disk=True), 1 if session.watched else UNSEEN_PORTION)


def _arrival_ns(chunk: Chunk | None) -> int:
    """Arrival time of a check-in on the simulated clock: that of the chunk before it."""
    return chunk.t_arrival_ns if chunk else 0
