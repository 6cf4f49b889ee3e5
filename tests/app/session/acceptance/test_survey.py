# SPDX-License-Identifier: MIT
"""Points of a corridor and of a file, the visits, and what cannot be surveyed."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep_app.session.acceptance.protocol import recorded_protocol
from echostep_app.session.acceptance.survey import corridor, surveyed
from walks import DEMO


def test_a_corridor_has_its_points_along_the_middle() -> None:
    protocol = corridor("20x2.1")
    assert [(p.name, p.x_m, p.y_m) for p in protocol.points] == [
        ("1", 1.0, 1.05),
        ("2", 5.5, 1.05),
        ("3", 10.0, 1.05),
        ("4", 14.5, 1.05),
        ("5", 19.0, 1.05),
    ]
    plan = protocol.plan()
    assert plan.start is not None
    assert (plan.start.x_m, plan.start.y_m, plan.start.heading_rad) == (1.0, 1.05, 0.0)
    assert plan.levels[0].walls.tolist() == [[0, 0, 20, 0], [20, 0, 20, 2.1], [20, 2.1, 0, 2.1], [0, 2.1, 0, 0]]
    again, on = recorded_protocol(protocol.metadata, Path("w.mcap"))
    assert (again, on.digest) == (protocol, plan.digest)


def test_rounds_alternate_between_standing_and_passing() -> None:
    visits = corridor("20x2").visits(2)
    assert [v.point for v in visits] == [0, 1, 2, 3, 4, 3, 2, 1, 0, 1, 2, 3, 4, 3, 2, 1, 0]
    assert [v.standing for v in visits] == 9 * [True] + 8 * [False]


@pytest.mark.parametrize("text", ["6x1", "20x2", "200x20"])
def test_half_an_hour_is_about_half_an_hour(text: str) -> None:
    protocol = corridor(text)
    rounds = protocol.rounds_of(1800.0)
    walk_s = rounds * 2.0 * (protocol.points[-1].x_m - 1.0) / 1.2  # at 1.2 m/s
    stops_s, turns_s = 0.5 * rounds * 8 * 4.0, rounds * 2 * 6.0
    assert rounds % 2 == 0
    assert walk_s + stops_s + turns_s == pytest.approx(1800.0, rel=0.2)


@pytest.mark.parametrize(
    "text", ["", "20", "20x", "5x2", "20x0.5", "201x2", "20x21", "1e2x2", "nanx2", "-20x2", "20x2x2", "20.0001x2"]
)
def test_a_corridor_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(EchostepError, match="expected LENGTHxWIDTH"):
        corridor(text)


def test_points_beside_a_plan(tmp_path: Path) -> None:
    path = tmp_path / "points.csv"
    path.write_text("name,x_m,y_m,level\ndoor,2,7.5,0\nstairs,9.5,7.5,Ground floor\n")
    plan = load_plan(DEMO)
    path.write_text(path.read_text().replace("Ground floor", plan.levels[0].name))
    protocol = surveyed(DEMO, path)
    assert [(p.name, p.level) for p in protocol.points] == [("door", 0), ("stairs", 0)]
    start = protocol.plan().start
    assert start is not None
    assert math.isclose(start.heading_rad, 0.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name,x_m\na,1\nb,2\n", "points.csv:1: no column y_m"),
        ("name,x_m,y_m\na,1,2\n", "1 points, expected 2 to 100"),
        ("name,x_m,y_m\na,1,2\nb,x,2\n", "points.csv:3: column x_m: 'x' is not a number"),
        ("name,x_m,y_m,level\na,1,2,0\nb,1,2,7\n", "points.csv:3: column level: '7' is no level of the plan"),
        ("name,x_m,y_m\na,1,2\n,1,2\n", "points.csv:3: not a point"),
        ("name,x_m,y_m\na,1,2\nb,1e12,2\n", "points.csv:3: not a point"),
    ],
)
def test_a_file_of_points_is_refused_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "points.csv"
    path.write_text(text)
    with pytest.raises(EchostepError) as error:
        surveyed(DEMO, path)
    assert said in str(error.value)
