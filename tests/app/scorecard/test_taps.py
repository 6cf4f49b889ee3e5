# SPDX-License-Identifier: MIT
"""`echostep score --taps`: a track that was made without the taps, against the places that were tapped."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from command_line import echostep
from echostep.arrays import Floats
from echostep.plan import Level, Plan, Pose
from echostep.ports.chunks import Chunk
from echostep.ports.people.check_in import CheckIn, Undo
from echostep.walk.walk import replay
from echostep_app.plan.writer import save_plan
from scorecard.tapped_walks import SD_M, Stand, record, said, walked

WALLS = np.array([[0, 0, 8, 0], [8, 0, 8, 2], [8, 2, 0, 2], [0, 2, 0, 0]], float)
XS_M, Y_M = (1.0, 4.0, 7.0), 1.0
START = Pose(XS_M[0], Y_M, 0.0)
CORRIDOR = Plan("corridor", (Level("", 0.0, WALLS),), START, "")


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plan") / "plan.json"
    save_plan(CORRIDOR, path)
    return path


@cache
def corridor_walk() -> tuple[tuple[Chunk, ...], tuple[Stand, ...]]:
    return walked(CORRIDOR, XS_M, Y_M)


def chunks() -> tuple[Chunk, ...]:
    return corridor_walk()[0]


def stands() -> tuple[Stand, ...]:
    """Where the simulated wearer stood, after the start."""
    return corridor_walk()[1][1:]


def scored(folder: Path, plan: Path, taps: list[Chunk], start: Pose | None = START) -> dict[str, Any]:
    """The card of a walk with these taps."""
    walk = record(folder / "walk.mcap", CORRIDOR, chunks(), taps, start)
    tree = json.loads(echostep("score", walk, "--taps", "--plan", plan, "--json").stdout)
    assert tree["truth"] == "taps"
    (card,) = tree["tracks"]
    return dict(card)


def errors_m(folder: Path, plan: Path) -> Floats:
    """Distances of a track, made of a recording without taps, from where the simulated wearer stood."""
    estimates = replay(record(folder / "untapped.mcap", CORRIDOR, chunks(), [], START), plan).estimates
    t_s = [e.t_s for e in estimates]
    at = [stand.t_s for stand in stands()]
    x, y = (np.interp(at, t_s, column) for column in ([e.x_m for e in estimates], [e.y_m for e in estimates]))
    return np.hypot(x - [stand.x_m for stand in stands()], y - [stand.y_m for stand in stands()])


def test_the_figures_are_those_of_the_simulated_truth(tmp_path: Path, plan: Path) -> None:
    card, expected = scored(tmp_path, plan, [stand.tap() for stand in stands()]), errors_m(tmp_path, plan)
    assert card["points"] == len(stands()) == 4
    # The board's clock begins with its first sample
    assert card["horizontal"]["mean_m"] == pytest.approx(expected.mean(), abs=0.02)
    assert card["horizontal"]["max_m"] == pytest.approx(expected.max(), abs=0.02)
    assert card["horizontal"]["mean_m"] < 0.2
    assert card["floor_probability"] == card["availability"] == 1.0


def test_no_tap_moves_the_track_that_it_judges(tmp_path: Path, plan: Path) -> None:
    """Taps half a metre beside the true places are errors of half a metre: the second one too, which the first would have explained."""
    card = scored(tmp_path, plan, [stand.tap(0.5 if stand.x_m < 6.0 else -0.5) for stand in stands()])
    assert card["horizontal"]["mean_m"] == pytest.approx(0.5, abs=0.1)
    assert card["horizontal"]["ending_m"] == pytest.approx(0.5, abs=0.2)


def test_a_walk_that_waits_for_a_tap_begins_there_and_the_tap_is_no_truth(tmp_path: Path) -> None:
    begin = corridor_walk()[1][0]._replace(t_s=1.0)
    save_plan(replace(CORRIDOR, start=None), tmp_path / "open.json")
    taps = [begin.tap(heading_rad=0.0), *(stand.tap() for stand in stands())]
    card = scored(tmp_path, tmp_path / "open.json", taps, None)
    assert card["points"] == 4
    assert card["horizontal"]["mean_m"] < 0.3


def test_a_tap_that_was_undone_is_none(tmp_path: Path, plan: Path) -> None:
    first, wrong, *rest = stands()
    undo = said(wrong.t_s + 0.5, Undo(2).encode())
    bad = said(wrong.t_s + 0.6, b"\xff{")
    card = scored(tmp_path, plan, [first.tap(), wrong.tap(-2.0), undo, bad, *(stand.tap() for stand in rest)])
    assert card["points"] == 3
    assert card["horizontal"]["max_m"] < 0.4


def test_the_table_says_what_was_compared(tmp_path: Path, plan: Path) -> None:
    walk = record(tmp_path / "walk.mcap", CORRIDOR, chunks(), [stand.tap() for stand in stands()], START)
    done = echostep("score", walk, "--taps", "--plan", plan)
    assert (done.returncode, done.stderr) == (0, "")
    words = " ".join(done.stdout.split())
    assert f"4 taps, each with a standard deviation of {SD_M:.2f} m; the track was made without them" in words
    assert "Scores against taps on corridor" in words


@pytest.mark.parametrize(
    ("taps", "says"),
    [
        ([], "no tap in it after the start"),
        ([(9.5, 1.0, 0)], "9.50,1.00: it is outside the building: give the plan on which it was tapped"),
        ([(4.0, 1.95, 0)], "it is inside a wall"),
        ([(4.0, 1.0, 3)], "the plan has no level 3"),
        ([(4.0, 1.0, 0)] * 3, "most taps came within 0.5 s of the one before"),
    ],
)
def test_taps_that_cannot_be_compared_are_one_sentence(
    taps: list[tuple[float, float, int]], says: str, plan: Path, tmp_path: Path
) -> None:
    sent = [said(12.0 + 0.1 * k, CheckIn(x, y, None, SD_M, level).encode()) for k, (x, y, level) in enumerate(taps)]
    walk = record(tmp_path / "walk.mcap", CORRIDOR, chunks(), sent, START)
    done = echostep("score", walk, "--taps", "--plan", plan)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.startswith(f"echostep: {walk}: ")
    assert says in done.stderr


def test_a_damaged_recording_is_scored_to_its_end_and_the_damage_is_said(tmp_path: Path, plan: Path) -> None:
    walk = record(tmp_path / "walk.mcap", CORRIDOR, chunks(), [stand.tap() for stand in stands()], START)
    walk.write_bytes(walk.read_bytes()[: walk.stat().st_size * 3 // 4])
    done = echostep("score", walk, "--taps", "--plan", plan, "--json")
    assert 0 < json.loads(done.stdout)["tracks"][0]["points"] < 4
    assert done.stderr.startswith(f"{walk}: ")
    assert done.stderr.count("\n") == 1
    walk.write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    done = echostep("score", walk, "--taps", "--plan", plan)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)


@pytest.mark.parametrize("words", [("--taps",), ("--taps", "--plan", "PLAN", "--truth", "x.csv")])
def test_taps_need_the_plan_and_no_other_truth(words: tuple[str, ...], plan: Path, tmp_path: Path) -> None:
    done = echostep("score", tmp_path / "walk.mcap", *(plan if word == "PLAN" else word for word in words))
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "--taps: give the plan on which the places were tapped" in done.stderr


def test_a_table_has_no_taps(tmp_path: Path, plan: Path) -> None:
    (tmp_path / "track.csv").write_text("t_s,x_m,y_m\n0,1,1\n1,2,1\n")
    done = echostep("score", tmp_path / "track.csv", "--taps", "--plan", plan)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "track.csv" in done.stderr
