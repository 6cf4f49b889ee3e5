# SPDX-License-Identifier: MIT
"""Several walks as one drawing: places of unknown start, walks of different buildings (simulated)."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.path import MeasuredSegment
from echostep.plan import NO_PLAN, load_plan
from echostep.recording import open_recording
from echostep_app.commands.actions.mapping import segments_of
from echostep_app.mapping.joining import doubt_of, join_walks
from echostep_app.mapping.mapper import Mapped, solve_walk
from echostep_app.mapping.placing import Place, find_place
from echostep_app.plan.writer import save_plan
from echostep_app.session.metadata import run_metadata, start_recording
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.people.walker import Person
from echostep_simulation.scenario import Scenario
from echostep_studies.bench.sites import plan_of
from echostep_studies.bench.tours import clearance_m
from echostep_studies.bench.walks import CORNER_M, SimulatedWalk, simulate
from echostep_studies.noplan.joined import JoinedRun, again, joined_row
from echostep_studies.noplan.judgement import known_start, path_columns, true_path
from echostep_studies.noplan.sites import corridors, office

pytestmark = pytest.mark.long

LENGTH_M = 280.0  # of a walk
SEEDS = {"a": 901, "b": 1901}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """For the recordings."""
    return tmp_path_factory.mktemp("joined")


@pytest.fixture(scope="module")
def walks(folder: Path) -> tuple[SimulatedWalk, ...]:
    """Two tours of the furnished office from different places, recorded."""
    site = office(SEEDS["a"], LENGTH_M)
    tours, found = {"a": site, "b": again(site, LENGTH_M, SEEDS["a"])}, []
    for name, tour in tours.items():
        scenario = Scenario(
            tour.built, tour.waypoints, SEEDS[name], PythonBoard(SEEDS[name]), Person(corner_m=CORNER_M)
        )
        with start_recording(folder / f"{name}.mcap", run_metadata(NO_PLAN, NO_PLAN.start, 1, "no plan")) as recorder:
            for chunk in scenario.chunks():
                recorder.write(chunk)
        segments = segments_of(open_recording(recorder.path))
        found.append(SimulatedWalk(tour.built, tuple(segments), scenario.truth))
    return tuple(found)


@pytest.fixture(scope="module")
def solved(walks: tuple[SimulatedWalk, ...]) -> tuple[Mapped, Mapped]:
    """The same, each by itself."""
    return solve_walk(walks[0].segments), solve_walk(walks[1].segments)


def turned(segments: tuple[MeasuredSegment, ...], by_rad: float) -> list[MeasuredSegment]:
    """The same walk in a frame of another direction."""
    c, s, found = math.cos(by_rad), math.sin(by_rad), []
    for measured in segments:
        old = measured.segment
        new = replace(
            old,
            dx_m=c * old.dx_m - s * old.dy_m,
            dy_m=s * old.dx_m + c * old.dy_m,
            heading0_rad=old.heading0_rad + by_rad,
            heading1_rad=old.heading1_rad + by_rad,
        )
        found.append(replace(measured, segment=new))
    return found


@pytest.mark.long
def test_the_second_walk_finds_its_place_on_the_first(
    walks: tuple[SimulatedWalk, ...], solved: tuple[Mapped, Mapped]
) -> None:
    """Both paths are right in the frame of the first; the odds of the place are stated, and no closure is wrong."""
    mapped, (join,) = join_walks([("a", solved[0]), ("b", solved[1])])
    graph, second = mapped.graph, mapped.graph.nodes.begins[1]
    truth = [true_path(walk, t) for walk, t in zip(walks, np.split(graph.nodes.t_s, [second]), strict=True)]
    frame = known_start(graph.pose[:second, :2], truth[0])
    assert path_columns(frame.to_map(graph.pose[second:, :2]), truth[1]).rmse_m < 0.4
    assert join.place.log_odds > math.log(1e3)
    assert len(join.closures) >= 2
    assert [len(path) for path in mapped.drawing.paths_m] == [second, len(graph.pose) - second]


def test_a_place_is_the_same_in_any_frame(walks: tuple[SimulatedWalk, ...], solved: tuple[Mapped, Mapped]) -> None:
    """The second walk turned by 140 degrees: its places on the first stay within 0.4 m."""
    by = math.radians(140.0)
    straight, other = find_place(solved[0].graph, solved[1].graph), solve_walk(turned(walks[1].segments, by))
    place = find_place(solved[0].graph, other.graph)
    assert straight is not None
    assert place is not None
    assert math.remainder(place.turn_rad + by - straight.turn_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=0.05)
    k = int(np.argmax(np.hypot(*solved[1].graph.pose[:, :2].T)))
    a, b = place.moved(other.graph.pose[k : k + 1, :2]), straight.moved(solved[1].graph.pose[k : k + 1, :2])
    assert np.hypot(*(a - b)[0]) < 0.4


def test_walks_of_two_buildings_are_refused(solved: tuple[Mapped, Mapped]) -> None:
    """The office, and a loop of corridors: the error says what it may be, and what to do."""
    strange = solve_walk(simulate(corridors(1, 0.4 * LENGTH_M), 1).segments)
    with pytest.raises(EchostepError, match="is it another building"):
        join_walks([("a", solved[0]), ("b", strange)])


def test_doubts_of_a_place_are_named() -> None:
    """Too little in common, walls in free floor, two places, even odds."""
    good = Place(0.0, np.zeros(2), 20.0, 0, 40.0, 2.0, 5)
    assert doubt_of(good) is None
    assert doubt_of(good._replace(common_m=5.0)) == "fits nowhere"
    assert doubt_of(good._replace(against_m=30.0)) == "fits nowhere"
    assert doubt_of(good._replace(rivals=1)) == "fits at 2 places about as well"
    assert doubt_of(good._replace(log_odds=3.0)) == "has no certain place"


def test_the_study_judges_two_walks(walks: tuple[SimulatedWalk, ...]) -> None:
    """The same pair (simulated): joined, and not at a wrong place."""
    row = joined_row("joined/office", (walks[0], walks[1]), 2)
    assert isinstance(row, JoinedRun)
    assert (row.joined, row.misplaced, row.wrong) == (1, 0, 0)


@pytest.mark.long
def test_two_recordings_become_one_plan(walks: tuple[SimulatedWalk, ...], folder: Path) -> None:
    """`echostep map A B`: the place and its odds are printed; a walk given twice is refused."""
    assert walks
    done = echostep("map", "a.mcap", "b.mcap", "-o", "both.json", "--picture", "both.png", cwd=folder, ends=0)
    assert "b.mcap joined on" in done.stdout
    assert load_plan(folder / "both.json").is_drawn
    twice = echostep("map", "a.mcap", "./a.mcap", "-o", "both.json", cwd=folder)
    assert (twice.returncode, "given twice" in twice.stderr) == (2, True)


def test_an_old_plan_is_completed_and_corrected(walks: tuple[SimulatedWalk, ...], folder: Path) -> None:
    """A plan without two of its walls, and with one across the corridor that was never built: the two come back, the third is doubtful."""
    built = walks[0].built
    level = built.levels[0]
    length = np.hypot(*(level.walls[:, 2:] - level.walls[:, :2]).T)
    seen = np.array([_seen(wall, walks) for wall in level.walls])
    lacking = np.argsort(-length * seen)[:2]
    path = np.column_stack([walks[0].truth[:, 1], walks[0].truth[:, 2]])
    x, y = path[len(path) // 2]
    false = np.array([[x - 0.8, y, x + 0.8, y]])
    old = replace(level, walls=np.concatenate([np.delete(level.walls, lacking, 0), false]), obstacles=())
    save_plan(replace(built, levels=(old,)), folder / "old.json")
    done = echostep("map", "a.mcap", "--plan", "old.json", "-o", "new.json", "--picture", "new.png", cwd=folder, ends=0)
    assert "m doubtful" in done.stdout
    new = load_plan(folder / "new.json").levels[0]
    for wall in level.walls[lacking]:
        x_m, y_m = (0.5 * (wall[:2] + wall[2:])).tolist()
        assert clearance_m(x_m, y_m, old.solid) > 0.5
        assert clearance_m(x_m, y_m, new.walls) < 0.2
    assert clearance_m(x, y, new.walls) > 0.3
    assert clearance_m(x, y, new.doubtful) < 0.1
    assert np.hypot(*(new.doubtful[:, 2:] - new.doubtful[:, :2]).T).sum() < 4.0
    corridor = np.array([[0.0, 0.0, 40.0, 0.0], [0.0, 2.0, 40.0, 2.0], [0.0, 0.0, 0.0, 2.0]])
    save_plan(plan_of("corridor", corridor), folder / "corridor.json")
    refused = echostep("map", "a.mcap", "--plan", "corridor.json", "-o", "other.json", cwd=folder)
    assert (refused.returncode, "is it another building" in refused.stderr) == (2, True)


def _seen(wall: Floats, walks: tuple[SimulatedWalk, ...]) -> bool:
    """Whether the middle of a wall was passed within 1.5 m on the first walk."""
    middle = 0.5 * (wall[:2] + wall[2:])
    return bool((np.hypot(*(walks[0].truth[:, 1:3] - middle).T) < 1.5).any())
