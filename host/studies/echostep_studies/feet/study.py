# SPDX-License-Identifier: MIT
"""`echostep evaluate feet`: the foot on real recordings with truth, one setting for all, beside the peers' figures.

In: the folder of recordings. Out: rows `{set, recording, metric, value, distance_m, peer, peer_name}`, JSON, a table, on request a picture.
Owns nothing. Nothing is set for a recording: the foot has one setting, and it stays at its default.
Latency: seconds of data from the begin of a stance to the step that it ends, fed sample by sample.
"""

from __future__ import annotations

from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from msgspec import UNSET

from echostep.foot.ins import Noise
from echostep.foot.steps import Foot, Step, Track, walk_track
from echostep_app.output.table import Table, console
from echostep_studies.bench.recordings.feet import SETS, FootRecording
from echostep_studies.bench.recordings.foot_metrics import FootFigure, align, places, way
from echostep_studies.feet.leave_one_out import FigureRow, describe, leave_one_out, with_left_out
from echostep_studies.frame.pictures import save
from echostep_studies.frame.recordings import recordings_in
from echostep_studies.frame.report import as_dict
from echostep_studies.frame.study import Study, StudyRequest

LIVE_HZ = 200.0
LIVE = "live"  # the `set` of these rows


def pace(recording: FootRecording) -> tuple[list[float], float]:
    """Latency (s) of each step, and processor seconds a sample."""
    foot, late = Foot(), []
    t_s, accel, gyro = recording.t_s, recording.accel, recording.gyro
    began = process_time()
    for k in range(len(t_s)):
        for event in foot.feed(t_s[k : k + 1], accel[k : k + 1], gyro[k : k + 1]):
            if isinstance(event, Step):
                late.append(float(t_s[k] - event.t_end_s))
    return late, (process_time() - began) / len(t_s)


def pace_rows(recordings: list[FootRecording]) -> list[FigureRow]:
    """Latency and cost over all recordings; the values are seconds and a share, as the metrics say."""
    pace(recordings[0])  # not counted: kernels compile
    paces = [pace(recording) for recording in recordings]
    late = [seconds for part, _ in paces for seconds in part]
    cost = float(np.mean([seconds for _, seconds in paces]))
    figures = {
        "step told after its stance began, median, s": float(np.median(late)),
        "step told after its stance began, worst, s": max(late),
        f"share of a core at {LIVE_HZ:.0f} Hz, sample by sample": cost * LIVE_HZ,
    }
    return [
        FigureRow(
            set=LIVE, recording="all", metric=metric, value=round(value, 4), distance_m=None, peer=None, peer_name=None
        )
        for metric, value in figures.items()
    ]


COLUMNS = {
    "set": "set",
    "recording": "recording",
    "metric": "metric",
    "value": "m",
    "distance_m": "way m",
    "peer": "peer's",
}


def feet_study(folder: Path, out: Path | None, *, left_out: bool) -> Study[FigureRow, FigureRow]:
    """The study of the recordings in this folder; `out`: folder of the picture, if one is wanted; `left_out`: also leave one set out.

    Raises EchostepError without any recording.
    """
    recordings = recordings_in(folder, SETS)
    tracks = [track_of(recording) for recording in recordings]
    return Study(
        "feet",
        (FigureRow,),
        lambda _seed: _rows_of_all(recordings, tracks, left_out=left_out),
        lambda rows: rows,
        _tables,
        None if out is None else lambda folder, _seed, _rows: draw_tracks(folder / "feet.png", recordings, tracks),
        runs=len(recordings),
        seeds=range(1),
        parquet=None,
    )


def _rows_of_all(recordings: list[FootRecording], tracks: list[Track], *, left_out: bool) -> list[FigureRow]:
    """Rows of the recordings, the medians of the sets, and the rows of the live foot."""
    rows = [row for recording, track in zip(recordings, tracks, strict=True) for row in rows_of(recording, track)]
    rows += medians(rows)
    if left_out:
        choices = leave_one_out(recordings, track_of)
        rows = with_left_out(rows, {group: _rows_under(recordings, group, noise) for group, noise in choices.items()})
        for group, noise in choices.items():
            console.print(f"{group} left out, the others choose: {describe(noise)}")
    return rows + pace_rows(recordings)


