# SPDX-License-Identifier: MIT
"""Pictures of plans, PNG, SVG or PDF: rooms, walls, windows, doors, exits, stairs and lifts, and the findings of the check.

In: a `Plan`, levels, a rectangle, findings. Out: a file. Owns the colours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from echostep.plan import Connector, Level, Plan, Room
from echostep_app.plan.cropping import Bounds, extent, within
from echostep_app.plan.pictures.labels import Label, draw_labels, fonts_for
from echostep_app.plan.pictures.symbols import exit_lines
from echostep_app.plan.places.faces import find_faces
from echostep_app.plan.places.spaces import MOST_WALLS
from echostep_app.printing.picture_files import check_picture, save_picture, svg_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from echostep_app.plan.places.findings import PlanFinding

WALL, WINDOW, DOOR, OBSTACLE = "#333333", "#56b4e9", "#d55e00", "#bbbbbb"
ROOM, ROOM_NAME = "#f3efe6", "#555555"
WAY, WAY_NAME = "#009e73", "#00553e"  # stairs, lifts and ramps
WRONG = "#d0021b"
SOFTWARE = "echostep plan"  # in the header of a PNG, so that `plan import` recognises its own pictures
WIDTH_PX = 1500  # least width of a picture
LEVEL_WIDTH_PX = 900  # least width of a level
GROUND = (1.0, 1.0, 1.0, 0.85)  # of a picture that lies on a map
BARE_DPI = 150  # of a picture without frame: lines are twice as wide in pixels as in points
MANY = 20_000  # with more lines than this, pixels are drawn instead of lines
BESIDE_RING_PT = (  # of a finding's number
    (9.0, 9.0), (9.0, -9.0), (-9.0, 9.0), (-9.0, -9.0), (0.0, 14.0), (0.0, -14.0), (16.0, 0.0), (-16.0, 0.0),
)  # fmt: skip
MOST_NAMES = 500  # names of rooms on one level; with more of them none is drawn, because they cannot be read


class Layer(NamedTuple):
    """What is drawn on the levels, under their names: `draw` is called with the axes and the index of each. Its handles in the legend, the title."""

    draw: Callable[[Any, int], None]
    legend: Sequence[Any]
    title: str


@dataclass(frozen=True, slots=True)
class View:
    """A rectangle of the map on paper. `points_m`: points (1/72 inch) per metre; `pixel_m`: metres per pixel."""

    bounds: Bounds
    points_m: float
    pixel_m: float


def draw_plan(
    plan: Plan, path: Path, levels: Sequence[int], bounds: Bounds | None = None, findings: Sequence[PlanFinding] = ()
) -> str:
    """Draw levels side by side, all of them or the part within the bounds; raises EchostepError when the file cannot be written.

    Returns the letters of names that no installed font has.
    """
    check_picture(path)
    with fonts_for(texts_of(plan, levels)) as missing:
        save_picture(plan_figure(plan, levels, bounds, findings), path, software=SOFTWARE, private=False)
    return missing


def plan_svg(plan: Plan) -> str:
    """All levels as SVG, for a notebook."""
    levels = range(len(plan.levels))
    with fonts_for(texts_of(plan, levels)):
        return svg_text(plan_figure(plan, levels))


def texts_of(plan: Plan, levels: Sequence[int]) -> Iterator[str]:
    """All names on levels."""
    for i in levels:
        yield plan.levels[i].name
        yield from (room.name for room in plan.levels[i].rooms)
    yield from (connector.name for connector in plan.connectors)


def plan_figure(
    plan: Plan, levels: Sequence[int], bounds: Bounds | None = None, findings: Sequence[PlanFinding] = (), layer: Layer | None = None
) -> Figure:  # fmt: skip
    """Levels side by side, all of them or the part within the bounds, with findings and a layer; call it within `fonts_for(texts_of(...))`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    columns = math.ceil(math.sqrt(len(levels)))
    wide_px = max(WIDTH_PX, LEVEL_WIDTH_PX * columns)
    rows = math.ceil(len(levels) / columns)
    x0, y0, x1, y1 = bounds or _about([plan.levels[i] for i in levels])
    shape = min(max((y1 - y0) / (x1 - x0), 0.3), 2.5)
    cell = 10.0 if columns == 1 else 6.0  # inches
    size = (cell * columns, ((cell - 0.4) * shape + 0.5) * rows)
    layout = ConstrainedLayoutEngine()
    figure = Figure(figsize=size, dpi=max(60, round(wide_px / size[0])), layout=layout)
    FigureCanvasAgg(figure)
    view = View((x0, y0, x1, y1), 72.0 * cell / (x1 - x0), 1.1 * max(x1 - x0, (y1 - y0) / shape) * columns / wide_px)
    drawn = {}
    for number, i in enumerate(levels):
        drawn[i] = figure.add_subplot(rows, columns, number + 1, aspect="equal")
        _draw_level(drawn[i], plan, i, view, [f for f in findings if f.level == i])
    if layer is not None:
        figure.suptitle(shown(layer.title), size=10, parse_math=False)
    _draw_legend(figure, plan, levels, layer.legend if layer else ())
    layout.execute(figure)
    figure.set_layout_engine("none")
    for i, axes in drawn.items():
        axes.apply_aspect()
        if layer is not None:
            layer.draw(axes, i)
        _draw_names(axes, plan, i, view, [f for f in findings if f.level == i])
    return figure


