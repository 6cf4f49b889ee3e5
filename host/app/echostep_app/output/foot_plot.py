# SPDX-License-Identifier: MIT
"""The picture of a foot's track: from above, and its height over time.

In: a track. Out: a figure of matplotlib, or a PNG, SVG or PDF. Owns nothing.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from echostep_app.printing.picture_files import save_picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from echostep.foot.steps import Track

TRACK_COLOUR, STANCE_COLOUR = "#0072b2", "#009e73"  # distinguishable with colour blindness [Okabe and Ito 2008]


def draw_foot(path: Path, track: Track, title: str) -> None:
    """Draw the track as PNG, SVG or PDF, by the ending of the name; raises EchostepError when the file cannot be written."""
    save_picture(foot_figure(track, title), path)


def foot_figure(track: Track, title: str) -> Figure:
    """The foot's path from above and its height over time, stances as dots."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    above, side = figure.subplots(2, 1, height_ratios=(3, 1))
    x, y, z = track.position_m.T
    above.plot(x, y, color=TRACK_COLOUR, linewidth=1, label="foot")
    above.plot(x[track.stance], y[track.stance], ".", color=STANCE_COLOUR, markersize=3, label="foot stands")
    above.plot(x[:1], y[:1], "k^", label="start")
    above.set_title(title, parse_math=False)
    above.set(aspect="equal", xlabel="x / m", ylabel="y / m")
    above.legend(fontsize=8)
    side.plot(track.t_s, z, color=TRACK_COLOUR, linewidth=1, label="foot")
    side.set(xlabel="t / s", ylabel="height / m")
    side.legend(fontsize=8)
    return figure
