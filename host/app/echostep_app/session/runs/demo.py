# SPDX-License-Identifier: MIT
"""`echostep demo`: track a simulated walk through the demo plan, or through the rooms of another one.

In: a seed, a plan, and a program that plays the sensor board, or the Python board. Out: recording, true path, track, summary. Owns the simulated
board. A demo on a terminal is slowed down to be watched; elsewhere it runs as fast as it can. Its estimates are the same at any speed.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing, nullcontext
from dataclasses import dataclass, replace
from importlib.resources import as_file, files
from pathlib import Path

from echostep.errors import EchostepError
from echostep.file_mode import claim
from echostep.plan import Plan
from echostep.ports.chunks import Chunk, Portion
from echostep.tracker import Tracker
from echostep.walk.recorded import SIMULATED
from echostep_app.guidance.tours import room_tour
from echostep_app.interruption import until_asked
from echostep_app.kernel_parts import Part
from echostep_app.plan.importers.limited import open_limited
from echostep_app.printing.console import console, print_notices
from echostep_app.printing.progress import progress_line
from echostep_app.recording.recorder import Recorder
from echostep_app.scorecard.truth import load_truth
from echostep_app.session.chunk_streams import paced, portions_of, recorded, with_messages
from echostep_app.session.metadata import run_metadata, start_recording
from echostep_app.session.options import OutputOptions
from echostep_app.session.results import output_folder
from echostep_app.session.session import Session
from echostep_simulation.devices.beacon_gateway import with_beacons
from echostep_simulation.devices.board import Board, BoardProcess, PythonBoard
from echostep_simulation.kits import Kit
from echostep_simulation.people.walker import Person, Waypoint
from echostep_simulation.scenario import DEMO_WAYPOINTS, Scenario, start_of
from echostep_simulation.stimulus import TEMPERATURE_C

WATCHED_SPEED = 4.0  # times real time, on a terminal: a walk of 90 s is seen in 22 s
# Chunks that are tracked together in a run that is watched: 20 ms of the walk: no step is shown later
WATCHED_PORTION = 16
UNSEEN_PORTION = 1000  # chunks that are tracked together when nothing shows the run: fewer calls
FOOT_BOARD = 2  # seed of its simulator: another board than the belt's
SIMULATION = Part("echostep_simulation.kernels:simulation", 85)
_DEMO_PLAN = files("echostep") / "plans" / "demo.json"
TOUR_CORNER_M = 0.3  # how far corners are cut on a tour: doors of any plan are passed without touching them


@dataclass(frozen=True, slots=True)
class DemoOptions:
    """`board_command` starts the program that plays the board; `guide` adds beacons and guidance to the end of the walk.

    `plan_path` None: the demo's plan. `speed`: times real time; None: `WATCHED_SPEED` on a terminal, else as fast as it can.
    `kit`: the parts on the board; 2026's need the real firmware in the simulator. `celsius`: of the air.
    """

    seed: int
    board_command: str | None = None
    guide: bool = False
    plan_path: Path | None = None
    speed: float | None = None
    kit: Kit = Kit.PAPERS
    celsius: float = TEMPERATURE_C


def demo(options: DemoOptions, output: OutputOptions) -> None:
    """Simulate a walk, track and record it."""
    # The plan of the demo may be inside an archive
    with as_file(_DEMO_PLAN) if options.plan_path is None else nullcontext(options.plan_path) as plan_path:
        plan = open_limited(plan_path)
    waypoints = DEMO_WAYPOINTS if options.plan_path is None else room_tour(plan)
    if options.kit is Kit.OF_2026 and options.board_command is None:
        raise EchostepError("the kit of 2026 needs the real firmware in the simulator: make demo KIT=2026")
    with ExitStack() as stack:
        board = stack.enter_context(closing(_board(options)))
        foot_command = [*shlex.split(options.board_command or ""), "--seed", str(FOOT_BOARD)]
        foot_board = stack.enter_context(closing(BoardProcess(foot_command))) if options.kit is Kit.OF_2026 else None
        output = replace(output, folder=output_folder(output.folder))
        _track((board, foot_board), plan, waypoints, options, output)


def _board(options: DemoOptions) -> Board:
    command = options.board_command
    player = "the real firmware in the simulator" if command else "the Python board, not the real firmware"
    board = BoardProcess(shlex.split(command)) if command else PythonBoard(seed=options.seed)
    of_2026 = "of 2026, not built yet, and a second one is on the foot"
    parts = of_2026 if options.kit is Kit.OF_2026 else "of the papers, the default"
    console.print(f"A simulated walk in a simulated building; the sensor board is {player}, with the parts {parts}.")
    return board


def _track(
    boards: tuple[Board, Board | None],
    plan: Plan,
    waypoints: Sequence[Waypoint],
    options: DemoOptions,
    output: OutputOptions,
) -> None:
    start = start_of(plan, waypoints)
    tracker = Tracker(plan, start, seed=options.seed)
    speed = options.speed or (WATCHED_SPEED if console.is_terminal and output.watched else None)
    title = "echostep demo (simulated" + (f", {speed:g} x real time)" if speed else ")")
    to = waypoints[-1]
    end = f"{to[0]!r},{to[1]!r},{start_of(plan, waypoints[::-1]).level}" if options.guide else None
    with Session(tracker, title, "simulated", output, end) as session:
        session.prepare(SIMULATION)
        with progress_line("Simulating the walk"):
            person = Person() if options.plan_path is None else Person(corner_m=TOUR_CORNER_M)
            scenario = Scenario(
                plan, waypoints, options.seed, boards[0], person, kit=options.kit, foot_board=boards[1],
                celsius=options.celsius,
            )  # fmt: skip
        scenario.write_truth(claim(output.folder / "truth.csv"))
        session.show_truth(load_truth(output.folder / "truth.csv", plan))
        metadata = run_metadata(plan, start, options.seed, "simulated walk, simulated sensors", source=SIMULATED)
        with start_recording(output.folder / "walk.mcap", metadata) as recorder:
            chunks = with_beacons(scenario, plan, options.seed) if options.guide else scenario.chunks()
            portions = _portions(chunks, session, recorder, speed)
            session.track(until_asked(portions), lambda: scenario.fraction, recorder)
        print_notices(recorder.notices)
        session.finish("simulated walk")
        session.keep_page_open(_again(recorder.path, options))
    recorder.check_whole()


def _again(recording: Path, options: DemoOptions) -> str:
    """The command that plays a demo's recording on the page."""
    plan = options.plan_path or Path(str(_DEMO_PLAN))
    here = Path.cwd()
    paths = [str(p.resolve().relative_to(here) if p.resolve().is_relative_to(here) else p) for p in (recording, plan)]
    return shlex.join(["echostep", "replay", paths[0], "--plan", paths[1], "--page"])


def _portions(chunks: Iterator[Chunk], session: Session, recorder: Recorder, speed: float | None) -> Iterator[Portion]:
    """The simulated chunks, recorded; a run that is watched is slowed down and tracked in small portions."""
    source = paced(chunks, speed) if speed else chunks
    with_people = with_messages(source, session.message_sources, lambda before: before.t_arrival_ns if before else 0)
    return portions_of(
        recorded(with_people, recorder, wait_for_disk=True), WATCHED_PORTION if speed else UNSEEN_PORTION
    )
