# SPDX-License-Identifier: MIT
"""Plans, settings and tables that would cost hours, gigabytes or a crash: one clear error; Ctrl-C ends an import."""

from __future__ import annotations

import json
import math
import os
import signal
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan, parse_plan
from echostep.recording import open_parts
from echostep.settings import parse_settings, read_settings
from echostep_app.offline.foot_files import load_foot
from echostep_app.offline.leg_csv import load_legs
from echostep_app.plan.check import check_plan
from echostep_app.plan.importers import limited
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.imdf.archive import FREE_BYTES, MOST_FILES, MOST_RATIO, Archive
from echostep_app.plan.importers.limited import import_limited, open_limited
from echostep_app.plan.importers.parsing import LARGEST_BYTES
from echostep_app.plan.writer import plan_json, save_plan
from echostep_app.scorecard.track_columns import load_path
from echostep_app.scorecard.truth import load_truth
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from plan.imported_plans import imported_file
from recording.damages import write_recording
from walks import DEMO, PLAN, walk_chunks

SQUARE = ((0, 0, 4, 0), (4, 0, 4, 4), (4, 4, 0, 4), (0, 4, 0, 0))


def drawing(path: Path, *more: str) -> Path:
    """A square of walls in millimetres, and other entities on the layer of walls."""
    lines = [
        f"0\nLINE\n8\nWalls\n10\n{1000 * a}\n20\n{1000 * b}\n11\n{1000 * c}\n21\n{1000 * d}\n" for a, b, c, d in SQUARE
    ]
    head = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    path.write_text(head + "".join(lines) + "".join(more) + "0\nENDSEC\n0\nEOF\n")
    return path


def arc(radius: str) -> str:
    return f"0\nARC\n8\nWalls\n10\n0.0\n20\n0.0\n40\n{radius}\n50\n0.0\n51\n90.0\n"


def test_unknown_entities_are_left_out(tmp_path: Path) -> None:
    plan, report = imported_file(drawing(tmp_path / "a.dxf", "0\nAEC_WALL\n5\n99\n8\nWalls\n10\n1.0\n"))
    assert len(plan.levels[0].walls) == len(SQUARE)
    assert sum("AEC_WALL" in what for what in report.left_out) == 1


@pytest.mark.parametrize("radius", ["1e300", "1e15", "1e12"])
def test_an_arc_larger_than_the_earth_is_refused_at_once(tmp_path: Path, radius: str) -> None:
    with pytest.raises(EchostepError, match=r"ARC is 100 km away"):
        import_plan(drawing(tmp_path / "a.dxf", arc(radius)))


def test_a_zip_that_unpacks_a_hundredfold_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("level.geojson", b" " * (FREE_BYTES + 4 * MOST_RATIO * 8192))
        packed.writestr("unit.geojson", b"{}")
    with Archive(tmp_path / "a.zip") as archive:
        assert archive.text("unit.geojson") == "{}"
        with pytest.raises(EchostepError, match=r"level\.geojson: unpacks to more than"):
            archive.text("level.geojson")


def test_a_zip_of_too_many_files_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as packed:
        for k in range(MOST_FILES + 1):
            packed.writestr(f"{k}.geojson", b"")
    with pytest.raises(EchostepError, match=r"a\.zip: the zip file has 1001 files; expected 1000 at most"):
        import_plan(tmp_path / "a.zip")


