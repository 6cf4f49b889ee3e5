# SPDX-License-Identifier: MIT
"""Importing WRLD indoor maps: westport-house, and what a damaged one gets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from board_runs import ROOT
from echostep.errors import EchostepError
from echostep.plan import Plan, load_plan
from echostep_app.plan.importers.formats import import_plan
from echostep_app.plan.importers.hints import Hints
from echostep_app.plan.writer import save_plan
from needs_data import data_or_skip


@pytest.fixture(scope="module")
def westport() -> Plan:
    return import_plan(data_or_skip("maps/westport-house"))


@pytest.mark.slow
def test_westport_has_seven_floors(westport: Plan) -> None:
    assert [level.height_m for level in westport.levels] == [0, 3.5, 7, 10.5, 14, 17.5, 21]
    assert westport.levels[2].name == "Second Floor"
    assert [len(level.doors) for level in westport.levels] == [36, 11, 25, 122, 114, 15, 10]
    assert all(100 < len(level.walls) < 1300 for level in westport.levels)
    assert {room.name for room in westport.levels[2].rooms} >= {"Kitchen", "Unit 3", "Balcony"}


@pytest.mark.slow
def test_westport_is_as_large_as_it_is(westport: Plan) -> None:
    """A degree is 111.32 km on a sphere; the ellipsoid differs by a third of a per cent."""
    x, y = westport.levels[0].walls.reshape(-1, 2).T
    assert np.ptp(x) == pytest.approx(58.9, rel=0.005)
    assert np.ptp(y) == pytest.approx(63.4, rel=0.005)


def test_westport_stairs_and_lifts_join_all_floors(westport: Plan) -> None:
    reached, kinds = {0}, {connector.kind for connector in westport.connectors}
    for _ in westport.levels:
        for connector in westport.connectors:
            reached |= set(connector.levels) if reached & set(connector.levels) else set()
    assert reached == set(range(7))
    assert kinds == {"stairs", "lift"}
    assert (0, 1, 2, 3, 4, 5, 6) in [c.levels for c in westport.connectors if c.kind == "stairs"]
    assert (0, 1, 3, 4, 5, 6) in [c.levels for c in westport.connectors if c.kind == "lift"]


def test_no_wall_runs_through_a_door_or_a_staircase(westport: Plan) -> None:
    for i, level in enumerate(westport.levels):
        walls = shapely.STRtree(shapely.linestrings(level.solid.reshape(-1, 2, 2)))
        for door in level.doors:
            middle = shapely.Point((door.line[0] + door.line[2]) / 2, (door.line[1] + door.line[3]) / 2)
            assert not len(walls.query(middle, "dwithin", 0.05)), (level.name, door)
        for connector in westport.connectors:
            if i in connector.levels:
                inside = shapely.Polygon(connector.outline_m).buffer(-0.1)
                assert not len(walls.query(inside, "intersects")), (level.name, connector.name)


def test_the_manual_counts_right(westport: Plan) -> None:
    walls, windows, doors = (
        sum(len(getattr(level, kind)) for level in westport.levels) for kind in ("walls", "windows", "doors")
    )
    said = f"{walls} walls, {windows} windows, {doors} doors and {len(westport.connectors)} stairs and lifts"
    page = (ROOT / "host/docs/plan.md").read_text()
    assert said in " ".join(page.split())


def test_what_is_saved_has_the_digest(westport: Plan, tmp_path: Path) -> None:
    save_plan(westport, tmp_path / "plan.json")
    assert load_plan(tmp_path / "plan.json").digest == westport.digest


SQUARE = [[[-3.0, 56.0], [-2.9999, 56.0], [-2.9999, 56.0001], [-3.0, 56.0001], [-3.0, 56.0]]]


def feature(kind: str, coordinates: Any = SQUARE, **about: Any) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": {"type": kind} | about,
        "geometry": {"type": "Polygon", "coordinates": coordinates},
    }


def write(folder: Path, features: Any, main: dict[str, Any] | None = None) -> Path:
    tree: dict[str, Any] = {
        "name": "House",
        "location": {"coordinates": [-3.0, 56.0]},
        "levels": [{"readable_name": "G", "z_order": 0, "filename": "g.geojson"}],
    }
    (folder / "main.json").write_text(json.dumps(tree | (main or {})))
    (folder / "g.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return folder


def test_a_wall_and_its_place(tmp_path: Path) -> None:
    plan = import_plan(write(tmp_path, [feature("wall")]), Hints(storey_height_m=4.0))
    walls = plan.levels[0].walls
    assert len(walls) == 4
    assert np.ptp(walls[:, [0, 2]]) == pytest.approx(6.24, abs=0.01)  # 0.0001 degrees at latitude 56
    assert np.ptp(walls[:, [1, 3]]) == pytest.approx(11.14, abs=0.01)
    assert walls.min() == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("features", "main", "named"), [
    (3, {}, "g.geojson: features: expected a list"),
    ([3], {}, r"features\[0\]"),
    ([feature("wall"), feature("wall", [[[-3, 56], [-3, 56]]])], {}, r"features\[1\].geometry.*four"),
    ([feature("wall", [[[0, "a"]]])], {}, r"features\[0\].geometry.coordinates.*not a finite number"),
    ([feature("wall", [[[0, 1e400]] * 4])], {}, r"not a number|JSON"),
    ([feature("wall", [[[0, 95]] * 4])], {}, r"features\[0\].geometry.coordinates.*within 90 degrees"),
    ([feature("wall", [[[60, 5], [61, 5], [61, 6], [60, 5]]])], {}, "100 km"),
    ([feature("wall", name=[])], {}, r"features\[0\].properties.name"),
    ([{"properties": {"type": "wall"}, "geometry": {"type": "Cube", "coordinates": []}}], {}, "Cube"),
    ([], {"levels": []}, "main.json: levels"),
    ([], {"levels": [{"name": "G", "z_order": 0, "filename": "../g.geojson"}]}, r"levels\[0\].filename"),
    ([], {"levels": [{"name": "G", "z_order": 0, "filename": "no.geojson"}]}, "no such file"),
    ([], {"levels": [{"name": "G", "z_order": "0", "filename": "g.geojson"}]}, r"levels\[0\].z_order"),
    ([], {"location": {"coordinates": [500, 0]}}, "location.coordinates"),
    ([], {"location": None}, "location"),
    ([], {"name": 3}, "name"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path: Path, features: Any, main: dict[str, Any], named: str) -> None:
    with pytest.raises(EchostepError, match=named) as caught:
        import_plan(write(tmp_path, features, main))
    assert str(tmp_path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("raw", [b"", b"{", b"\xff\xfe\x00", b"\x80abc", b"[" * 200_000, b'{"a": NaN}'])
def test_no_json(tmp_path: Path, raw: bytes) -> None:
    (tmp_path / "main.json").write_bytes(raw)
    with pytest.raises(EchostepError, match=r"main.json: not "):
        import_plan(tmp_path)


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(EchostepError, match="no format"):
        import_plan(tmp_path)
    with pytest.raises(EchostepError, match="no such file"):
        import_plan(tmp_path / "main.json")
