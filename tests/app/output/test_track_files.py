# SPDX-License-Identifier: MIT
"""Tracks for other programs: read again by others' libraries, they are what was estimated, to the last bit."""

from __future__ import annotations

import csv
import dataclasses
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pyogrio
import pytest
from evo.tools import file_interface
from pyarrow import parquet

from command_line import echostep
from echostep.errors import EchostepError
from echostep.localization import Estimate, LikelyPlace, TrackStatus
from echostep.plan import load_plan
from echostep.recording import open_recording
from echostep.walk.table import write_track
from echostep_app.output.map_files import TrackOnPlan
from echostep_app.output.track_files import FORMATS
from echostep_app.output.track_files import export as write
from echostep_app.plan.georeference import EarthTransform
from echostep_app.recording.repair.contents import info
from echostep_app.session.options import TrackingOptions
from echostep_app.session.runs.replay import tracker_of
from page.frames import told
from recording.damages import write_recording
from walks import DEMO, walk_chunks


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording, and a plan that lies by the Tay."""
    folder = tmp_path_factory.mktemp("export")
    write_recording(folder / "walk.mcap", walk_chunks(), {"seed": "3", "note": "a test"})
    tree = json.loads(DEMO.read_text())
    tree["georeference"] = {"origin": [-2.978, 56.46], "rotation_deg": 30.0}
    (folder / "plan.json").write_text(json.dumps(tree))
    return folder


@pytest.fixture(scope="module")
def estimates(folder: Path) -> list[Estimate]:
    recording, plan = open_recording(folder / "walk.mcap"), load_plan(folder / "plan.json")
    tracker = tracker_of(recording, plan, TrackingOptions(DEMO))
    return [e for portion in recording.portions() for e in tracker.take(portion)]


def export(folder: Path, name: str, plan: Path | None = None) -> Path:
    out = folder / name
    said = write(
        folder / "walk.mcap",
        plan or folder / "plan.json",
        out,
        lambda recording, on: tracker_of(recording, on, TrackingOptions(DEMO)),
    )
    assert name in said
    return out


@pytest.mark.slow
def test_csv_and_parquet_hold_every_bit(folder: Path, estimates: list[Estimate]) -> None:
    with export(folder, "track.csv").open() as file:
        written = list(csv.DictReader(file))
    columns = parquet.read_table(export(folder, "track.parquet")).to_pydict()
    for name in ("t_s", "x_m", "y_m", "xx_m2", "xy_m2", "yy_m2", "heading_rad", "z_m"):
        expected = [getattr(e, name) for e in estimates]
        assert [float(row[name]) for row in written] == expected
        assert columns[name] == expected
    assert [row["status"] for row in written] == columns["status"] == [e.status.value for e in estimates]
    assert {f.name for f in dataclasses.fields(Estimate)} < columns.keys()


@pytest.mark.slow
def test_places_on_earth_are_the_same_in_all_formats(folder: Path, estimates: list[Estimate]) -> None:
    georeference = load_plan(folder / "plan.json").georeference
    assert georeference is not None
    expected = EarthTransform(georeference).degrees(np.array([(e.x_m, e.y_m) for e in estimates]))
    frame = pyogrio.raw.read(export(folder, "track.gpkg"), layer="estimates")
    points = np.array([np.frombuffer(wkb[5:21]) for wkb in frame[2]])
    assert np.array_equal(points, expected)
    assert frame[0]["crs"] == "EPSG:4326"
    line = pyogrio.raw.read(folder / "track.gpkg", layer="track")[2][0]
    assert np.array_equal(np.frombuffer(line[9:]).reshape(-1, 2), expected)
    columns = parquet.read_table(export(folder, "track.parquet")).to_pydict()
    assert np.array_equal(np.column_stack((columns["longitude_deg"], columns["latitude_deg"])), expected)
    *points, line = json.loads(export(folder, "track.geojson").read_text())["features"]
    assert (
        [point["geometry"]["coordinates"] for point in points] == line["geometry"]["coordinates"] == expected.tolist()
    )
    root = ET.parse(export(folder, "track.kml")).getroot()
    text = root.findtext(".//{*}LineString/{*}coordinates") or ""
    found = np.array([place.split(",") for place in text.split()], np.float64)
    assert np.abs(found - expected).max() < 1e-9
    assert pyogrio.read_info(folder / "track.kml", layer="estimates")["features"] == len(estimates)
    assert pyogrio.read_info(export(folder, "track.gpx"), layer="track_points")["geometry_type"] == "Point"
    waypoints = ET.parse(folder / "track.gpx").getroot().findall(".//{*}trkpt")
    found = np.array([(point.get("lon"), point.get("lat")) for point in waypoints], np.float64)
    assert np.abs(found - expected).max() < 1e-9


def test_a_gpx_track_is_cut_where_the_track_is_lost(folder: Path, estimates: list[Estimate], tmp_path: Path) -> None:
    """Lost estimates 10 to 14 are left out; a pause of 6 s begins a new stretch; times are there where they are known."""
    plan = load_plan(folder / "plan.json")
    some = [dataclasses.replace(e, t_s=e.t_s + 6.0 * (k >= 17)) for k, e in enumerate(estimates)]
    some[10:15] = [dataclasses.replace(e, status=TrackStatus.LOST) for e in some[10:15]]
    times = [f"2026-11-22T10:00:{k:02d}Z" for k in range(20)]
    for moments, found in ((times, [10, 2, 3]), ([], [10, 2, 3])):
        FORMATS[".gpx"](tmp_path / "cut.gpx", TrackOnPlan(some, plan, moments))
        root = ET.parse(tmp_path / "cut.gpx").getroot()
        assert (root.tag, root.get("version")) == ("{http://www.topografix.com/GPX/1/1}gpx", "1.1")
        assert [len(segment) for segment in root.findall(".//{*}trkseg")] == found
        assert len(root.findall(".//{*}time")) == (15 if moments else 0)
    FORMATS[".gpx"](tmp_path / "lost.gpx", TrackOnPlan(some[10:15], plan, []))
    assert ET.parse(tmp_path / "lost.gpx").getroot().findall(".//{*}trkseg") == []


def test_evo_reads_a_track(folder: Path, estimates: list[Estimate]) -> None:
    read = file_interface.read_tum_trajectory_file(export(folder, "track.tum"))
    expected = [(e.x_m, e.y_m, e.z_m) for e in estimates]
    assert np.abs(read.positions_xyz - expected).max() < 1e-6
    assert np.abs(read.timestamps - [e.t_s for e in estimates]).max() < 1e-6
    turned = read.get_orientations_euler()[:, 2] - [e.heading_rad for e in estimates]
    assert np.abs(np.sin(0.5 * turned)).max() < 1e-5


def test_a_recording_with_new_derived_messages_keeps_the_bytes(folder: Path) -> None:
    out = export(folder, "again.mcap")
    assert tuple(open_recording(out).chunks()) == walk_chunks()
    assert open_recording(out).metadata == {"seed": "3", "note": "a test"}
    told = "\n".join(info(out))
    assert "/estimate" in told
    assert told.endswith("whole")


@pytest.mark.parametrize(
    ("name", "plan", "said"),
    [
        ("track.kml", "nowhere.json", "georeference"),
        ("track.xls", DEMO, "unknown kind"),
        ("walk.mcap", DEMO, "another name"),
    ],
)
def test_what_cannot_be_written_is_named(folder: Path, name: str, plan: Path | str, said: str) -> None:
    tree = {key: value for key, value in json.loads(DEMO.read_text()).items() if key != "georeference"}
    (folder / "nowhere.json").write_text(json.dumps(tree))
    before = (folder / "walk.mcap").read_bytes()
    with pytest.raises(EchostepError, match=said):
        export(folder, name, folder / plan)
    assert (folder / "walk.mcap").read_bytes() == before


def test_a_track_without_a_place_on_earth_is_in_metres_and_says_so(folder: Path) -> None:
    """Of a foot alone, without a plan, by the command; a GIS reads it."""
    out = folder / "alone.geojson"
    done = echostep("export", folder / "walk.mcap", "-o", out)
    assert (done.returncode, done.stderr) == (0, "")
    assert "alone.geojson" in done.stdout.splitlines()[-1]
    tree = json.loads(out.read_text())
    assert tree["coordinates"].startswith("metres of the plan, not longitude and latitude")
    *points, line = tree["features"]
    for point, place in zip(points, line["geometry"]["coordinates"], strict=True):
        told = point["properties"]
        assert point["geometry"]["coordinates"] == [told["x_m"], told["y_m"]] == place
        assert 0.0 < told["radius95_m"] < 5.0
    assert line["properties"]["t_s"] == [point["properties"]["t_s"] for point in points]
    assert pyogrio.read_info(out)["features"] == len(points) + 1


def moments(kml: Path) -> list[str]:
    return [when.text or "" for when in ET.parse(kml).getroot().iterfind(".//{*}TimeStamp/{*}when")]


def test_a_track_on_a_map_has_times(folder: Path, estimates: list[Estimate]) -> None:
    """The time of day of a recording that knows it; else seconds since the beginning, and a word about it."""
    simulated = export(folder, "simulated.kml")
    assert "No time of day" in simulated.read_text()
    assert moments(simulated)[0].startswith("1970-01-01T00:00:0")
    clock = {"started_utc": "2026-11-21T10:00:00.000+00:00", "started_ns": "1000000000"}
    write_recording(folder / "live.mcap", walk_chunks(), {"seed": "3"} | clock)
    write(
        folder / "live.mcap",
        folder / "plan.json",
        folder / "live.kml",
        lambda recording, on: tracker_of(recording, on, TrackingOptions(DEMO)),
    )
    times = moments(folder / "live.kml")
    assert len(times) == len(estimates)
    assert times == sorted(times)
    seconds = [datetime.fromisoformat(time).timestamp() for time in times]
    began_s = datetime.fromisoformat(clock["started_utc"]).timestamp()
    assert np.abs(np.diff(seconds) - np.diff([e.t_s for e in estimates])).max() < 0.02
    assert abs(seconds[0] - began_s - estimates[0].t_s) < 0.1


def test_each_estimate_is_a_row_with_its_hypotheses(tmp_path: Path) -> None:
    places = (LikelyPlace(0.58, 12.31, 4.5, 0, 1.0, 0.0), LikelyPlace(0.4, 2.0, 7.5, 1, 1.0, 0.0))
    spread = replace(told(x_m=0.1 + 0.2, status=TrackStatus.LOST), hypotheses=places, right=0.3, plan_fits=0.25)
    write_track(tmp_path / "track.csv", [told(), spread])
    sure, unsure = csv.DictReader((tmp_path / "track.csv").read_text().splitlines())
    assert (sure["hypotheses"], sure["status"], sure["protection_m"]) == ("", "tracking", "inf")
    assert float(unsure["x_m"]) == 0.1 + 0.2
    assert unsure["hypotheses"] == "0.58:12.3,4.5,0 0.40:2.0,7.5,1"
    assert [unsure[name] for name in ("right", "outside", "plan_fits")] == ["0.3", "0.0", "0.25"]
