# SPDX-License-Identifier: MIT
"""The terminal view: plan, track and health of the streams, redrawn ten times a second.

In: a tracker and its estimates. Out: text on the terminal. Owns the canvas.
Messages of a beacon gateway are counted in words.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from itertools import groupby
from operator import itemgetter
from types import TracebackType
from typing import Self

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.text import Text

from echostep.arrays import Octets
from echostep.board.gateway import Gateway
from echostep.localization import Estimate
from echostep.plan import Level, Plan
from echostep.tracker import Tracker
from echostep_app.board.faults.health import Finding, Severity, all_findings
from echostep_app.plan.places.bearing import heading_words
from echostep_app.wearer.steady_status import SteadyStatus, elsewhere, fitting, running_note

REFRESH_S = 0.1
MAX_FINDINGS = 3  # shown at a time
BELOW = 9  # lines of words and frame around the canvas
SILENT_S = 2.0  # without a sample
# Bits of a braille character by row and column [Unicode, block 2800]
DOTS = (0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80)
BRAILLE = 0x2800


class Canvas:
    """The walls of a level and the track in braille dots, two by four per character."""

    def __init__(self, level: Level, columns: int, rows: int) -> None:
        ends = level.walls.reshape(-1, 2) if len(level.walls) else np.array([[0.0, 0.0], [10.0, 10.0]])
        self._low = ends.min(0)
        extent = np.maximum(ends.max(0) - self._low, 1.0)
        self._scale = float(min((2 * columns - 1) / extent[0], (4 * rows - 1) / extent[1]))
        self._columns = math.ceil((extent[0] * self._scale + 1) / 2)
        self._rows = math.ceil((extent[1] * self._scale + 1) / 4)
        self._walls = np.zeros((self._rows, self._columns), np.uint8)
        self._track = np.zeros_like(self._walls)
        self._last: Estimate | None = None
        for x0, y0, x1, y1 in level.walls:
            self.line(self._walls, x0, y0, x1, y1)

    def line(self, layer: Octets, x0: float, y0: float, x1: float, y1: float) -> None:
        """Set the dots of a line from (x0, y0) to (x1, y1), map frame, m, in a layer."""
        steps = int(math.hypot(x1 - x0, y1 - y0) * self._scale) + 1
        for k in range(steps + 1):
            self._dot(layer, x0 + (x1 - x0) * k / steps, y0 + (y1 - y0) * k / steps)

    def extend_track(self, estimate: Estimate) -> None:
        """Draw the track from the previous estimate to this one."""
        before, self._last = self._last or estimate, estimate
        self.line(self._track, before.x_m, before.y_m, estimate.x_m, estimate.y_m)

    def _dot(self, layer: Octets, x: float, y: float) -> None:
        column, row = self._dot_of(x, y)
        if 0 <= column < 2 * self._columns and 0 <= row < 4 * self._rows:
            layer[row // 4, column // 2] |= DOTS[row % 4][column % 2]

    def _dot_of(self, x: float, y: float) -> tuple[int, int]:
        column = round((x - self._low[0]) * self._scale)
        return column, 4 * self._rows - 1 - round((y - self._low[1]) * self._scale)

    def render(self, here: Estimate | None) -> Text:
        """The canvas as text: walls grey, track blue, the wearer a yellow dot at `here`; a style is given once for all its neighbours in a row."""
        mark = (-1, -1) if here is None else self._dot_of(here.x_m, here.y_m)
        text = Text()
        for r in range(self._rows):
            for style, cells in groupby(self._row(r, mark), key=itemgetter(0)):
                text.append("".join(cell for _, cell in cells), style=style)
            text.append("\n")
        return text

    def _row(self, r: int, mark: tuple[int, int]) -> Iterator[tuple[str, str]]:
        """Style and character of each cell of a row."""
        for c in range(self._columns):
            if (mark[1] // 4, mark[0] // 2) == (r, c):
                yield "bold bright_yellow", "●"
            elif self._track[r, c]:
                yield "bright_blue", chr(BRAILLE + int(self._track[r, c] | self._walls[r, c]))
            else:
                yield "grey62", chr(BRAILLE + int(self._walls[r, c]))


class TerminalView:
    """Shows a running tracker; `progress` gives the finished fraction of the run, 0 to 1; None when it is not known."""

    def __init__(
        self, tracker: Tracker, title: str, progress: Callable[[], float] | None = None, console: Console | None = None
    ) -> None:
        self._tracker = tracker
        self._title = title
        pose = tracker.start.pose if tracker.start else None
        level = pose.level if pose else 0
        self._level = level if level in range(len(tracker.plan.levels)) else 0
        share = [TextColumn("{task.percentage:>3.0f} %")] if progress else []
        self._progress = Progress(TextColumn("{task.description}"), BarColumn(), *share, TimeElapsedColumn())
        self._fraction = progress
        self._bar = self._progress.add_task("walk", total=1.0 if progress else None)
        self._last: Estimate | None = None
        self._steady = SteadyStatus()
        self._drawn_s = 0.0
        self._live = Live(console=console, auto_refresh=False, transient=False)
        self._canvas = self._empty()
        self._samples, self._heard_s = 0, time.monotonic()

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.show([], final=True)
        self._live.__exit__(kind, error, at)

    def _empty(self) -> Canvas:
        """A canvas of the level that fills the terminal."""
        columns, rows = self._live.console.size
        return Canvas(self._tracker.plan.levels[self._level], max(columns - 4, 20), max(rows - BELOW, 6))

    def _level_text(self) -> str:
        """Name, probability and height of the level; empty when the plan has one level."""
        levels, here = self._tracker.plan.levels, self._last
        if len(levels) < 2 or here is None or not here.claims_place:
            return ""
        return f"   level {levels[here.level].name} ({100 * here.levels[here.level]:.0f} %), {here.z_m:.1f} m"

    def show(self, estimates: list[Estimate], notice: str = "", *, final: bool = False) -> None:
        """Add new estimates; redraw when REFRESH_S has passed since the last time, or when `final`; not on a terminal that was closed."""
        for e in estimates:
            if e.level != self._level:
                self._level = e.level
                self._canvas = self._empty()
            self._canvas.extend_track(e)
            self._last = self._steady.shown(e, self._tracker)
        now = time.monotonic()
        if not final and now - self._drawn_s < REFRESH_S:
            return
        self._drawn_s = now
        if (samples := self._tracker.streams.mtx.good) != self._samples:
            self._samples, self._heard_s = samples, now
        if not self._live.console.is_terminal:
            return
        if self._fraction:
            self._progress.update(self._bar, completed=self._fraction())
        parts = [
            self._canvas.render(self._last if self._last and self._last.claims_place else None),
            Text(describe(self._last, self._tracker.plan) + self._level_text()),
            Text(health(self._tracker, silent=now - self._heard_s > SILENT_S), style="grey62"),
            *(Text(str(finding), style="bold red") for finding in findings(self._tracker)),
        ]
        if gait := running_note(self._tracker.state.last_segment, self._last):
            parts.append(Text(gait))
        if notice:
            parts.append(Text(notice, style="bold"))
        self._live.update(Panel(Group(*parts, self._progress), title=self._title, expand=False), refresh=True)


def describe(e: Estimate | None, plan: Plan) -> str:
    """An estimate on a plan as a line of text."""
    if e is None:
        return "waiting for the foot to stand still"
    if not e.claims_place:
        places = f", {fitting(e.hypotheses)}" if e.hypotheses else ""
        return f"{e.status.value}: place not known{places}{elsewhere(e)}   step {e.step}   t {e.t_s:.1f} s"
    return (
        f"{e.status.value}, {e.ellipse95.major_m:.2f} m{elsewhere(e)}   x {e.x_m:.2f} m  y {e.y_m:.2f} m  "
        f"heading {heading_words(plan, e.heading_rad, e.heading_sd_rad)}   step {e.step}   t {e.t_s:.1f} s"
    )


def health(tracker: Tracker, *, silent: bool) -> str:
    """Counts of rejected, lost and dropped frames, the time source of the foot's samples, and the beacons, as a line of text."""
    streams = tracker.streams
    board, dropped = streams.board, streams.reports.dropped
    sync = "is silent" if silent else "on SyncOut" if streams.synchronised else "on arrival times"
    foot = f"{streams.foot_name} {sync}"
    gateway = f"   {gateway_words(tracker.gateway)}" if tracker.gateway.counts.words or tracker.gateway.numbers else ""
    return f"board: {board.good} frames, {board.rejected} bad, {board.lost} lost, {dropped} dropped   {foot}{gateway}"


def findings(tracker: Tracker) -> list[Finding]:
    """The most severe findings on the board, at most MAX_FINDINGS."""
    streams = tracker.streams
    found = all_findings(streams.reports, streams.foot_reports)
    return [finding for finding in found if finding.severity > Severity.NOTE][:MAX_FINDINGS]


def gateway_words(gateway: Gateway) -> str:
    """The counts that are not zero, as text."""
    counts = gateway.counts
    parts = [
        f"{value} {name.replace('_', ' ')}"
        for name in counts.__dataclass_fields__
        if name != "words" and (value := getattr(counts, name))
    ]
    rejected = f"; rejected: {', '.join(parts)}" if parts else ""
    numbers = ", ".join(map(str, sorted(gateway.duplicates)))
    duplicates = f"; two beacons have the number {numbers}" if numbers else ""
    return f"beacons: {len(gateway.numbers)} heard, {counts.words} readings{rejected}{duplicates}"
