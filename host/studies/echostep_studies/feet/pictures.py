# SPDX-License-Identifier: MIT
"""The tracks of the recordings from above.

In: recordings and their tracks. Out: a PNG. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path

from echostep.foot.steps import Track
from echostep_studies.bench.recordings.feet import FootRecording
from echostep_studies.bench.recordings.foot_metrics import align, places
from echostep_studies.frame.pictures import save


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
