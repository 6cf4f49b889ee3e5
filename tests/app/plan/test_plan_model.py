# SPDX-License-Identifier: MIT
"""Plans: what is read, the one line that a wrong file gets, and the published schema, which says what the reader does."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.plan import Connector, Door, Georeference, Level, Plan, Pose, Question, Room, load_plan, parse_plan
from echostep_app.plan.writer import plan_json, save_plan

GOOD: dict[str, Any] = {
    "echostep_plan": 1,
    "name": "one room",
    "levels": [
        {"name": "ground", "height_m": 0, "walls": [[0, 0, 4, 0], [4, 0, 4, 3]], "rooms": [{"name": "A", "at": [2, 1]}]}
    ],
    "start": {"x": 1, "y": 1, "heading_deg": 90},
}

FULL: dict[str, Any] = GOOD | {
    "levels": [
        {
            "name": "ground",
            "height_m": 0,
            "walls": [[0, 0, 4, 0], [4, 0, 4, 3]],
            "windows": [[0, 3, 4, 3]],
            "doors": [{"line": [0, 1, 0, 2], "state": "open", "name": "street"}, {"line": [0, 0, 0, 1]}],
            "obstacles": [[[1, 1], [2, 1], [2, 2], [1, 1]]],
            "place_sd": [[2, 0, 0.2], [4, 1.5, 0.3]],
            "rooms": [{"name": "A", "at": [2, 1], "outline": [[0, 0], [4, 0], [4, 3], [0, 3]]}],
            "questions": [
                {"text": "a door?", "about": "door", "at": [0, 1], "lines": [[0, 1, 0, 2]], "proposed": True},
                {"text": "open?", "about": "room", "at": [2, 1]},
            ],
        },
        {"name": "first", "height_m": 3.5, "walls": [], "rooms": []},
    ],
    "connectors": [{"kind": "stairs", "name": "S", "levels": ["first", 0], "outline": [[3, 0], [4, 0], [4, 1]]}],
    "georeference": {"crs": "EPSG:4326", "origin": [-2.978, 56.46], "rotation_deg": 12.5},
    "uncertainty_m": 0.05,
    "picture": [0.02, 1, -3],
    "start": {"x": 1, "y": 1, "heading_deg": 90, "level": "first"},
}


def write(folder: Path, tree: object) -> Path:
    path = folder / "plan.json"
    path.write_text(tree if isinstance(tree, str) else json.dumps(tree))
    return path


CORNERS = [[0, 0], [1, 0], [1, 1]]
WRONG: list[tuple[dict[str, Any], str]] = [
    ({"echostep_plan": 2}, "echostep_plan"),
    ({"levels": []}, "levels"),
    ({"levels": [{"walls": 3}]}, r"levels\[0\].walls"),
    ({"levels": [{"walls": [[0, 0, 1]]}]}, r"levels\[0\].walls\[0\]"),
    ({"levels": [{"walls": [[0, 0, 1, 1], [0, 0, "a", 1]]}]}, r"levels\[0\].walls\[1\]"),
    ({"levels": [{"walls": [[1, 1, 1, 1]]}]}, "without length"),
    ({"levels": [{"walls": [[0, 0, 1e30, 1]]}]}, "finite"),
    ({"levels": [{"walls": [[0, 0, True, 1]]}]}, "finite"),
    ({"levels": [{"walls": [[0, 0, "\ud800", 1]]}]}, r"'\\ud800' is not a text"),
    ({"start": {"x": 1, "y": 2}}, "start.heading_deg|None"),
    (
        {"levels": [{"walls": [], "questions": [{"text": "?", "about": "cat", "at": [0, 0]}]}]},
        "one of door, wall, room",
    ),
    ({"levels": [{"walls": [], "questions": [{"text": "?", "about": "door", "at": [0]}]}]}, r"questions\[0\].at"),
    ({"start": []}, "start"),
    ({"name": 4}, "name"),
    ({"name": "\ud800"}, "name"),
    ({"levels": [{"walls": [], "doors": [{"line": [0, 0, 0, 0]}]}]}, r"levels\[0\].doors\[0\].line"),
    ({"levels": [{"walls": [], "doors": [{"line": [0, 0, 0, 1], "state": "ajar"}]}]}, r"doors\[0\].state"),
    ({"levels": [{"walls": [], "windows": [[0, 0, 0]]}]}, r"windows\[0\]"),
    ({"levels": [{"walls": [], "obstacles": [[[0, 0], [1, 1], [0, 0]]]}]}, r"obstacles\[0\]"),
    ({"levels": [{"walls": [[0, 0, 1, 10**400]]}]}, r"walls\[0\]\[3\]: a huge number is not a finite"),
    ({"connectors": [{"kind": "lift", "outline": CORNERS}]}, r"connectors\[0\].levels: missing"),
    (
        {"connectors": [{"kind": "hole", "levels": [0, 1], "outline": CORNERS}]},
        r"kind: 'hole' is not one of stairs, lift",
    ),
    ({"connectors": [{"kind": "lift", "levels": ["ground", "roof"], "outline": CORNERS}]}, "no level is named 'roof'"),
    ({"connectors": [{"kind": "lift", "levels": [0, 1], "outline": CORNERS}]}, "from 0 to 0"),
    (
        {"connectors": [{"kind": "lift", "levels": [0, True], "outline": CORNERS}]},
        r"levels\[1\]: True is not the name or",
    ),
    ({"connectors": [{"kind": "lift", "levels": [0, 0], "outline": CORNERS}]}, "two levels"),
    (
        {"connectors": [{"kind": "lift", "levels": [0, 0]}]},
        r"connectors\[0\].outline: missing, expected a list of corners",
    ),
    ({"start": {"x": 1, "y": 2, "heading_deg": 0, "level": 1}}, "start.level"),
    ({"georeference": {"origin": [0, 91]}}, "georeference.origin"),
    ({"georeference": {"origin": [0]}}, "georeference.origin"),
    ({"georeference": {"origin": [0, 9], "rotation_deg": "north"}}, "georeference.rotation_deg"),
    ({"uncertainty_m": -1}, "uncertainty_m"),
    ({"picture": [0, 1, 1]}, r"picture\[0\]: 0 is not metres a pixel"),
    ({"picture": [0.1, 1]}, "picture"),
    ({"levels": [{"walls": [], "place_sd": [[0, 0, -1]]}]}, r"place_sd\[0\]\[2\]"),
]


@pytest.mark.parametrize(("change", "named"), WRONG)
def test_a_wrong_field_is_named(tmp_path: Path, change: dict[str, Any], named: str) -> None:
    path = write(tmp_path, GOOD | change)
    with pytest.raises(EchostepError, match=named) as caught:
        load_plan(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "[", "[]", "3", '{"echostep_plan": NaN}', "[" * 100_000])
def test_no_plan_at_all(tmp_path: Path, text: str) -> None:
    with pytest.raises(EchostepError, match="plan"):
        load_plan(write(tmp_path, text))


def test_all_fields(tmp_path: Path) -> None:
    plan = load_plan(write(tmp_path, FULL))
    ground = plan.levels[0]
    assert [room.name for room in ground.rooms] == ["A"]
    assert ground.doors == (Door((0, 1, 0, 2), "open", "street"), Door((0, 0, 0, 1), "unknown", ""))
    assert ground.doors[0].width_m == 1.0
    assert len(ground.obstacles[0]) == 3
    assert ground.solid.tolist() == [
        *([0, 0, 4, 0], [4, 0, 4, 3]),
        [0, 3, 4, 3],
        *([1, 1, 2, 1], [2, 1, 2, 2], [2, 2, 1, 1]),
    ]
    assert plan.connectors[0].levels == (0, 1)
    assert plan.start == Pose(1, 1, math.radians(90), 1)
    assert plan.georeference == Georeference(-2.978, 56.46, math.radians(12.5), "EPSG:4326")
    assert plan.uncertainty_m == 0.05
    assert ground.questions == (
        Question("a door?", "door", (0, 1), ((0, 1, 0, 2),), is_proposed=True),
        Question("open?", "room", (2, 1)),
    )


def same(one: Plan, other: Plan) -> None:
    """Everything but the digest, to the last bit."""
    assert (one.name, one.start, one.georeference) == (other.name, other.start, other.georeference)
    assert (one.uncertainty_m, one.picture) == (other.uncertainty_m, other.picture)
    assert len(one.levels) == len(other.levels)
    assert len(one.connectors) == len(other.connectors)
    for a, b in zip(one.levels, other.levels, strict=True):
        assert (a.name, a.height_m, a.rooms, a.doors) == (b.name, b.height_m, b.rooms, b.doors)
        assert all(same_array(p.outline_m, q.outline_m) for p, q in zip(a.rooms, b.rooms, strict=True))
        assert a.questions == b.questions
        assert same_array(a.walls, b.walls)
        assert same_array(a.windows, b.windows)
        assert same_array(a.doubtful, b.doubtful)
        assert same_array(a.place_sd, b.place_sd)
        assert all(same_array(p, q) for p, q in zip(a.obstacles, b.obstacles, strict=True))
    for p, q in zip(one.connectors, other.connectors, strict=True):
        assert (p.kind, p.name, p.levels) == (q.kind, q.name, q.levels)
        assert same_array(p.outline_m, q.outline_m)


def same_array(one: Any, other: Any) -> bool:
    return (one is None and other is None) or bool(np.array_equal(one, other))


def test_what_is_saved_is_read_back(tmp_path: Path) -> None:
    plan = load_plan(write(tmp_path, FULL))
    save_plan(plan, tmp_path / "again.json")
    same(plan, load_plan(tmp_path / "again.json"))
    with pytest.raises(EchostepError, match="cannot write"):
        save_plan(plan, tmp_path / "none" / "again.json")


METRES = st.floats(-1e5, 1e5)
SEGMENTS = st.lists(st.tuples(METRES, METRES, METRES, METRES).filter(lambda s: s[:2] != s[2:]), max_size=4)
TEXTS = st.text(st.characters(exclude_categories=["Cs", "Cc", "Cn"]), max_size=8)  # XML has no control characters
OUTLINES = st.lists(st.tuples(METRES, METRES), min_size=3, max_size=6, unique=True).map(np.array)
DOORS = st.builds(Door, SEGMENTS.filter(bool).map(lambda rows: rows[0]), st.sampled_from(("open", "closed")), TEXTS)
ROOMS = st.builds(Room, TEXTS, st.tuples(METRES, METRES), st.none() | OUTLINES)
LEVELS = st.builds(
    Level,
    TEXTS,
    METRES,
    SEGMENTS.map(lambda rows: np.array(rows).reshape(-1, 4)),
    st.lists(ROOMS, max_size=2).map(tuple),
    st.lists(DOORS, max_size=2).map(tuple),
    SEGMENTS.map(lambda rows: np.array(rows).reshape(-1, 4)),
    st.lists(OUTLINES, max_size=2).map(tuple),
)

DEGREES = st.floats(-360, 360).map(math.radians)
PLANS = st.builds(
    Plan,
    TEXTS,
    st.tuples(LEVELS, LEVELS),
    st.none() | st.builds(Pose, METRES, METRES, DEGREES, st.integers(0, 1)),
    st.just(""),
    st.lists(
        st.builds(Connector, st.sampled_from(("stairs", "lift")), TEXTS, st.just((0, 1)), OUTLINES), max_size=2
    ).map(tuple),
    st.none() | st.builds(Georeference, st.floats(-180, 180), st.floats(-90, 90), DEGREES),
    st.none() | st.floats(0, 10),
    st.none() | st.tuples(st.floats(1e-6, 1e4), METRES, METRES),
)


@pytest.mark.slow
@given(PLANS)
@settings(max_examples=100, deadline=None)
def test_any_plan_is_read_back(plan: Plan) -> None:
    same(plan, parse_plan(plan_json(plan).encode()))


@pytest.mark.long
def test_a_million_walls_open(tmp_path: Path) -> None:
    rows = ",\n".join(str(row) for row in np.random.default_rng(1).uniform(0, 1000, (1000, 4)).round(3).tolist())
    text = '{"echostep_plan": 1, "levels": [{"walls": [' + ",".join([rows] * 1000) + "]}]}"
    (tmp_path / "city.json").write_text(text)
    walls = load_plan(tmp_path / "city.json").levels[0].walls
    assert walls.shape == (1_000_000, 4)
    assert np.array_equal(walls[:1000], walls[-1000:])


SCHEMA = json.loads((ROOT / "host/core/echostep/plans/plan.schema.json").read_text())
VALID = Draft202012Validator(SCHEMA)
BEYOND = {"without length", r"levels\[0\].doors\[0\].line", r"obstacles\[0\]"}  # what a schema cannot say
NAMES = {"connectors", "start"}  # refer to levels, which a schema cannot follow


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("path", sorted((ROOT / "host/core/echostep/plans").glob("*.json")), ids=lambda path: path.name)
def test_plans_of_the_package(path: Path) -> None:
    if path.name != "plan.schema.json":
        VALID.validate(json.loads(path.read_text()))
        parse_plan(path.read_bytes())


def test_good_plans() -> None:
    VALID.validate(GOOD)
    VALID.validate(FULL)


@pytest.mark.slow
@given(PLANS)
@settings(max_examples=50, deadline=None)
def test_what_is_saved_is_valid(plan: Plan) -> None:
    VALID.validate(json.loads(plan_json(plan)))


@pytest.mark.parametrize(
    ("change", "named"),
    [case for case in WRONG if case[1] not in BEYOND and case[0].get("name") != "\ud800" and not set(case[0]) & NAMES],
)
def test_what_the_reader_refuses_is_invalid(change: dict[str, Any], named: str) -> None:
    assert not VALID.is_valid(GOOD | change), named
