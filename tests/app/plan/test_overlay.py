# SPDX-License-Identifier: MIT
"""Ground overlays of storeys: a wall is where its longitude and latitude say, and the archive is one that viewers of maps read."""

from __future__ import annotations

import io
import json
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from board_runs import ROOT
from command_line import echostep
from echostep.plan import Georeference, Plan, load_plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.pictures.overlay import EDGE_M, Overlay, overlays, write_overlays
from echostep_simulation.world.tower import tower

DEMO = load_plan(ROOT / "host/core/echostep/plans/demo.json")


def placed(plan: Plan, degrees: float) -> Plan:
    return replace(plan, georeference=Georeference(-2.978, 56.46, np.radians(degrees)))


def pixel(overlay: Overlay, plan: Plan, at_m: tuple[float, float]) -> tuple[int, int]:
    """Row and column of a place of the plan, by its longitude and latitude and the box alone."""
    assert plan.georeference is not None
    lon, lat = EarthTransform(plan.georeference).degrees(np.array([at_m]))[0].tolist()
    rows, columns = image(overlay).shape[:2]
    return (
        int((overlay.north - lat) / (overlay.north - overlay.south) * rows),
        int((lon - overlay.west) / (overlay.east - overlay.west) * columns),
    )


def image(overlay: Overlay) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Rows, columns, red green blue alpha, from 0 to 1."""
    return np.asarray(matplotlib.image.imread(io.BytesIO(overlay.png)))


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, -140.0])
def test_walls_are_where_the_box_says(degrees: float) -> None:
    """Dark within two pixels of the middle of each outer wall; white in a room; clear outside of the building."""
    plan = placed(DEMO, degrees)
    (overlay,) = overlays(plan)
    picture = image(overlay)
    low, high = (f(DEMO.levels[0].solid.reshape(-1, 2), axis=0) for f in (np.min, np.max))
    for at in ((7.0, low[1]), (7.0, high[1]), (low[0], 7.0), (high[0], 7.0)):
        row, column = pixel(overlay, plan, (float(at[0]), float(at[1])))
        near = picture[row - 2 : row + 3, column - 2 : column + 3]
        assert near[..., :3].min() < 0.4, at
    row, column = pixel(overlay, plan, (3.6, 9.7))
    assert picture[row, column] == pytest.approx([1.0, 1.0, 1.0, 0.85], abs=0.01)
    row, column = pixel(overlay, plan, (float(low[0]) - 0.7 * EDGE_M, float(high[1]) + 0.7 * EDGE_M))
    assert picture[row, column, 3] == 0.0


def test_the_archive_holds_a_document_and_a_picture_a_storey(tmp_path: Path) -> None:
    """`doc.kml` at the top, LatLonBox without rotation, only the lowest storey visible at first [OGC 07-147r2]."""
    made = write_overlays(placed(tower(3), 20.0), tmp_path / "tower.kmz")
    with zipfile.ZipFile(tmp_path / "tower.kmz") as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        root = ET.fromstring(archive.read("doc.kml"))
        found = root.findall(".//{*}GroundOverlay")
        assert names == ["doc.kml", *(ground.findtext("{*}Icon/{*}href") for ground in found)]
        assert all(archive.read(name).startswith(b"\x89PNG") for name in names[1:])
    assert [ground.findtext("{*}name") for ground in found] == ["tower: 0", "tower: 1", "tower: 2"]
    assert [ground.findtext("{*}visibility") for ground in found] == ["1", "0", "0"]
    for ground, overlay in zip(found, made, strict=True):
        box = {side.tag.rpartition("}")[2]: float(side.text or "") for side in ground.findall("{*}LatLonBox/*")}
        assert box == pytest.approx({k: getattr(overlay, k) for k in ("north", "south", "east", "west")}, abs=1e-9)
        assert [child.tag.rpartition("}")[2] for child in ground] == [
            "name",
            "visibility",
            "drawOrder",
            "Icon",
            "LatLonBox",
        ]


def test_the_same_plan_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.kmz", "b.kmz"):
        write_overlays(placed(DEMO, 30.0), tmp_path / name)
    assert (tmp_path / "a.kmz").read_bytes() == (tmp_path / "b.kmz").read_bytes()


def test_the_command_and_its_mistakes(tmp_path: Path) -> None:
    plan = ROOT / "host/core/echostep/plans/demo.json"
    done = echostep("plan", "overlay", plan, "-o", tmp_path / "demo.kmz")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("Ground floor: 48.2")
    assert "ends in .kmz" in echostep("plan", "overlay", plan, "-o", tmp_path / "demo.png").stderr
    tree = {key: value for key, value in json.loads(plan.read_text()).items() if key != "georeference"}
    (tmp_path / "nowhere.json").write_text(json.dumps(tree))
    told = echostep("plan", "overlay", tmp_path / "nowhere.json", "-o", tmp_path / "x.kmz")
    assert (told.returncode, told.stderr.count("\n")) == (2, 1)
    assert "an overlay needs a georeference" in told.stderr