def draw_bare_level(plan: Plan, level: int, bounds: Bounds, pixels_per_m: float, file: IO[bytes]) -> None:
    """Write a level within the bounds as PNG without frame, to the edge of the picture, on a transparent ground."""
    with fonts_for(texts_of(plan, [level])):
        _draw_bare(plan, level, bounds, pixels_per_m, file)


def _draw_bare(plan: Plan, level: int, bounds: Bounds, pixels_per_m: float, file: IO[bytes]) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width_m, height_m = bounds[2] - bounds[0], bounds[3] - bounds[1]
    points_m = 72.0 * pixels_per_m / BARE_DPI
    figure = Figure(figsize=(width_m * pixels_per_m / BARE_DPI, height_m * pixels_per_m / BARE_DPI), dpi=BARE_DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    view = View(bounds, points_m, 1.0 / pixels_per_m)
    _draw_ground(axes, plan.levels[level])
    _draw_level(axes, plan, level, view, ())
    axes.set_axis_off()
    axes.set_title("")
    _draw_names(axes, plan, level, view, ())
    axes.set_title("")
    figure.savefig(file, format="png", transparent=True, metadata={"Software": None})


def _draw_ground(axes: Any, level: Level) -> None:
    """White, nearly opaque, between the walls and along each wall: legible on any map."""
    from matplotlib.collections import LineCollection, PolyCollection

    areas = (
        [np.array(area.exterior.coords) for area in find_faces(level).areas] if len(level.solid) <= MOST_WALLS else []
    )
    axes.add_collection(PolyCollection(areas, facecolors=GROUND, edgecolors="none", zorder=-2))
    if len(level.solid) <= MANY:
        halo = LineCollection(list(level.solid.reshape(-1, 2, 2)), colors=GROUND, linewidths=3.5, zorder=-1)
        axes.add_collection(halo)


def _about(levels: Sequence[Level]) -> Bounds:
    """The rectangle around all elements of these levels, with a margin."""
    boxes = np.array([extent(level.solid) for level in levels if len(level.solid)] or [extent(levels[0].solid)])
    x0, y0 = boxes[:, :2].min(axis=0)
    x1, y1 = boxes[:, 2:].max(axis=0)
    edge = 0.03 * max(x1 - x0, y1 - y0, 1.0)
    return x0 - edge, y0 - edge, x1 + edge, y1 + edge


def _draw_level(axes: Any, plan: Plan, level_index: int, view: View, findings: Sequence[PlanFinding]) -> None:
    """One level with its findings, from the lowest layer to the highest."""
    level = plan.levels[level_index]
    connectors = [connector for connector in plan.connectors if level_index in connector.levels]
    _draw_areas(axes, level, connectors)
    _lines(axes, level.walls, view, WALL, 0.9)
    _lines(axes, level.windows, view, WINDOW, 0.9)
    _lines(axes, level.doubtful, view, OBSTACLE, 0.9)
    _lines(axes, np.array([door.line for door in level.doors]).reshape(-1, 4), view, DOOR, 1.1)
    if plan.start is not None and plan.start.level == level_index:
        marker = (3, 0, math.degrees(plan.start.heading_rad) - 90)  # a triangle that points along the heading
        axes.plot(plan.start.x_m, plan.start.y_m, marker=marker, color=WAY, markersize=9, zorder=6)
    for row in exit_lines(plan, level_index).tolist():
        _draw_exit(axes, *row)
    for finding in findings:
        _mark(axes, finding)
    _draw_frame(axes, level, view)


def _draw_areas(axes: Any, level: Level, connectors: Sequence[Connector]) -> None:
    """Rooms, then stairs, lifts and ramps, then obstacles, as filled outlines."""
    from matplotlib.collections import PolyCollection

    rooms = [room.outline_m for room in level.rooms if room.outline_m is not None]
    ways = [connector.outline_m for connector in connectors]
    axes.add_collection(PolyCollection(rooms, facecolors=ROOM, edgecolors="none", zorder=0))
    axes.add_collection(PolyCollection(ways, facecolors=WAY, alpha=0.3, edgecolors="none", zorder=1))
    obstacles = PolyCollection(list(level.obstacles), facecolors=OBSTACLE, edgecolors=WALL, linewidths=0.5, zorder=1)
    axes.add_collection(obstacles)


def _draw_names(axes: Any, plan: Plan, level_index: int, view: View, findings: Sequence[PlanFinding]) -> None:
    """Numbers of findings, names of connectors, and names of rooms, the largest first, unless there are too many to read; without overlap."""
    level = plan.levels[level_index]
    labels = [Label(f.position_m, str(f.number), 7, WRONG, BESIDE_RING_PT) for f in findings]
    for connector in plan.connectors:
        if level_index in connector.levels:
            x_m, y_m = connector.outline_m.mean(axis=0).tolist()
            labels.append(Label((x_m, y_m), shown(connector.name), 6, WAY_NAME))
    x0, y0, x1, y1 = view.bounds
    rooms = [room for room in level.rooms if x0 <= room.at_m[0] <= x1 and y0 <= room.at_m[1] <= y1]
    if len(rooms) <= MOST_NAMES:
        sized = [Label(room.at_m, shown(room.name), _font_size_pt(room, view.points_m), ROOM_NAME) for room in rooms]
        labels += sorted(sized, key=lambda label: -label.size_pt)
    if left_out := draw_labels(axes, labels):
        what = "name does" if left_out == 1 else "names do"
        axes.title.set_text(f"{axes.title.get_text()} ({left_out} {what} not fit: --bounds shows a part larger)")


def _draw_legend(figure: Figure, plan: Plan, levels: Sequence[int], more: Sequence[Any]) -> None:
    """The legend below the picture: the colour of each kind that these levels have, and `more`."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    seen = [plan.levels[i] for i in levels]
    ways = any(set(connector.levels) & set(levels) for connector in plan.connectors)
    has_start = plan.start is not None and plan.start.level in levels
    kinds = (
        (Line2D([], [], color=WALL, label="wall"), any(len(level.walls) for level in seen)),
        (Line2D([], [], color=WINDOW, label="window"), any(len(level.windows) for level in seen)),
        (Line2D([], [], color=DOOR, label="door"), any(level.doors for level in seen)),
        (Line2D([], [], color=OBSTACLE, label="doubtful wall"), any(len(level.doubtful) for level in seen)),
        (Patch(color=OBSTACLE, label="obstacle"), any(level.obstacles for level in seen)),
        (Patch(color=WAY, alpha=0.3, label="stairs, lift, ramp"), ways),
        (Line2D([], [], color=WAY, marker=(3, 0, 0), linestyle="", label="start"), has_start),
    )
    if handles := [*(handle for handle, is_drawn in kinds if is_drawn), *more]:
        figure.legend(handles=handles, loc="outside lower center", ncols=8, fontsize=7, frameon=False)


def _draw_exit(axes: Any, x0: float, y0: float, x1: float, y1: float) -> None:
    """The sign, in its box on the door, and the line out of it."""
    axes.plot((x0, x1), (y0, y1), color=WAY_NAME, linewidth=1.5, zorder=6)
    box = {"boxstyle": "square", "facecolor": WAY_NAME, "edgecolor": "none"}
    axes.text(x0, y0, "EXIT", size=5, color="white", bbox=box, ha="center", va="center", clip_on=True, zorder=6)


def _draw_frame(axes: Any, level: Level, view: View) -> None:
    """Limits, title and ticks."""
    x0, y0, x1, y1 = view.bounds
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    axes.set_title(shown(f"{level.name}, {level.height_m:g} m"), size=9, parse_math=False)
    axes.set_xlabel("x / m", size=6, color="#888888")
    axes.set_ylabel("y / m", size=6, color="#888888")
    axes.tick_params(labelsize=6, colors="#888888")
    for side in axes.spines.values():
        side.set_color("#dddddd")


def shown(name: str) -> str:
    """A name as it is drawn: unprintable characters become spaces, and only the first 80 characters are kept."""
    return "".join(letter if letter.isprintable() else " " for letter in name)[:80]


def _font_size_pt(room: Room, points_m: float) -> float:
    """Font size with which a room's name fits into its outline, between 3 and 8 points; 6 points without an outline."""
    if room.outline_m is None:
        return 6.0
    x, y = room.outline_m.T
    area_m2 = 0.5 * abs(float(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))))
    wide_m = min(float(np.ptp(x)), 1.1 * math.sqrt(area_m2))
    return min(8.0, max(3.0, wide_m * points_m / (0.6 * max(len(room.name), 1))))


