# SPDX-License-Identifier: MIT
"""Tracks of recordings as files for other programs.

In: a recording and a plan. Out: CSV, Parquet, GeoPackage, KML, GPX, or a recording with newly derived messages, chosen by the suffix of the file
name. Owns nothing.
"""

from __future__ import annotations

import csv
import math
import sqlite3
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from rich.progress import Progress

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.extras import require
from echostep.file_mode import claim
from echostep.localization.estimate import Estimate, claims_place
from echostep.plan.georeference import EarthTransform, earth_of
from echostep.plan.model import Plan
from echostep.ports.chunks import Portion
from echostep.recording.clock import clock_of
from echostep.recording.joining import open_parts
from echostep.recording.reading import Recording
from echostep.tracker import Tracker
from echostep.walk.table import Columns, columns_of, refuse_none
from echostep_app.output.derived import Derived
from echostep_app.plan.importers.limited import open_limited
from echostep_app.printing.console import console_for_people
from echostep_app.recording.recorder import Recorder

ELLIPSE_POINTS = 33
GAP_S = 5.0  # without an estimate, after which a new stretch of a track begins; assumed
KML = "http://www.opengis.net/kml/2.2"
COLORS = {"tracking": "ffff8020", "uncertain": "ff20a0ff", "lost": "ff2020ff"}  # alpha, blue, green, red


def export(path: Path, plan_path: Path, out: Path, tracker_of: Callable[[Recording, Plan], Tracker]) -> str:
    """Track a recording and write the track in the format of the suffix of `out`; returns a summary line.

    Raises EchostepError for an unknown format, a plan without the georeference that the format needs, and a recording without estimates.
    """
    if out.suffix not in FORMATS:
        raise EchostepError(f"{out}: unknown kind of file: choose from {', '.join(FORMATS)}")
    if out.suffix == ".parquet":
        require(str(out), "pyarrow")
    recording, plan = open_parts([path]), open_limited(plan_path)
    if earth_of(plan) is None and out.suffix in NEEDS_GEOREFERENCE:
        raise EchostepError(
            f"{plan_path}: {out.suffix} needs a georeference: add longitude and latitude of the map's origin to the plan"
        )
    if out.exists() and out.resolve() == path.resolve():
        raise EchostepError(f"{out}: that is the recording itself: give another name with -o")
    tracker = tracker_of(recording, plan)
    estimates: list[Estimate] = []
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if out.suffix == ".mcap":
            _record(recording, tracker, out, estimates)
        else:
            for portion in with_progress(recording, f"tracking {path.name}"):
                estimates += tracker.take(portion)
            refuse_none(estimates, path)
            FORMATS[out.suffix](claim(out), TrackOnPlan(estimates, plan, moments_of(recording, tracker, estimates)))
    except (OSError, sqlite3.Error) as error:
        raise EchostepError(f"{out}: cannot write: {getattr(error, 'strerror', None) or error}") from error
    return f"{out}: {len(estimates)} estimates, {estimates[-1].t_s - estimates[0].t_s if estimates else 0.0:.1f} s"


@dataclass(frozen=True, slots=True)
class TrackOnPlan:
    """What is exported; `moments`: time of day of each estimate, empty where it was not recorded."""

    estimates: list[Estimate]
    plan: Plan
    moments: list[str]


def moments_of(recording: Recording, tracker: Tracker, estimates: list[Estimate]) -> list[str]:
    """The time of day of each estimate, UTC [RFC 3339]; empty without a usable clock in the recording."""
    clock = clock_of(recording.metadata)
    try:
        times_s = [clock(tracker.arrival_ns(e.t_s)) for e in estimates] if clock else []
        return [moment(t_s) for t_s in times_s]
    except (ValueError, OverflowError, OSError):  # damaged times
        return []


def moment(unix_s: float) -> str:
    """Unix time as RFC 3339 in UTC, to the millisecond."""
    return datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def with_progress(recording: Recording, title: str) -> Iterator[Portion]:
    """The recording's portions, with a progress bar on a terminal."""
    console = console_for_people(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=1.0)
        for portion in recording.portions():
            yield portion
            progress.update(task, completed=recording.fraction)


def _degrees(estimates: list[Estimate], earth: EarthTransform) -> Floats:
    return earth.degrees(np.array([(e.x_m, e.y_m) for e in estimates]))


def _flat(columns: Columns) -> Columns:
    """The same columns with tuples as text, for formats without lists."""
    return {
        name: [" ".join(map(str, v)) if isinstance(v, tuple) else v for v in column] for name, column in columns.items()
    }


def _record(recording: Recording, tracker: Tracker, out: Path, estimates: list[Estimate]) -> None:
    """Write the recorded bytes again, with the messages derived from them now."""
    with Recorder(out, recording.metadata) as recorder:
        derived = Derived(tracker, recorder.log_offset_ns)
        for portion in with_progress(recording, f"tracking {recording.path.name}"):
            for chunk in portion.chunks():
                recorder.write(chunk)
                recorder.wait_for_disk(chunk)
            new = tracker.take(portion)
            estimates += new
            recorder.write_derived(derived.take(portion, new))
        recorder.write_damage(recording.damage_notes())
    if recorder.notices:
        raise EchostepError(recorder.notices[0])


def _write_csv(out: Path, track: TrackOnPlan) -> None:
    columns = _flat(columns_of(track.estimates, track.plan))
    with out.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def _write_parquet(out: Path, track: TrackOnPlan) -> None:
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table(columns_of(track.estimates, track.plan))
    parquet.write_table(table.replace_schema_metadata({"plan": track.plan.name, "plan_sha256": track.plan.digest}), out)


