# SPDX-License-Identifier: MIT
"""A walk drawn without a plan: path, walls, closures, and the plan that comes of it (simulated)."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from itertools import takewhile
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.legs.trunk_path import rotated_segment
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import NO_PLAN, Pose
from echostep_app.mapping.graph.graph import Closure, contradicted
from echostep_app.mapping.growing import GrowingMap
from echostep_app.mapping.mapper import Mapped, map_walk
from echostep_app.mapping.plan import plan_of
from echostep_app.mapping.walls.drawing import Drawing, draw
from echostep_app.plan.check import check_plan
from echostep_app.plan.places.gaps import door_gaps
from echostep_app.session.metadata import run_metadata
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import DEMO_WAYPOINTS, demo_scenario
from echostep_studies.bench.sites import Site
from echostep_studies.bench.walks import SimulatedWalk, simulate
from echostep_studies.noplan.judgement import known_start, path_columns
from mapping.graph.test_walk_levels import away_m
from recording.damages import write_recording
from walks import PLAN

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def walk() -> SimulatedWalk:
    """The demo's walk."""
    return simulate(Site(PLAN, DEMO_WAYPOINTS), 3)


@pytest.fixture(scope="module")
def mapped(walk: SimulatedWalk) -> Mapped:
    """The same, drawn."""
    return map_walk(walk.segments)


def test_the_office_is_drawn(walk: SimulatedWalk, mapped: Mapped) -> None:
    """Every drawn wall is one, within 0.2 m at nine of ten places; both corridors are there; the plan has no faults."""
    plan, ((path,),) = plan_of(mapped, walk.pose_at(walk.segments[0].segment.t0_s), "drawn")
    truth = np.column_stack([np.interp(mapped.graph.nodes.t_s, walk.truth[:, 0], walk.truth[:, k]) for k in (1, 2)])
    assert np.sqrt(np.mean(np.sum((path - truth) ** 2, axis=1))) < 0.25
    walls = plan.levels[0].walls
    length = np.hypot(*(walls[:, 2:] - walls[:, :2]).T)
    assert length.sum() > 80.0
    assert np.quantile(away_m(walls, PLAN.levels[0].solid), 0.9) < 0.2
    assert sum(door.state == "open" for door in plan.levels[0].doors) >= 2
    assert check_plan(plan) == []
    assert plan.uncertainty_m is not None
    assert 0.01 < plan.uncertainty_m < 0.2


def test_doors_that_were_only_passed_are_openings(walk: SimulatedWalk, mapped: Mapped) -> None:
    """Five of the office's seven: two were walked through, three seen through; of the others no echo came back, and they are drawn as wall."""
    plan, _ = plan_of(mapped, walk.pose_at(walk.segments[0].segment.t0_s), "drawn")
    drawn = np.array([door.line for door in plan.levels[0].doors])
    middles = 0.5 * (drawn[:, :2] + drawn[:, 2:])
    doors = np.array([door.line for door in door_gaps(PLAN.levels[0])])
    assert len(doors) == 7
    away_m = [np.hypot(*(middles - middle).T).min() for middle in 0.5 * (doors[:, :2] + doors[:, 2:])]
    assert sum(away < 0.2 for away in away_m) == 5, away_m


def test_walls_are_known_as_well_as_the_path_that_drew_them(mapped: Mapped) -> None:
    """The same walk by a foot that errs ten times as much, without its returns: more than twice as uncertain; the walls stay where they are."""
    graph, nodes = mapped.graph, mapped.graph.nodes
    loose = replace(graph, nodes=replace(nodes, sd_m=10.0 * nodes.sd_m), closures=[])
    loose.solve(1)
    loose.pose, loose.walls = graph.pose, graph.walls
    (drawing,) = draw(loose, mapped.pings)
    loose_walls, walls = drawing.all_walls, mapped.drawing.all_walls
    assert len(drawing.doubtful) > len(mapped.drawing.doubtful), "what is not known well enough is doubtful"
    assert np.array_equal(np.sort(loose_walls[:, :4], axis=0), np.sort(walls[:, :4], axis=0))
    assert np.sqrt(np.mean(loose_walls[:, 4] ** 2)) > 2.0 * np.sqrt(np.mean(walls[:, 4] ** 2))


