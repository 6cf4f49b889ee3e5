# SPDX-License-Identifier: MIT
"""Files of users and strangers: nested without end, with numbers no walk has, columns given twice, names that control: one error each."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan, parse_plan
from echostep.recording import open_parts
from echostep.settings import parse_settings
from echostep_app.offline.foot_files import load_foot
from echostep_app.offline.leg_csv import load_legs
from echostep_app.plan.writer import save_plan
from echostep_app.recording.recorder import Recorder
from echostep_app.scorecard.track_columns import load_path
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from walks import DEMO, walk_chunks

DEEP = "a=" + "[" * 5000


def test_settings_nested_too_deeply_are_one_error(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"deep\.toml: its values are nested too deeply"):
        parse_settings(DEEP, "deep.toml")
    with Recorder(tmp_path / "a.mcap", {"settings_toml": DEEP}) as recorder:
        for chunk in walk_chunks(1.0):
            recorder.write(chunk)
    with pytest.raises(EchostepError, match=r"a\.mcap: its values are nested too deeply"):
        tracker_of(open_parts([tmp_path / "a.mcap"]), load_plan(DEMO), TrackingOptions(DEMO))


@pytest.mark.parametrize("number", ["1e308", "-1e308", "1.1e19"])
def test_a_number_that_no_track_has_is_named(tmp_path: Path, number: str) -> None:
    path = tmp_path / "s.csv"
    path.write_text(f"t_s,x_m,y_m\n1,{number},2\n2,1,1\n")
    with pytest.raises(EchostepError, match=r"s\.csv:2: column x_m: .* is greater than any number of a track, 1e\+19"):
        load_path(path, None)
    path.write_text(f"t_s,x_m,y_m,radius95_m\n1,1,2,{number}\n2,1,1,\n")
    with pytest.raises(EchostepError, match=r"s\.csv:2: column radius95_m"):
        load_path(path, None)


IMU = "t_s,ax,ay,az,gx,gy,gz,az\n" + "".join(f"{k / 100},0,0,9.8,0,0,0,1\n" for k in range(200))
LEGS = "t_s,thigh_rad_s,shank_rad_s,thigh_rad_s\n" + "".join(f"{k / 100},0.1,0.2,5\n" for k in range(200))
TRACK = "t_s,x_m,X_m,y_m\n1,1,5,1\n2,2,9,2\n"


@pytest.mark.parametrize(
    ("text", "read", "name"),
    [(IMU, load_foot, "az"), (LEGS, load_legs, "thigh_rad_s"), (TRACK, lambda path: load_path(path, None), "x_m")],
)
def test_a_column_given_twice_is_named(tmp_path: Path, text: str, read: Callable[[Path], object], name: str) -> None:
    (tmp_path / "twice.csv").write_text(text)
    with pytest.raises(EchostepError, match=rf"twice\.csv.*two columns are named {name}"):
        read(tmp_path / "twice.csv")


def test_other_columns_may_be_given_twice(tmp_path: Path) -> None:
    (tmp_path / "s.csv").write_text("t_s,x_m,y_m,note,note\n1,1,1,a,b\n2,2,2,a,b\n")
    assert len(load_path(tmp_path / "s.csv", None).t_s) == 2


@pytest.mark.parametrize("letter", ["\x00", "\x07", "\x1b", "\x0c", "\uffff"])
@pytest.mark.parametrize("where", ["plan", "level", "room"])
def test_a_name_in_a_plan_that_no_file_can_hold_is_named(letter: str, where: str) -> None:
    """GPX, KML and SVG are XML, which has no control characters."""
    tree = json.loads(DEMO.read_text())
    owner = {"plan": tree, "level": tree["levels"][0], "room": tree["levels"][0]["rooms"][0]}[where]
    owner["name"] = f"a{letter}b"
    with pytest.raises(ValueError, match=r"name: .* is not a text without control characters"):
        parse_plan(json.dumps(tree).encode())


def test_a_name_of_two_lines_is_read() -> None:
    tree = json.loads(DEMO.read_text())
    tree["name"] = "two\nlines\tand a tab"
    assert parse_plan(json.dumps(tree).encode()).name == tree["name"]


def test_a_plan_is_written_without_what_none_can_hold(tmp_path: Path) -> None:
    """An imported file may have any names."""
    save_plan(replace(load_plan(DEMO), name="a\x07b\x1b[2J"), tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json").name == "a b [2J"