def _write_geopackage(out: Path, track: TrackOnPlan) -> None:
    import shapely

    from echostep_app.output.geopackage import Layer, write_geopackage

    columns = _flat(columns_of(track.estimates, track.plan))
    longitude, latitude = columns.pop("longitude_deg"), columns.pop("latitude_deg")
    kinds = {float: "REAL", int: "INTEGER", str: "TEXT"}
    named = [(name, kinds.get(type(values[0]), "TEXT")) for name, values in columns.items()]
    points = [None if x is None else shapely.Point(x, y) for x, y in zip(longitude, latitude, strict=True)]
    layers = [Layer("estimates", "POINT", named, list(zip(points, zip(*columns.values(), strict=True), strict=True)))]
    lines = [shapely.LineString([(longitude[k], latitude[k]) for k in ks]) for ks in stretches(track) if len(ks) > 1]
    if lines:
        layers.append(Layer("track", "LINESTRING", [("name", "TEXT")], [(line, (track.plan.name,)) for line in lines]))
    write_geopackage(out, layers)


def _write_kml(out: Path, track: TrackOnPlan) -> None:
    """The track as lines, each estimate that claims a place as a point with its 95 % ellipse."""
    earth = earth_of(track.plan)
    assert earth is not None
    estimates = track.estimates
    moments = track.moments or [moment(e.t_s) for e in estimates]
    ET.register_namespace("", KML)
    root = ET.Element(f"{{{KML}}}kml")
    document = _element(root, "Document")
    _element(document, "name", track.plan.name)
    if not track.moments:
        _element(document, "description", "No time of day was recorded: times count from 1970-01-01T00:00:00Z.")
    for status, color in COLORS.items():
        style = _element(document, "Style", id=status)
        line = _element(style, "LineStyle")
        _element(line, "color", color)
        _element(line, "width", "2")
        _element(_element(style, "PolyStyle"), "color", "40" + color[2:])
    degrees = _degrees(estimates, earth)
    line_mark = _element(document, "Placemark")
    _element(line_mark, "name", "track")
    span = _element(line_mark, "TimeSpan")
    _element(span, "begin", moments[0])
    _element(span, "end", moments[-1])
    _element(line_mark, "styleUrl", "#tracking")
    lines = _element(line_mark, "MultiGeometry")
    for ks in stretches(track):
        _element(_element(lines, "LineString"), "coordinates", _coordinates(degrees[ks]))
    folder = _element(document, "Folder")
    _element(folder, "name", "estimates")
    for k, e in enumerate(estimates):
        mark = _element(folder, "Placemark")
        _element(mark, "name", f"{e.t_s:.1f} s")
        placed = claims_place(e.status)
        within = f"95 % within {e.ellipse95.major_m:.2f} m" if placed else "place not known"
        _element(mark, "description", f"step {e.step}, {e.status.value}, {within}")
        _element(_element(mark, "TimeStamp"), "when", moments[k])
        _element(mark, "styleUrl", f"#{e.status.value}")
        if not placed:
            continue
        geometry = _element(mark, "MultiGeometry")
        _element(_element(geometry, "Point"), "coordinates", _coordinates(degrees[k : k + 1]))
        ring = _element(_element(_element(geometry, "Polygon"), "outerBoundaryIs"), "LinearRing")
        _element(ring, "coordinates", _coordinates(_ellipse(e, earth)))
    ET.indent(root)
    ET.ElementTree(root).write(out, encoding="utf-8", xml_declaration=True)


def _write_gpx(out: Path, track: TrackOnPlan) -> None:
    """The track in its stretches."""
    from echostep_app.output.gpx import write_gpx

    earth = earth_of(track.plan)
    assert earth is not None
    rows = [
        (_degrees([track.estimates[k] for k in ks], earth), [track.moments[k] for k in ks] if track.moments else [])
        for ks in stretches(track)
    ]
    write_gpx(out, track.plan.name, rows)


def stretches(track: TrackOnPlan) -> list[list[int]]:
    """Indices of the estimates in stretches in which each claims a place and none is more than GAP_S after the one before."""
    known = [k for k, e in enumerate(track.estimates) if claims_place(e.status)]
    t_s = np.array([track.estimates[k].t_s for k in known])
    breaks = np.flatnonzero((np.diff(known) > 1) | (np.diff(t_s) > GAP_S)) + 1
    return [stretch.tolist() for stretch in np.split(np.array(known, dtype=int), breaks) if len(stretch)]


def _element(parent: ET.Element, name: str, text: str | None = None, **attributes: str) -> ET.Element:
    element = ET.SubElement(parent, f"{{{KML}}}{name}", attributes)
    element.text = text
    return element


def _coordinates(degrees: Floats) -> str:
    """Longitudes and latitudes (n, 2) as KML coordinates."""
    return " ".join(f"{x:.9f},{y:.9f}" for x, y in degrees.tolist())


def _ellipse(e: Estimate, earth: EarthTransform) -> Floats:
    """The 95 % ellipse of an estimate as longitudes and latitudes (n, 2)."""
    major_m, minor_m, angle_rad = e.ellipse95
    turn = np.linspace(0.0, 2.0 * math.pi, ELLIPSE_POINTS)
    u, v = major_m * np.cos(turn), minor_m * np.sin(turn)
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return earth.degrees(np.column_stack((e.x_m + c * u - s * v, e.y_m + s * u + c * v)))


Write = Callable[[Path, TrackOnPlan], None]
FORMATS: dict[str, Write] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".gpkg": _write_geopackage,
    ".kml": _write_kml,
    ".gpx": _write_gpx,
    ".mcap": lambda *_: None,
}
NEEDS_GEOREFERENCE = (".gpkg", ".kml", ".gpx")
