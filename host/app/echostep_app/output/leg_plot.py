# SPDX-License-Identifier: MIT
"""The picture of a recorded leg's track.

In: rows of a track, strides. Out: a PNG, SVG or PDF. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from echostep.arrays import Floats
from echostep.legs.stride import Flag, Stride
from echostep_app.output.track_plot import TRACK_COLOUR, TRUTH_COLOUR
from echostep_app.printing.picture_files import save_picture

PARTIAL_COLOUR = "#999999"


def draw_legs(path: Path, rows: Floats, strides: Sequence[Stride], title: str) -> None:
    """Draw the path from above with the ends of strides, and the length of each stride over time.

    `rows` (n, 6): time, distance, speed, heading, x, y. Raises EchostepError when the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    above, side = figure.subplots(2, 1, height_ratios=(2, 1))
    t_s, x, y = rows[:, 0], rows[:, 4], rows[:, 5]
    above.plot(x, y, color=TRACK_COLOUR, linewidth=1, label="track")
    ends = t_s.searchsorted([s.t_end_s for s in strides if s.length_m > 0.0]).clip(0, len(t_s) - 1)
    above.plot(x[ends], y[ends], ".", color=TRUTH_COLOUR, markersize=5, label="end of a stride")
    above.plot(x[:1], y[:1], "k^", label="start")
    above.set_title(title, parse_math=False)
    above.set(xlabel="x / m", ylabel="y / m")
    above.axis("equal")
    above.legend(fontsize=8)
    for stride in (s for s in strides if Flag.STANDING not in s.flags):
        colour = PARTIAL_COLOUR if stride.flags & (Flag.EDGE | Flag.GAP) or stride.length_m == 0.0 else TRACK_COLOUR
        side.bar(
            0.5 * (stride.t_start_s + stride.t_end_s), stride.length_m, 0.9 * (stride.t_end_s - stride.t_start_s), color=colour,
            yerr=stride.length_sd_m, error_kw={"elinewidth": 0.8},
        )  # fmt: skip
    side.bar([], [], color=TRACK_COLOUR, label="stride, 1 sd")
    side.bar([], [], color=PARTIAL_COLOUR, label="at an edge or a gap")
    side.legend(fontsize=8)
    side.set(xlabel="t / s", ylabel="stride / m", xlim=(t_s[0], t_s[-1]), ylim=(0.0, None))
    save_picture(figure, path)
