# SPDX-License-Identifier: MIT
"""`--start last`: what a live run keeps, and what the next one makes of it."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from echostep.errors import EchostepError
from echostep.height.levels import Air, ClimbSettings
from echostep.localization import Estimate, Start, TrackStatus
from echostep.tracker import Tracker
from echostep.tracker.last_place import LastPlace, last_place
from echostep.walk.recorded import recorded_start
from echostep_app.session.last_place import FILE, KEPT_S, Kept, PlaceKeeper, read_kept, start_last
from echostep_app.session.metadata import parse_start, run_metadata
from echostep_simulation.world.tower import tower

PLAN = tower(3)
BOARD = "85837343139351E09080"
NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
PLACE = LastPlace(10.25, 2.5, 0.05, 1, Air(99.5, 0.125))
KEPT = Kept(PLACE, NOW - timedelta(seconds=60), PLAN.digest, BOARD)
SURE = Estimate(5.0, 10.25, 2.5, 0.0025, 0.0, 0.0025, 0.0, 0.1, 3, TrackStatus.TRACKING, 1)


def keeper(folder: Path, place: LastPlace | None = PLACE) -> PlaceKeeper:
    tracker = SimpleNamespace(plan=PLAN, last_place=lambda: place)
    return PlaceKeeper(folder, cast(Tracker, tracker), BOARD)


def test_what_is_kept_is_read_again(tmp_path: Path) -> None:
    before = datetime.now(UTC)
    keeper(tmp_path).note(None, SURE)
    kept = read_kept(tmp_path)
    assert replace(kept, utc=NOW) == replace(KEPT, utc=NOW)
    assert before <= kept.utc <= datetime.now(UTC)
    assert [path.name for path in tmp_path.iterdir()] == [FILE]


def test_it_is_kept_while_the_tracker_is_sure_and_not_at_every_estimate(tmp_path: Path) -> None:
    keeps = keeper(tmp_path)
    for status in (TrackStatus.UNCERTAIN, TrackStatus.LOST):
        keeps.note(None, replace(SURE, status=status))
    assert not (tmp_path / FILE).exists()
    for t_s, written in ((5.0, True), (5.0 + 0.9 * KEPT_S, False), (5.0 + 1.1 * KEPT_S, True)):
        (tmp_path / FILE).unlink(missing_ok=True)
        keeps.note(None, replace(SURE, t_s=t_s))
        assert (tmp_path / FILE).exists() == written


def test_a_disk_that_refuses_stops_nothing(tmp_path: Path) -> None:
    keeper(tmp_path / "missing").note(None, SURE)


def test_only_a_sure_estimate_is_a_last_place() -> None:
    air = Air(99.5, 0.125)
    assert last_place(SURE, air) == PLACE
    assert last_place(replace(SURE, status=TrackStatus.UNCERTAIN), air) is None
    assert last_place(None, air) is None


def test_the_same_board_carries_the_pressure_over() -> None:
    start, words = start_last(KEPT, PLAN, BOARD, ClimbSettings(), NOW)
    assert start.air is not None
    assert start.air.zero_m == 99.5
    assert "60 s ago: 10.2, 2.5 on" in words
    assert "the pressure tells the storey" in words


@pytest.mark.parametrize(
    ("kept", "board"),
    [
        (KEPT, "another"),
        (KEPT, ""),
        (replace(KEPT, board=""), ""),
        (replace(KEPT, utc=NOW + timedelta(hours=1)), BOARD),
    ],
    ids=["another board", "none named", "none ever named", "clock gone back"],
)
def test_nothing_else_does(kept: Kept, board: str) -> None:
    start, words = start_last(kept, PLAN, board, ClimbSettings(), NOW)
    assert start.air is None
    assert start.pose is not None
    assert start.after_pause
    assert "does not tell the storey" in words
    assert ("60 s ago" in words) == (kept.utc < NOW)
    assert ("clock was set back" in words) == (kept.utc > NOW)


def test_another_plan_is_refused() -> None:
    with pytest.raises(EchostepError, match="another plan"):
        start_last(KEPT, tower(2), BOARD, ClimbSettings(), NOW)


def test_no_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match="no run has kept a place there"):
        read_kept(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        {"place": None}, {"place": {"x_m": 1.0}}, {"utc": "yesterday"}, {"utc": 5}, {"place.x_m": 1e300}, {"place.x_m": "NaN"},
        {"place.level": -1}, {"place.sd_m": -1.0}, {"place.air": {"zero_m": 1.0}}, {"place.air": {"zero_m": 1.0, "sd_m": None}},
        {"place.air": 3}, {"place.level": "a"},
    ],
    ids=str,
)  # fmt: skip
def test_a_damaged_file_is_refused(tmp_path: Path, change: dict[str, Any]) -> None:
    keeper(tmp_path).note(None, SURE)
    tree = json.loads((tmp_path / FILE).read_text())
    for name, value in change.items():
        inner = tree["place"] if name.startswith("place.") else tree
        inner[name.removeprefix("place.")] = value
    (tmp_path / FILE).write_text(json.dumps(tree))
    with pytest.raises(EchostepError, match="cannot be used"):
        read_kept(tmp_path)


@pytest.mark.parametrize("text", ["", "[]", "{", "3", "\x00" * 9])
def test_a_file_of_something_else_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(EchostepError, match="cannot be used"):
        read_kept(tmp_path)


@pytest.mark.parametrize("board", [BOARD, "another"])
def test_a_replay_begins_as_the_run_did(board: str) -> None:
    start, _ = start_last(KEPT, PLAN, board, ClimbSettings(), NOW)
    assert recorded_start(run_metadata(PLAN, start, 0, ""), Path("walk.mcap")) == start


def test_a_replay_has_no_last_run() -> None:
    with pytest.raises(EchostepError, match="only of a live run"):
        parse_start("last", None, PLAN)


@pytest.mark.slow
def test_a_tracker_of_a_last_place_searches_the_building() -> None:
    start, _ = start_last(KEPT, PLAN, BOARD, ClimbSettings(), NOW)
    assert isinstance(start, Start)
    tracker = Tracker(PLAN, start)
    tracker.warm_up()
    assert tracker.last_place() is None
