# SPDX-License-Identifier: MIT
"""Recordings that were killed, damaged or contradict themselves: a drawing of what was walked, or one clear sentence (simulated)."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command_line import echostep
from echostep.arrays import Floats
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import NO_PLAN, Pose, load_plan, parse_plan
from echostep.ports.chunks import Chunk
from echostep_app.mapping.mapper import map_walk
from echostep_app.mapping.plan import plan_of
from echostep_app.plan.writer import plan_json
from echostep_app.session.metadata import run_metadata
from echostep_simulation.devices.board import PythonBoard
from echostep_simulation.scenario import demo_scenario
from echostep_studies.bench.tours import clearance_m
from recording.damages import write_recording
from walks import PLAN

pytestmark = pytest.mark.slow

HEADING_RAD = 0.5 * math.pi


def record(path: Path, chunks: list[Chunk], **fields: str) -> Path:
    """A recording of these chunks that begins at the demo's start; `fields` replace recorded ones."""
    write_recording(path, chunks, run_metadata(NO_PLAN, PLAN.start, 4, "no plan") | fields)
    return path


@pytest.fixture(scope="module")
def chunks() -> list[Chunk]:
    """The demo's bytes."""
    return list(demo_scenario(PLAN, 4, PythonBoard(4)).chunks())