def test_the_plans_uncertainty_is_that_of_its_length(mapped: Mapped) -> None:
    """Eight metres known to 10 cm, one metre to 50 cm, and a piece too short to be drawn."""
    walls = np.array([[0.0, 2.0, 8.0, 2.0], [9.0, 2.0, 9.0, 3.0], [0.0, 0.0, 0.05, 0.0]])
    drawing = Drawing(walls, np.array([0.1, 0.5, 9.0]), mapped.drawing.paths_m)
    plan, _ = plan_of(replace(mapped, drawings=(drawing,)), Pose(0.0, 0.0, 0.0), "two walls")
    assert plan.uncertainty_m == pytest.approx(math.sqrt((8.0 * 0.01 + 0.25) / 9.0), abs=0.001)


def test_the_solution_pivots_on_its_diagonal(mapped: Mapped) -> None:
    """Other pivots fill the factor of an hour's walk ten times as much."""
    factor = mapped.graph.factor
    assert factor is not None
    assert np.array_equal(factor.perm_r, factor.perm_c)


def test_closures_state_their_odds_and_lead_to_the_right_place(walk: SimulatedWalk, mapped: Mapped) -> None:
    """The last corridor of the walk is the first one."""
    closures, graph = mapped.graph.closures, mapped.graph
    assert closures
    assert min(c.log_odds for c in closures) > math.log(100.0)
    first, last = (walk.pose_at(graph.nodes.t_s[k]) for k in (closures[-1].old, closures[-1].new))
    apart = math.hypot(last.x_m - first.x_m, last.y_m - first.y_m)
    assert math.hypot(*closures[-1].between[:2]) == pytest.approx(apart, abs=0.4)


def test_a_closure_that_the_walk_contradicts_is_known_by_it(mapped: Mapped) -> None:
    """A closure that shifts the path by 2 m between two places a step apart."""
    graph = mapped.graph
    between = graph.pose[11] - graph.pose[10] + [2.0, 0.0, 0.0]
    assert contradicted(graph, Closure(10, 11, between, np.diag([100.0, 100.0, 0.0]), 10.0)) < 0.0
    assert contradicted(graph, Closure(10, 11, graph.pose[11] - graph.pose[10], np.eye(3), 10.0)) == pytest.approx(10.0)


def test_walls_at_any_angle_are_no_building_with_two_directions(mapped: Mapped, walk: SimulatedWalk) -> None:
    """The evidence of the office is overwhelming; with a heading that turns by a degree each decimetre there is none."""
    assert mapped.directions.evidence > math.log(1e6)
    bent, turned = [], 0.0
    for measured in walk.segments:
        s = measured.segment
        turn = math.radians(10.0) * math.hypot(s.dx_m, s.dy_m)
        moved = rotated_segment(s, turned)
        bent.append(replace(measured, segment=replace(moved, heading1_rad=moved.heading1_rad + turn)))
        turned += turn
    assert map_walk(bent).directions.evidence < math.log(1000.0)


def test_a_walk_may_begin_out_of_hearing_of_any_wall(walk: SimulatedWalk) -> None:
    """The first 30 m in silence, the walls at 20 degrees to the first heading: the building's directions are those of the walls heard later."""
    turn, way_m, heard = math.radians(20.0), 0.0, []
    for measured in walk.segments:
        s = measured.segment
        way_m += math.hypot(s.dx_m, s.dy_m)
        moved = rotated_segment(s, turn)
        silent = np.full(len(measured.range_m), np.nan)
        heard.append(replace(measured, segment=moved, range_m=silent if way_m < 30.0 else measured.range_m))
    graph = map_walk(heard).graph
    truth = np.column_stack([np.interp(graph.nodes.t_s, walk.truth[:, 0], walk.truth[:, k]) for k in (1, 2)])
    path = graph.pose[:, :2]
    assert path_columns(known_start(path, truth).to_map(path), truth).rmse_m < 0.5


def test_a_person_who_goes_along_is_no_wall() -> None:
    """Two seconds beside the left ranger, in an open place, draw nothing; eight seconds do."""
    for span_s, drawn in ((2.0, False), (8.0, True)):
        mapped = map_walk(beside(span_s))
        walls = mapped.drawing.walls
        assert bool(len(walls)) is drawn


