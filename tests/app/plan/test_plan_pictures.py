# SPDX-License-Identifier: MIT
"""Pictures of plans: axes, letters and fonts, the symbols of a level's lines, ground overlays for viewers of maps."""

from __future__ import annotations

import io
import json
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import replace
from pathlib import Path

import matplotlib.font_manager as fonts
import matplotlib.image
import numpy as np
import pytest
import shapely

import command_line
from board_runs import ROOT
from command_line import echostep
from echostep.arrays import Floats
from echostep.plan import NO_PLAN, Connector, ConnectorKind, Door, Georeference, Level, Plan, load_plan
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.pictures import drawing, labels
from echostep_app.plan.pictures.drawing import draw_plan
from echostep_app.plan.pictures.overlay import EDGE_M, Overlay, overlays, write_overlays
from echostep_app.plan.pictures.symbols import HALF_JAMB_M, HALF_WINDOW_M, MOST_TREADS, level_lines, way_names
from echostep_simulation.world.tower import tower
from walks import PLAN

WALLS = [[400, 300, 404, 300], [404, 300, 404, 303], [404, 303, 402, 303], [401, 303, 400, 303], [400, 303, 400, 300]]


def plan_of(folder: Path, name: str = "Office") -> Plan:
    ground = {"name": "Ground", "height_m": 0, "walls": WALLS, "rooms": [{"name": name, "at": [402, 301.5]}]}
    tree = {"echostep_plan": 1, "levels": [ground, {"name": "Roof", "height_m": 3, "walls": []}]}
    (folder / "plan.json").write_text(json.dumps(tree))
    return load_plan(folder / "plan.json")


def test_axes_are_around_the_walls(tmp_path: Path) -> None:
    """An empty level does not draw the origin into the picture."""
    plan = plan_of(tmp_path)
    x0, y0, x1, y1 = drawing._about(list(plan.levels))
    assert (399 < x0 < 400, 299 < y0 < 300, 404 < x1 < 405, 303 < y1 < 304) == (True,) * 4
    assert drawing._about([plan.levels[1]]) == pytest.approx((-0.3, -0.3, 10.3, 10.3))