@pytest.mark.parametrize("suffix", ["dxf", "osm", "geojson"])
def test_a_file_too_large_to_be_one_building_is_not_read(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    path.touch()
    os.truncate(path, LARGEST_BYTES + 1)
    with pytest.raises(EchostepError, match=rf"a\.{suffix}: larger than 512 MiB"):
        import_plan(path)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (json.dumps({"echostep_plan": 1, "levels": [{"walls": [[0, 0, 100_001, 0]]}]}), "within 100000 m"),
        ('{"echostep_plan": 1, "levels": ' + "[" * 100_000 + "]" * 100_000 + "}", "nested too deep"),
        ('{"echostep_plan": 1, "name": ' + "9" * 5000 + "}", "too many digits"),
        (
            '{"echostep_plan": 1, "levels": [{"walls": [], "rooms": [], "walls": [[0, 0, 1, 0]]}]}',
            "'walls' stands twice",
        ),
    ],
    ids=["far", "deep", "long", "twice"],
)
def test_a_plan_that_is_too_wide_or_too_deep_is_one_error(tmp_path: Path, text: str, named: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(EchostepError, match=named):
        load_plan(tmp_path / "a.json")


def plan_file(path: Path, obstacle: list[list[float]]) -> Path:
    level = {"walls": SQUARE, "obstacles": [obstacle], "rooms": [{"name": "r", "at": [3, 1]}]}
    path.write_text(json.dumps({"echostep_plan": 1, "levels": [level]}))
    return path


def test_repeated_corners_are_one(tmp_path: Path) -> None:
    plan = load_plan(plan_file(tmp_path / "a.json", [[1, 1], [2, 1], [2, 1], [2, 2], [1, 2], [1, 2], [1, 1]]))
    assert plan.levels[0].obstacles[0].tolist() == [[1, 1], [2, 1], [2, 2], [1, 2]]
    check_plan(plan)


def test_an_obstacle_of_a_million_corners_is_named(tmp_path: Path) -> None:
    corners = [[math.cos(k), math.sin(k)] for k in range(10_001)]
    with pytest.raises(EchostepError, match=r"obstacles\[0\]: 10001 corners, expected 10000 at most"):
        load_plan(plan_file(tmp_path / "a.json", corners))


@pytest.mark.process
def test_an_import_in_its_own_process_gives_the_same_plan_and_the_same_errors(tmp_path: Path) -> None:
    file = drawing(tmp_path / "a.dxf")
    assert plan_json(open_limited(file)) == plan_json(import_plan(file))
    with pytest.raises(EchostepError, match=r"b\.osm: no such file"):
        open_limited(tmp_path / "b.osm")


@pytest.mark.process
def test_an_import_that_takes_too_long_or_crashes_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limited, "CHILD", "import time; time.sleep(60)")
    monkeypatch.setattr(limited, "LONGEST_S", 0.2)
    with pytest.raises(EchostepError, match="takes longer"):
        import_limited(tmp_path / "a.dxf")
    monkeypatch.setattr(limited, "LONGEST_S", 60.0)
    monkeypatch.setattr(limited, "CHILD", "import os; os.abort()")
    with pytest.raises(EchostepError, match=r"a\.dxf: the import failed"):
        import_limited(tmp_path / "a.dxf")
    monkeypatch.setattr(
        limited, "CHILD", "from echostep_app.plan.importers import limited as l; l._limit_memory(); bytes(5 << 30)"
    )
    with pytest.raises(EchostepError, match="MemoryError"):
        import_limited(tmp_path / "a.dxf")


@pytest.mark.process
def test_ctrl_c_ends_an_import_and_its_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limited, "CHILD", "import time; time.sleep(600)")
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    try:
        with pytest.raises(KeyboardInterrupt):
            import_limited(tmp_path / "a.dxf")  # returns once its process has ended
    finally:
        signal.signal(signal.SIGALRM, before)


DEEP = "a=" + "[" * 5000


@pytest.mark.parametrize(("left", "why"), [(b"", "an empty file"), (b"\xff\0", "not UTF-8"), (None, "Is a directory")])
def test_settings_that_a_power_failure_left_are_named(tmp_path: Path, left: bytes | None, why: str) -> None:
    path = tmp_path / "s.toml"
    path.mkdir() if left is None else path.write_bytes(left)
    with pytest.raises(EchostepError, match=rf"s\.toml: .*{why}"):
        read_settings(path)


@pytest.mark.parametrize("left", [b"", b"\0" * 40, b"\xff\0"])
def test_a_truth_that_a_power_failure_left_is_named(tmp_path: Path, left: bytes) -> None:
    (tmp_path / "truth.csv").write_bytes(left)
    with pytest.raises(EchostepError, match=r"truth\.csv") as caught:
        load_truth(tmp_path / "truth.csv", None)
    assert "\n" not in str(caught.value)


def test_settings_nested_too_deeply_are_one_error(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match=r"deep\.toml: its values are nested too deeply"):
        parse_settings(DEEP, "deep.toml")
    write_recording(tmp_path / "a.mcap", walk_chunks(1.0), {"settings_toml": DEEP})
    with pytest.raises(EchostepError, match=r"a\.mcap: its values are nested too deeply"):
        tracker_of(open_parts([tmp_path / "a.mcap"]), PLAN, TrackingOptions(DEMO))


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
    save_plan(replace(PLAN, name="a\x07b\x1b[2J"), tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json").name == "a b [2J"