def _lines(axes: Any, segments: Any, view: View, colour: str, width: float) -> None:
    """Segments as lines; as pixels when there are very many."""
    from matplotlib.collections import LineCollection

    seen = within(segments, view.bounds)
    if len(seen) <= MANY:
        axes.add_collection(
            LineCollection(list(seen.reshape(-1, 2, 2)), colors=colour, linewidths=width, capstyle="round", zorder=3)
        )
    else:
        image = np.zeros((*(drawn := _pixels(seen, view)).shape, 4), dtype=np.uint8)
        image[drawn] = (*(int(colour[k : k + 2], 16) for k in (1, 3, 5)), 255)
        x0, y0, x1, y1 = view.bounds
        axes.imshow(image, extent=(x0, x1, y0, y1), origin="lower", interpolation="nearest", zorder=3)


def _pixels(segments: Any, view: View) -> Any:
    """Boolean image (rows, columns) of the pixels that segments (n, 4) pass through: points along each segment, one pixel apart."""
    x0, y0, x1, y1 = view.bounds
    width, height = (max(1, math.ceil((high - low) / view.pixel_m)) for low, high in ((x0, x1), (y0, y1)))
    image = np.zeros((height, width), dtype=bool)
    counts = np.minimum(
        np.ceil(np.abs(segments[:, 2:] - segments[:, :2]).max(axis=1) / view.pixel_m) + 1, 2 * WIDTH_PX
    ).astype(int)
    for first in range(0, len(segments), 100_000):
        some, count = segments[first : first + 100_000], counts[first : first + 100_000]
        row = np.repeat(np.arange(len(some)), count)
        step = (np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)) / np.maximum(count[row] - 1, 1)
        x, y = (some[row, :2] + step[:, None] * (some[row, 2:] - some[row, :2])).T
        column, line = ((x - x0) / (x1 - x0) * width).astype(int), ((y - y0) / (y1 - y0) * height).astype(int)
        seen = (column >= 0) & (column < width) & (line >= 0) & (line < height)
        image[line[seen], column[seen]] = True
    return image


def _mark(axes: Any, finding: PlanFinding) -> None:
    """A ring at the finding's position, and the lines that are wrong."""
    for x0, y0, x1, y1 in finding.lines_m:
        axes.plot((x0, x1), (y0, y1), color=WRONG, linewidth=2.0, alpha=0.6, zorder=7)
    axes.plot(*finding.position_m, "o", markersize=11, mfc="none", mec=WRONG, mew=1.2, zorder=8)
