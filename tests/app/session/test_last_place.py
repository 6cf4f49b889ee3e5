# SPDX-License-Identifier: MIT
"""Starts of runs: the last place that a live run keeps, the start in a recording's fields, as written and damaged."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep.height.levels import Air, ClimbSettings
from echostep.localization import Estimate, Start, TrackStatus
from echostep.plan import NO_PLAN, Pose
from echostep.settings import Settings
from echostep.tracker import Tracker
from echostep.tracker.state import LastPlace, last_place
from echostep.walk.recorded import recorded_start
from echostep_app.session.last_place import FILE, KEPT_S, Kept, PlaceKeeper, read_kept, start_last
from echostep_app.session.metadata import parse_start, run_metadata
from echostep_app.session.runs.live import _last_start
from echostep_simulation.world.tower import tower
from snapshots import expect, refusal

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


@pytest.mark.parametrize("left", [b"", b"\0" * 40, b'{"utc": "2026-11', None], ids=str)
def test_a_damaged_place_is_put_aside_and_the_building_is_searched(
    tmp_path: Path, left: bytes | None, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / FILE
    path.mkdir() if left is None else path.write_bytes(left)
    assert _last_start(tmp_path, PLAN, BOARD, Settings()) == Start()
    assert f"kept as {FILE}.damaged; the whole building is searched" in capfd.readouterr().err


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


def test_what_is_no_last_place_is_told(tmp_path: Path) -> None:
    said = {
        "another plan": refusal(lambda: start_last(KEPT, tower(2), BOARD, ClimbSettings(), NOW)),
        "no file": refusal(lambda: read_kept(tmp_path)),
        "in a replay": refusal(lambda: parse_start("last", None, PLAN)),
    }
    for text in ("", "[]", "{", "3", "\x00" * 9):
        (tmp_path / FILE).write_text(text)
        assert said.setdefault("another file", sentence := refusal(lambda: read_kept(tmp_path))) == sentence
    expect("start last", said, FOLDER=tmp_path)


@pytest.mark.parametrize("board", [BOARD, "another"])
def test_a_replay_begins_as_the_run_did(board: str) -> None:
    start, _ = start_last(KEPT, PLAN, board, ClimbSettings(), NOW)
    assert recorded_start(run_metadata(PLAN, start, 0, ""), Path("walk.mcap")) == start


@pytest.mark.slow
def test_a_tracker_of_a_last_place_searches_the_building() -> None:
    start, _ = start_last(KEPT, PLAN, BOARD, ClimbSettings(), NOW)
    assert isinstance(start, Start)
    tracker = Tracker(PLAN, start)
    tracker.warm_up()
    assert tracker.last_place() is None


PATH = Path("walk.mcap")
AFTER_PAUSE = Start(Pose(1.0, 2.0, 0.5, 1), 0.3, math.pi, air=Air(12.0, 0.4), after_pause=True)
ROOM = Start(room_m=np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]]), level=2)


@pytest.mark.parametrize("start", [Pose(1.0, 2.0, 0.5, 1), Start(Pose(1.0, 2.0, 0.5), 0.3, 0.2), AFTER_PAUSE])
def test_a_start_is_read_as_it_was_written(start: Pose | Start) -> None:
    assert recorded_start(run_metadata(NO_PLAN, start, 1, ""), PATH) == start


def test_a_room_is_read_as_it_was_written() -> None:
    read = recorded_start(run_metadata(NO_PLAN, ROOM, 1, ""), PATH)
    assert isinstance(read, Start)
    assert read.level == 2
    np.testing.assert_array_equal(read.room_m, ROOM.room_m)


@pytest.mark.parametrize(
    ("start", "damage"),
    [
        *((Pose(1.0, 2.0, 0.5), {"start_x_y_rad": text}) for text in ("", "1,2", "nan,0,0", "0,inf,0", "1e300,0,0", "0,0,0,inf", "[" * 5000)),
        *((AFTER_PAUSE, {"start_sd_m_rad": text}) for text in ("0.1", "nan,0.1", "0.1,inf", "-0.1,0.1")),
        *(
            (AFTER_PAUSE, {"start_after_pause": json.dumps({"air": air})})
            for air in (3, {"zero_m": 1.0}, *({"zero_m": v, "sd_m": 0.1} for v in (math.nan, math.inf, 1e300)))
        ),
        *((AFTER_PAUSE, {"start_after_pause": json.dumps({"air": {"zero_m": 1.0, "sd_m": v}})}) for v in (math.nan, -1.0)),
        (ROOM, {"start_room": "[" * 5000}),
        *((ROOM, {"start_room": json.dumps({"outline_m": o})}) for o in ([[math.nan, 0.0]], [[1.0]], "wall", [[1e300, 0.0]])),
    ],
    ids=str,
)  # fmt: skip
def test_a_damaged_start_is_refused(start: Pose | Start, damage: dict[str, str]) -> None:
    with pytest.raises(EchostepError, match="its recorded start is damaged: give one with --start"):
        recorded_start(run_metadata(NO_PLAN, start, 1, "") | damage, PATH)