@pytest.fixture(scope="module")
def whole(chunks: list[Chunk], tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The demo's recording."""
    return record(tmp_path_factory.mktemp("whole") / "walk.mcap", chunks).read_bytes()


def length_m(walls: Floats) -> float:
    """Length of all walls."""
    return float(np.hypot(*(walls[:, 2:] - walls[:, :2]).T).sum())


def test_a_walk_killed_at_any_moment_leaves_a_drawing_of_what_was_walked(whole: bytes, tmp_path: Path) -> None:
    """Cut at eight places, in the middle of records: a short beginning has no walk in it, every longer one more walls, all of them true."""
    drawn = []
    for k, share in enumerate((0.001, 0.03, 0.2, 0.35, 0.5, 0.65, 0.8, 0.999)):
        path, out = tmp_path / f"cut{k}.mcap", tmp_path / f"plan{k}.json"
        path.write_bytes(whole[: int(share * len(whole)) + k])
        done = echostep("map", path, "-o", out)
        if done.returncode:
            assert done.stderr.count("\n") == 1, done.stderr
            assert "steps in it" in done.stderr or "no recorded bytes" in done.stderr
            assert not out.exists()
            continue
        assert "it has no end record: it was not closed" in done.stdout
        assert "all before was used" in done.stdout
        walls = load_plan(out).levels[0].walls
        middles = 0.5 * (walls[:, :2] + walls[:, 2:])
        away = [clearance_m(x, y, PLAN.levels[0].solid) for x, y in middles.tolist()]
        assert np.median(away) < 0.2
        drawn.append(length_m(walls))
    assert len(drawn) >= 6
    assert drawn[-1] > 2.0 * drawn[0]
    assert all(later > 0.9 * earlier for earlier, later in zip(drawn, drawn[1:], strict=False))


def test_damage_in_the_middle_is_said_and_the_rest_is_drawn(whole: bytes, tmp_path: Path) -> None:
    """Two kilobytes of zeros at three places."""
    hurt = bytearray(whole)
    for share in (0.3, 0.5, 0.7):
        begin = int(share * len(hurt))
        hurt[begin : begin + 2048] = bytes(2048)
    (tmp_path / "hurt.mcap").write_bytes(hurt)
    done = echostep("map", "hurt.mcap", "-o", "plan.json", cwd=tmp_path, ends=0)
    assert "damaged bytes in" in done.stdout
    assert length_m(load_plan(tmp_path / "plan.json").levels[0].walls) > 60.0


@pytest.mark.parametrize("start", ["1,2", "nan,0,0,0", "1e300,0,0,0", "2.0,7.5,0.0,6"])
def test_a_damaged_start_does_not_stop_the_drawing(chunks: list[Chunk], tmp_path: Path, start: str) -> None:
    """The drawing begins at the origin; a start on a level that the drawing has not begins on its only one."""
    path = record(tmp_path / "walk.mcap", chunks[: len(chunks) // 3], start_x_y_rad=start)
    done = echostep("map", path, "-o", "plan.json", cwd=tmp_path, ends=0)
    plan = load_plan(tmp_path / "plan.json")
    assert plan.start is not None
    assert plan.start.level == 0
    assert ("begins at the origin" in done.stdout) == (not start.endswith("6"))


def test_a_silent_part_is_named(chunks: list[Chunk], tmp_path: Path) -> None:
    """Without the board there are no echoes; without the foot the leg gyros draw."""
    for port, said in (("mtx", "no echo in it"), ("board", "")):
        path = record(tmp_path / f"{port}.mcap", [c for c in chunks[: len(chunks) // 3] if c.port == port])
        done = echostep("map", path, "-o", "plan.json", cwd=tmp_path)
        assert (done.returncode, said in done.stderr) == (2 if said else 0, True), done.stderr


def test_the_recording_is_not_overwritten(whole: bytes, tmp_path: Path) -> None:
    """The plan and the picture need other names than the walk; a folder is no plan."""
    (tmp_path / "walk.mcap").write_bytes(whole)
    for arguments in (
        ("-o", "walk.mcap"),
        ("-o", "plan.json", "--picture", "./walk.mcap"),
        ("-o", "plan.json", "--picture", "x.gif"),
    ):
        done = echostep("map", "walk.mcap", *arguments, cwd=tmp_path)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
    assert (tmp_path / "walk.mcap").read_bytes() == whole
    assert not (tmp_path / "plan.json").exists()


def walk_of(moves: Floats, range_m: Floats) -> list[MeasuredSegment]:
    """Segments (n) by their moves (n, 2), one second each, with two pings each."""
    rows = []
    for k, ((dx, dy), r) in enumerate(zip(moves.tolist(), range_m.tolist(), strict=True)):
        segment = PathSegment(float(k), k + 1.0, dx, dy, HEADING_RAD, HEADING_RAD, 0.02, 0.01, k)
        rows.append(MeasuredSegment(segment, np.array([k + 0.2, k + 0.7]), np.array([0, 1]), np.array([r, r])))
    return rows


def hostile() -> dict[str, list[MeasuredSegment]]:
    """Walks that no foot makes."""
    rng, forth = np.random.default_rng(5), np.tile([0.0, 1.0], (40, 1))
    near = np.full(40, 1.0)
    unknown = [replace(m, segment=replace(m.segment, sd_m=1e3)) for m in walk_of(forth, near)]
    return {
        "standing": walk_of(0.0 * forth, near),
        "no echo": walk_of(forth, np.full(40, np.nan)),
        "noise": walk_of(rng.normal(0.0, 1.0, (40, 2)), rng.uniform(0.2, 4.0, 40)),
        "on one spot": walk_of(forth * np.where(np.arange(40) % 2, 1.0, -1.0)[:, None], near),
        "far leaps": walk_of(1e4 * forth, near),
        "not observed": unknown,
        "one segment": walk_of(forth[:1], near[:1]),
        "echoes of a touch": walk_of(forth, 0.0 * near),
    }


@pytest.mark.parametrize("name", hostile())
def test_walks_that_no_foot_makes_are_drawn_or_empty(name: str) -> None:
    """No number in the plan is infinite or not a number, and it is read back."""
    plan, ((path,),) = plan_of(map_walk(hostile()[name]), Pose(0.0, 0.0, HEADING_RAD), name)
    assert np.isfinite(path).all()
    assert np.isfinite(plan.levels[0].walls).all()
    if plan.is_drawn:
        parse_plan(plan_json(plan).encode())