@pytest.mark.process
def test_letters_that_no_font_has_are_named_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the one font that matplotlib brings."""
    monkeypatch.setattr(fonts.fontManager, "ttflist", [f for f in fonts.fontManager.ttflist if f.name == "DejaVu Sans"])
    plan_of(tmp_path, "機械室 A")
    done = command_line.echostep("plan", "show", tmp_path / "plan.json", "-o", tmp_path / "x.png")
    assert done.returncode == 0
    assert (
        done.stdout
        == f"picture: {tmp_path / 'x.png'}; no font here has the letters 室械機: install one that does (fonts-noto-cjk, fonts-noto)\n"
    )
    assert not done.stderr
    plan_of(tmp_path, "Büro, Šatna, Кухня, Αίθουσα")
    assert (
        command_line.echostep("plan", "show", tmp_path / "plan.json", "-o", tmp_path / "x.png").stdout
        == f"picture: {tmp_path / 'x.png'}\n"
    )


def test_a_font_that_has_the_letters_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """DejaVu Sans without its capital A stands for a font that lacks a script; another installed font has it."""
    real = labels._letters
    monkeypatch.setattr(
        labels, "_letters", lambda path: real(path) - {"A"} if Path(path).name == "DejaVuSans.ttf" else real(path)
    )
    with labels.fonts_for(["A room"]) as missing:
        import matplotlib as mpl

        families = list(mpl.rcParams["font.family"])
    assert missing == ""
    assert len(families) == 2
    assert families[0] == labels.BASE_FONT
    assert draw_plan(plan_of(tmp_path, "A room"), tmp_path / "x.png", [0]) == ""


LINE = (2.0, 0.0, 3.0, 0.0)
SHAFT = np.array([(0.0, 0.0), (0.0, 5.0), (2.0, 5.0), (2.0, 0.0)])
BENT = np.array([(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)])


def storeys_of(level: Level, *connectors: Connector) -> Plan:
    levels = tuple(replace(level, name=str(k), height_m=3.0 * k) for k in range(3))
    return Plan("test", levels, None, "", connectors)


def way(kind: ConnectorKind, outline_m: Floats, levels: tuple[int, ...] = (0, 1, 2), name: str = "") -> Connector:
    return Connector(kind, name, levels, outline_m)


def rows(lines: Floats) -> set[tuple[float, ...]]:
    """Lines whatever their direction."""
    return {tuple(np.round(sorted([row[:2], row[2:]]), 6).ravel()) for row in lines.tolist()}


@pytest.mark.parametrize(
    ("state", "kind", "leaves"), [("open", "door", 0), ("closed", "door", 1), ("unknown", "unknown", 1)]
)
def test_a_door_has_its_jambs_and_a_leaf_where_it_may_be_shut(state: str, kind: str, leaves: int) -> None:
    lines = level_lines(storeys_of(Level("", 0.0, np.zeros((0, 4)), doors=(Door(LINE, state),))), 0)  # type: ignore[arg-type]
    jambs = {(x, -HALF_JAMB_M, x, HALF_JAMB_M) for x in (2.0, 3.0)}
    assert rows(lines["door"]) >= jambs
    assert (LINE in rows(lines[kind])) == bool(leaves)
    assert sum(len(lines[name]) for name in lines) == 2 + leaves


def test_a_window_is_glass_between_two_faces() -> None:
    lines = level_lines(storeys_of(Level("", 0.0, np.zeros((0, 4)), windows=np.array([LINE]))), 0)
    h = HALF_WINDOW_M
    assert rows(lines["window"]) == {LINE, (2, -h, 3, -h), (2, h, 3, h), (2, -h, 2, h), (3, -h, 3, h)}
    assert not len(lines["wall"])


def test_stairs_have_steps_across_their_length_and_a_lift_its_cross() -> None:
    plan = storeys_of(Level("", 0.0, np.zeros((0, 4))), way("stairs", SHAFT), way("lift", SHAFT), way("ramp", SHAFT))
    lines = level_lines(plan, 1)
    outline = rows(np.array([(0, 0, 0, 5), (0, 5, 2, 5), (2, 5, 2, 0), (2, 0, 0, 0)], dtype=float))
    steps = rows(lines["stairs"]) - outline
    assert len(steps) == MOST_TREADS - 1
    assert all(y0 == y1 and (x0, x1) == (0.0, 2.0) for x0, y0, x1, y1 in steps)
    assert rows(lines["lift"]) - outline == {(0.0, 0.0, 2.0, 5.0), (0.0, 5.0, 2.0, 0.0)}
    assert (1.0, 0.0, 1.0, 5.0) in rows(lines["ramp"])


@pytest.mark.parametrize("kind", ["stairs", "lift", "ramp"])
@pytest.mark.parametrize(
    "outline_m",
    [BENT, np.array([(0.0, 0.0), (2.0, 2.0), (0.0, 2.0), (2.0, 0.0)]), np.array([(0.0, 0.0), (1.0, 1.0), (3.0, 3.0)])],
    ids=["bent", "crossing itself", "without area"],
)
def test_no_line_leaves_the_outline(kind: ConnectorKind, outline_m: Floats) -> None:
    lines = level_lines(storeys_of(Level("", 0.0, np.zeros((0, 4))), way(kind, outline_m)), 0)[kind]
    within = shapely.make_valid(shapely.Polygon(outline_m)).buffer(1e-6)
    assert len(lines) >= len(outline_m)
    assert np.isfinite(lines).all()
    assert shapely.within(
        shapely.linestrings(lines.reshape(-1, 2, 2)), within.union(shapely.LinearRing(outline_m).buffer(1e-6))
    ).all()


def test_a_way_says_where_it_leads_on_its_levels_only() -> None:
    plan = storeys_of(
        Level("", 0.0, np.zeros((0, 4))), way("stairs", SHAFT, name="Stairs A"), way("lift", BENT, (1, 2))
    )
    said = [[name for name, _ in way_names(plan, level)] for level in range(3)]
    assert said == [["Stairs A ↑"], ["Stairs A ↑↓", "lift ↑"], ["Stairs A ↓", "lift ↓"]]
    assert shapely.Polygon(BENT).contains(shapely.Point(way_names(plan, 2)[1][1]))
    assert not len(level_lines(plan, 0)["lift"])


def test_without_a_plan_there_are_no_lines() -> None:
    assert not any(len(lines) for lines in level_lines(NO_PLAN, 0).values())


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
@pytest.mark.parametrize("degrees", [30.0, -140.0])
def test_walls_are_where_the_box_says(degrees: float) -> None:
    """Dark within two pixels of the middle of each outer wall; white in a room; clear outside of the building."""
    plan = placed(PLAN, degrees)
    (overlay,) = overlays(plan)
    picture = image(overlay)
    low, high = (f(PLAN.levels[0].solid.reshape(-1, 2), axis=0) for f in (np.min, np.max))
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
        write_overlays(placed(PLAN, 30.0), tmp_path / name)
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