def _tables(rows: list[FigureRow], _request: StudyRequest) -> list[Table]:
    """The figures of the recordings; below, those of the live foot."""
    live = [f"{row.metric}: {row.value:.4f}" for row in rows if row.set == LIVE]
    figures = [row for row in rows if row.set != LIVE]
    columns = COLUMNS | {"left_out": "left out, m"} if any(row.left_out is not UNSET for row in figures) else COLUMNS
    return [Table("The foot on real recordings, one setting", [_printed(row) for row in figures], columns, live)]


def _rows_under(recordings: list[FootRecording], group: str, noise: Noise) -> list[FigureRow]:
    """The rows of one set with other constants."""
    rows = [row for r in recordings if r.group == group for row in rows_of(r, track_of(r, noise))]
    return rows + medians(rows)


def track_of(recording: FootRecording, noise: Noise | None = None) -> Track:
    """The foot's track, with the one setting unless other constants are given."""
    return walk_track(recording.t_s, recording.accel, recording.gyro, noise=noise)


def rows_of(recording: FootRecording, track: Track) -> list[FigureRow]:
    """One row for each figure of a recording."""
    return [_row(recording.group, recording.name, figure, way(track)) for figure in recording.judge(track)]


def medians(rows: list[FigureRow]) -> list[FigureRow]:
    """The median of each metric of a set that has several recordings; of its size where it has a sign."""
    median_rows = []
    for group, metric in dict.fromkeys((row.set, row.metric) for row in rows if row.set != "stairs"):
        same = [row for row in rows if (row.set, row.metric) == (group, metric)]
        if len(same) > 1:
            middle = FootFigure(metric, median(abs(row.value) for row in same))
            median_rows.append(
                _row(
                    group,
                    f"median of {len(same)}",
                    middle,
                    median(row.distance_m for row in same if row.distance_m is not None),
                )
            )
    return median_rows


def _row(group: str, name: str, figure: FootFigure, way_m: float) -> FigureRow:
    peer_name, peer = figure.peer or (None, None)
    return FigureRow(
        set=group,
        recording=name,
        metric=figure.metric,
        value=round(figure.value, 4),
        distance_m=round(way_m, 2),
        peer=peer,
        peer_name=peer_name,
    )


def _printed(row: FigureRow) -> dict[str, Any]:
    """With three digits, and the peer's name beside its figure."""
    columns = as_dict(row)
    peer = "" if row.peer is None else f"{row.peer:.3f} {row.peer_name}"
    digits = {key: f"{columns[key]:.3f}" for key in ("value", "left_out") if columns.get(key) is not None}
    return columns | digits | {"peer": peer}


def draw_tracks(path: Path, recordings: list[FootRecording], tracks: list[Track]) -> None:
    """Every track from above, on its truth where that is a path, as one picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure as Sheet
    from matplotlib.lines import Line2D

    from echostep_app.output.track_plot import TRACK_COLOUR, TRUTH_COLOUR

    across = 6
    down = -(-len(recordings) // across)
    sheet = Sheet(figsize=(3 * across, 3 * down), dpi=80, layout="constrained")
    FigureCanvasAgg(sheet)
    for k, (recording, track) in enumerate(zip(recordings, tracks, strict=True)):
        axes = sheet.add_subplot(down, across, k + 1, aspect="equal", title=f"{recording.group} {recording.name}")
        xy = track.position_m[:, :2]
        if recording.truth_m is not None and recording.truth_t_s is not None:
            axes.plot(*recording.truth_m.T, color=TRUTH_COLOUR, linewidth=3, alpha=0.5)
            xy = align(places(track, recording.truth_t_s), recording.truth_m)
        axes.plot(*xy.T, color=TRACK_COLOUR, linewidth=1)
        axes.set(xlabel="x / m", ylabel="y / m")
    handles = [Line2D([], [], color=TRACK_COLOUR, label="track"), Line2D([], [], color=TRUTH_COLOUR, label="truth")]
    sheet.legend(handles=handles, loc="outside lower center", ncols=2)
    save(sheet, path)
