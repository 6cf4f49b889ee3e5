# SPDX-License-Identifier: MIT
"""Pictures of single recorded sensors: a foot's track and its height, a leg's track and its strides, the floors of a barometer.

In: a track, strides, floors. Out: a figure of matplotlib, or a PNG, SVG or PDF. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from echostep.arrays import Floats
from echostep.legs.stride import Flag, Stride
from echostep_app.output.track_plot import TRACK_COLOUR, TRUTH_COLOUR
from echostep_app.printing.picture_files import save_picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from echostep.foot.steps import Track
    from echostep_app.offline.floors.floors import Floors

PARTIAL_COLOUR = "#999999"
MOST_POINTS = 5000  # about, of a curve


def draw_foot(path: Path, track: Track, title: str) -> None:
    """Draw the track as PNG, SVG or PDF, by the ending of the name; raises EchostepError when the file cannot be written."""
    save_picture(foot_figure(track, title), path)


def foot_figure(track: Track, title: str) -> Figure:
    """The foot's path from above and its height over time, stances as dots."""
    x, y, z = track.position_m.T
    figure, above, side = _panels(title, 3)
    above.plot(x, y, color=TRACK_COLOUR, linewidth=1, label="foot")
    above.plot(x[track.stance], y[track.stance], ".", color=TRUTH_COLOUR, markersize=3, label="foot stands")
    above.plot(x[:1], y[:1], "k^", label="start")
    above.set(aspect="equal")
    above.legend(fontsize=8)
    side.plot(track.t_s, z, color=TRACK_COLOUR, linewidth=1, label="foot")
    side.set(ylabel="height / m")
    side.legend(fontsize=8)
    return figure


def draw_legs(path: Path, rows: Floats, strides: Sequence[Stride], title: str) -> None:
    """Draw the path from above with the ends of strides, and the length of each stride over time.

    `rows` (n, 6): time, distance, speed, heading, x, y. Raises EchostepError when the file cannot be written.
    """
    t_s, x, y = rows[:, 0], rows[:, 4], rows[:, 5]
    figure, above, side = _panels(title, 2)
    above.plot(x, y, color=TRACK_COLOUR, linewidth=1, label="track")
    ends = t_s.searchsorted([s.t_end_s for s in strides if s.length_m > 0.0]).clip(0, len(t_s) - 1)
    above.plot(x[ends], y[ends], ".", color=TRUTH_COLOUR, markersize=5, label="end of a stride")
    above.plot(x[:1], y[:1], "k^", label="start")
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
    side.set(ylabel="stride / m", xlim=(t_s[0], t_s[-1]), ylim=(0.0, None))
    save_picture(figure, path)


def draw_floors(path: Path, floors: Floors, title: str) -> None:
    """Draw height and floor over time, and the probability of the floor; raises EchostepError when the file cannot be written."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), dpi=120, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    few = slice(None, None, max(1, len(floors.t_s) // MOST_POINTS))
    t_s, heights_m = floors.t_s[few], floors.heights_m
    above.set_yticks(heights_m, [f"{k}: {height:g}" for k, height in enumerate(heights_m.tolist())])
    above.grid(axis="y")
    above.plot(t_s, floors.height_m[few], color=TRACK_COLOUR, linewidth=1, label="height")
    above.step(
        t_s, heights_m[floors.floor[few]], color=TRUTH_COLOUR, where="post", linewidth=2, alpha=0.5, label="floor"
    )
    above.set_title(title, parse_math=False)
    above.set(ylabel="floor: height / m")
    above.legend(fontsize=8)
    below.plot(t_s, floors.probability[few], color=TRUTH_COLOUR, linewidth=1)
    below.set(xlabel="t / s", ylabel="probability", ylim=(0.0, 1.05))
    save_picture(figure, path)


def _panels(title: str, ratio: float) -> tuple[Figure, Axes, Axes]:
    """A panel for the path from above, `ratio` times as high as the one below it, for what goes with time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 7), dpi=120, layout="constrained")
    above, side = figure.subplots(2, 1, height_ratios=(ratio, 1))
    above.set_title(title, parse_math=False)
    above.set(xlabel="x / m", ylabel="y / m")
    side.set_xlabel("t / s")
    return figure, above, side
