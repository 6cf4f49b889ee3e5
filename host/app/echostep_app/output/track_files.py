# SPDX-License-Identifier: MIT
"""Tracks of recordings as files for other programs.

In: a recording and a plan. Out: CSV, Parquet, GeoPackage, GeoJSON, KML, GPX, a TUM trajectory, or a recording with newly derived messages, by the
suffix of the file name. Owns nothing.
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from echostep.errors import EchostepError
from echostep.file_mode import claim, write_csv
from echostep.localization import Estimate
from echostep.plan import NO_PLAN, Plan
from echostep.ports.chunks import Portion
from echostep.recording import Recording, clock_of, open_parts
from echostep.tracker import Tracker
from echostep.walk.table import columns_of, refuse_none
from echostep_app.extras import require
from echostep_app.output.derived import Derived
from echostep_app.output.map_files import TrackOnPlan, flat, write_geojson, write_geopackage, write_gpx, write_kml
from echostep_app.plan.georeference import earth_of
from echostep_app.plan.importers.limited import open_limited
from echostep_app.printing.console import console_for_people
from echostep_app.printing.lines import moment
from echostep_app.printing.progress import with_bar
from echostep_app.recording.recorder import Recorder


def export(path: Path, plan_path: Path | None, out: Path, tracker_of: Callable[[Recording, Plan], Tracker]) -> str:
    """Track a recording and write the track in the format of the suffix of `out`; returns a summary line.

    Raises EchostepError for an unknown format, a plan without the georeference that the format needs, and a recording without estimates.
    """
    if out.suffix not in FORMATS:
        raise EchostepError(f"{out}: unknown kind of file: choose from {', '.join(FORMATS)}")
    if needed := "pyarrow" if out.suffix == ".parquet" else "pyproj" if out.suffix in NEEDS_GEOREFERENCE else "":
        require(str(out), needed)
    recording, plan = open_parts([path]), open_limited(plan_path) if plan_path else NO_PLAN
    if earth_of(plan) is None and out.suffix in NEEDS_GEOREFERENCE:
        raise EchostepError(
            f"{plan_path or out}: {out.suffix} needs a plan with a georeference: longitude and latitude of the map's origin"
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
            for portion in _tracked(recording):
                estimates += tracker.take(portion)
            refuse_none(estimates, path)
            FORMATS[out.suffix](claim(out), TrackOnPlan(estimates, plan, moments_of(recording, tracker, estimates)))
    except (OSError, sqlite3.Error) as error:
        raise EchostepError(f"{out}: cannot write: {getattr(error, 'strerror', None) or error}") from error
    return f"{out}: {len(estimates)} estimates, {estimates[-1].t_s - estimates[0].t_s if estimates else 0.0:.1f} s"


def moments_of(recording: Recording, tracker: Tracker, estimates: list[Estimate]) -> list[str]:
    """The time of day of each estimate, UTC [RFC 3339]; empty without a usable clock in the recording."""
    clock = clock_of(recording.metadata)
    try:
        times_s = [clock(tracker.arrival_ns(e.t_s)) for e in estimates] if clock else []
        return [moment(t_s) for t_s in times_s]
    except (ValueError, OverflowError, OSError):  # damaged times
        return []


def _tracked(recording: Recording) -> Iterator[Portion]:
    """The recording's portions, with a bar on a terminal."""
    text, terminal = f"tracking {recording.path.name}", console_for_people(stderr=True)
    return with_bar(recording.portions(), text, lambda: recording.fraction, terminal)


def _record(recording: Recording, tracker: Tracker, out: Path, estimates: list[Estimate]) -> None:
    """Write the recorded bytes again, with the messages derived from them now."""
    with Recorder(out, recording.metadata) as recorder:
        derived = Derived(tracker, recorder.log_offset_ns)
        for portion in _tracked(recording):
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
    columns = flat(columns_of(track.estimates, track.plan))
    write_csv(out, list(columns), zip(*columns.values(), strict=True))


def _write_parquet(out: Path, track: TrackOnPlan) -> None:
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table(columns_of(track.estimates, track.plan))
    parquet.write_table(table.replace_schema_metadata({"plan": track.plan.name, "plan_sha256": track.plan.digest}), out)


def _write_tum(out: Path, track: TrackOnPlan) -> None:
    """Rows of time (s), place (m) and heading as a quaternion x, y, z, w: a trajectory that evo reads."""
    rows = [
        (e.t_s, e.x_m, e.y_m, e.z_m, 0.0, 0.0, math.sin(0.5 * e.heading_rad), math.cos(0.5 * e.heading_rad))
        for e in track.estimates
    ]
    np.savetxt(out, rows, fmt="%.6f")


Write = Callable[[Path, TrackOnPlan], None]
FORMATS: dict[str, Write] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".gpkg": write_geopackage,
    ".geojson": write_geojson,
    ".kml": write_kml,
    ".gpx": write_gpx,
    ".tum": _write_tum,
    ".mcap": lambda *_: None,
}
NEEDS_GEOREFERENCE = (".gpkg", ".kml", ".gpx")