def beside(span_s: float) -> list[MeasuredSegment]:
    """Straight on for 40 m at 1 m/s, with something 1.5 m to the left for a while."""
    found = []
    for k in range(40):
        t_s = k + np.arange(0.0, 1.0, 0.07)
        near = (t_s >= 15.0) & (t_s < 15.0 + span_s)
        segment = PathSegment(k, k + 1.0, 1.0, 0.0, 0.0, 0.0, 0.02, math.radians(0.3), k)
        found.append(MeasuredSegment(segment, t_s, np.zeros(len(t_s), np.int64), np.where(near, 1.5, np.nan)))
    return found


def test_a_recording_becomes_a_plan_that_tracks(tmp_path: Path) -> None:
    """`echostep map` of a recorded demo; the same walk is tracked on the drawing, and never lost, though uncertain at first: as the drawing is."""
    path, scenario = tmp_path / "walk.mcap", demo_scenario(PLAN, 4, PythonBoard(4))
    write_recording(path, scenario.chunks(), run_metadata(NO_PLAN, NO_PLAN.start, 4, "no plan"))
    done = echostep("map", path, "-o", "plan.json", "--picture", "plan.png", cwd=tmp_path, ends=0)
    assert "returns to known places" in done.stdout
    assert "picture: plan.png\n" in done.stdout
    assert (tmp_path / "plan.png").stat().st_size > 10_000
    echostep("plan", "check", "plan.json", cwd=tmp_path, ends=0)
    tracked = echostep("replay", path, "--plan", "plan.json", "--headless", "--out", "again", cwd=tmp_path, ends=0)
    assert re.search(r"never lost|lost for 0 s of 85 s, uncertain for [0-4] s", tracked.stdout), tracked.stdout
    echostep("map", path, "-o", "plan.json", "--picture", "plan.xyz", cwd=tmp_path, ends=2)


def test_a_recording_without_a_walk_is_refused(tmp_path: Path) -> None:
    """An empty file, and two seconds of standing."""
    (tmp_path / "empty.mcap").write_bytes(b"")
    refused = echostep("map", "empty.mcap", "-o", "plan.json", cwd=tmp_path)
    assert (refused.returncode, "no recorded bytes" in refused.stderr) == (2, True)
    path, chunks = tmp_path / "walk.mcap", demo_scenario(PLAN, 4, PythonBoard(4)).chunks()
    early = takewhile(lambda chunk: chunk.t_arrival_ns <= 3_000_000_000, chunks)
    write_recording(path, early, run_metadata(NO_PLAN, NO_PLAN.start, 4, "no plan"))
    refused = echostep("map", path, "-o", "plan.json", cwd=tmp_path)
    assert (refused.returncode, "of steps in it" in refused.stderr) == (2, True)
    assert not (tmp_path / "plan.json").exists()


def test_a_walk_that_is_drawn_while_it_goes_on_becomes_the_same(walk: SimulatedWalk, mapped: Mapped) -> None:
    """In ten stretches: the same path and about as much wall; a drawing of the first has less."""
    growing, count = GrowingMap(), len(walk.segments)
    grown = [growing.grow(walk.segments[k * count // 10 : (k + 1) * count // 10]) for k in range(10)]
    lengths = [float(np.hypot(*(m.drawing.walls[:, 2:] - m.drawing.walls[:, :2]).T).sum()) for m in (*grown, mapped)]
    assert lengths[-2] == pytest.approx(lengths[-1], rel=0.15)
    assert lengths[2] < 0.7 * lengths[-1]
    assert grown[-1].graph.closures
    apart = grown[-1].graph.pose[:, :2] - mapped.graph.pose[:, :2]
    assert np.sqrt(np.mean(np.sum(apart**2, axis=1))) < 0.15


def test_without_an_echo_only_the_path_is_drawn(walk: SimulatedWalk) -> None:
    silent = [replace(m, range_m=np.full(len(m.range_m), np.nan)) for m in walk.segments[:60]]
    grown = GrowingMap().grow(silent)
    assert not len(grown.drawing.walls)
    assert len(grown.drawing.paths_m[0]) > 20
