# SPDX-License-Identifier: MIT
"""Times of tracks: seconds, milliseconds, microseconds and nanoseconds, by name, by date, by speed; and trajectories of TUM."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from echostep.errors import EchostepError
from echostep_app.scorecard.card import score
from echostep_app.scorecard.track_columns import TIME_UNITS, load_path

NOW_S = 1_700_000_000  # November 2023
SECONDS = np.arange(0.0, 20.0, 0.1)


def track(path: Path, column: str, unit: str, *, begin_s: float = 0.0, speed_m_s: float = 1.0) -> Path:
    """A walk of 20 s along x."""
    times = [begin_s + t for t in SECONDS.tolist()]
    per_second = round(1 / TIME_UNITS[unit])
    written = [
        repr(t) if unit == "s" else str(int(begin_s) * per_second + round((t - begin_s) * per_second)) for t in times
    ]
    rows = [f"{t},{speed_m_s * x:.4f},0" for t, x in zip(written, SECONDS.tolist(), strict=True)]
    path.write_text("\n".join([f"{column},x,y", *rows]) + "\n")
    return path


@pytest.mark.parametrize("begin_s", [0, NOW_S])
@pytest.mark.parametrize("unit", list(TIME_UNITS))
def test_times_are_read_in_their_unit(tmp_path: Path, unit: str, begin_s: int) -> None:
    """Named without a unit: since 1970 by their size, else by the speed of the walk."""
    read = load_path(track(tmp_path / "a.csv", "timestamp", unit, begin_s=begin_s), None)
    assert read.time_unit == unit
    assert read.t_s[-1] - read.t_s[0] == pytest.approx(19.9, abs=1e-6)
    assert read.t_s[0] == pytest.approx(begin_s)
    assert ("timestamp in " in read.described()) == (unit != "s")


@pytest.mark.parametrize(("column", "unit"), [("t_s", "s"), ("time_s", "s"), ("timestamp_ms", "ms"), ("t_ns", "ns")])
def test_a_unit_in_the_name_holds(tmp_path: Path, column: str, unit: str) -> None:
    assert load_path(track(tmp_path / "a.csv", column, unit, speed_m_s=0.0), None).time_unit == unit


@pytest.mark.parametrize("speed_m_s", [0.0, 0.01, 1.0, 30.0])
def test_seconds_stay_seconds(tmp_path: Path, speed_m_s: float) -> None:
    """Standing, creeping, walking, driving."""
    assert load_path(track(tmp_path / "a.csv", "time", "s", speed_m_s=speed_m_s), None).time_unit == "s"


TUM = ["1000.0 0 0 1 0 0 0 1", "1000.5 0.5 0 1 0 0 0 1", "# a comment", "1001.0 1 0.25 1 0 0 0 1"]


@pytest.mark.parametrize(
    "head",
    [
        [],
        ["# timestamp tx ty tz qx qy qz qw"],
        ["timestamp tx ty tz qx qy qz qw"],
        ["# ground truth trajectory", "# file: 'a.bag'"],
    ],
)
def test_trajectories_of_tum(tmp_path: Path, head: list[str]) -> None:
    """With and without a line of names; evo writes them so."""
    (tmp_path / "a.txt").write_text("\n".join([*head, *TUM]) + "\n")
    read = load_path(tmp_path / "a.txt", None)
    assert read.t_s.tolist() == [1000.0, 1000.5, 1001.0]
    assert read.xy_m.tolist() == [[0, 0], [0.5, 0], [1, 0.25]]
    assert read.height_m is not None
    assert read.height_m.tolist() == [1, 1, 1]


def test_a_wrong_line_of_a_trajectory_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text("\n".join([TUM[0], "1001.0 1 0"]) + "\n")
    with pytest.raises(EchostepError, match=r"a.txt:2: 3 cells, but 8 columns"):
        load_path(tmp_path / "a.txt", None)


def test_comments_above_the_names(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("# made by: a tracker, today\n# t_s, x_m, y_m\n0,1,2\n1,x,2\n")
    with pytest.raises(EchostepError, match=r"a.csv:4: column x_m: 'x' is not a number"):
        load_path(tmp_path / "a.csv", None)


def test_another_clock_and_other_names_are_told_with_the_next_step(tmp_path: Path) -> None:
    """A truth of EuRoC, in nanoseconds; its column named t_s; its places named by another name."""
    ours = load_path(track(tmp_path / "a.csv", "t_s", "s", begin_s=NOW_S), None)
    true = track(tmp_path / "b.csv", "#timestamp", "ns", begin_s=NOW_S)
    text = true.read_text().replace("x,y", "p_RS_R_x [m], p_RS_R_y [m]")
    true.write_text(text)
    assert score(ours, load_path(true, None)).ce50_m == pytest.approx(0.0, abs=1e-6)
    true.write_text(text.replace("#timestamp", "t_s"))
    with pytest.raises(EchostepError, match=r"same clock; those of .*b.csv would be in ns: name its column t_s t_ns"):
        score(ours, load_path(true, None))
    true.write_text(text.replace("p_RS_R_x", "px"))
    with pytest.raises(EchostepError, match=r"b.csv:1: no column for x: .*; there are timestamp, px \[m\], p_RS"):
        load_path(true, None)
