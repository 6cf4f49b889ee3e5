"""Plans: what is read, and the one line that a wrong file gets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan

GOOD: dict[str, Any] = {
    "echostep_plan": 1,
    "name": "one room",
    "levels": [
        {"name": "ground", "height_m": 0, "walls": [[0, 0, 4, 0], [4, 0, 4, 3]], "rooms": [{"name": "A", "at": [2, 1]}]}
    ],
    "start": {"x": 1, "y": 1, "heading_deg": 90},
}


def write(folder: Path, tree: object) -> Path:
    path = folder / "plan.json"
    path.write_text(tree if isinstance(tree, str) else json.dumps(tree))
    return path


def test_a_good_plan(tmp_path: Path) -> None:
    plan = load_plan(write(tmp_path, GOOD))
    assert plan.levels[0].walls.shape == (2, 4)
    assert plan.start is not None
    assert plan.start.heading_rad == pytest.approx(1.5707963)
    assert plan.levels[0].rooms[0].name == "A"


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"echostep_plan": 2}, "echostep_plan"),
        ({"levels": []}, "levels"),
        ({"levels": [{"walls": 3}]}, r"levels\[0\].walls"),
        ({"levels": [{"walls": [[0, 0, 1]]}]}, r"levels\[0\].walls\[0\]"),
        ({"levels": [{"walls": [[0, 0, 1, 1], [0, 0, "a", 1]]}]}, r"levels\[0\].walls\[1\]"),
        ({"levels": [{"walls": [[1, 1, 1, 1]]}]}, "without length"),
        ({"levels": [{"walls": [[0, 0, 1e30, 1]]}]}, "finite"),
        ({"levels": [{"walls": [[0, 0, True, 1]]}]}, "finite"),
        ({"start": {"x": 1, "y": 2}}, "start.heading_deg|None"),
        ({"start": []}, "start"),
        ({"name": 4}, "name"),
    ],
)
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


def test_nan_walls_are_refused(tmp_path: Path) -> None:
    text = json.dumps(GOOD).replace("[0, 0, 4, 0]", "[0, 0, NaN, 0]")
    with pytest.raises(EchostepError, match="finite"):
        load_plan(write(tmp_path, text))


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match="cannot read"):
        load_plan(tmp_path / "none.json")
