# SPDX-License-Identifier: MIT
"""Draws the walls of a walk without a plan while it goes on, in a process of its own: the tracker never waits for it.

In: measured segments and estimates, in the tracker's thread. Out: `ShownDrawing`s, in a thread that waits for the process. Owns both. A live run's
process rests after each drawing as long as it has computed: half a core at most. A replay's draws at the same places of the walk, however fast it
is computed; each stretch is longer by a share of the way, so that an hour is drawn 150 times.
"""

from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import IO

from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep_app.extras import lacks
from echostep_app.page.elements.drawn_walls import ShownDrawing, WalkDrawing, shown_drawing, walk_drawing

STRETCH_M = 8.0  # of path, from which a new drawing is made: a few seconds
LONGER = 0.02  # share of the way so far by which the stretches of a replay are longer
MOST_SEGMENTS = 40_000  # of a walk, about four hours; later ones are tracked, not drawn
NICE = 10  # the tracker goes first
END_S = 5.0  # for the thread to end
# Bytes from which an array has pages of its own, given back when it is freed. glibc raises this limit by itself: then the arrays of each drawing, a
# little longer than the ones before, fit into none of their holes, and an hour's walk takes 1 GB.
PAGES = {"MALLOC_MMAP_THRESHOLD_": "262144"}
CHILD = "from echostep_app.page.drawing_process import main; main()"
# With the estimate at its end, and how many points the trail has then
Stretch = tuple[list[MeasuredSegment], Estimate, int]


class DrawingProcess:
    """Call `add` with each segment; `show` is called with each drawing, in another thread. The process begins with the first stretch."""

    def __init__(self, show: Callable[[ShownDrawing], None], fail: Callable[[str], object], *, live: bool) -> None:
        """`fail` is called with the words for an early end; `live`: rest between two drawings."""
        self._show, self._fail, self._live = show, fail, live
        self._stretches = Stretches(LONGER if not live else 0.0)
        self._changed = threading.Condition()
        self._ends = threading.Event()
        self._child: subprocess.Popen[bytes] | None = None
        self._thread = threading.Thread(target=self._run, name="echostep drawing", daemon=True)
        self._thread.start()

    def add(self, measured: MeasuredSegment, estimate: Estimate, trail_count: int) -> None:
        """A segment, the estimate at its end, and how many points the trail has then."""
        with self._changed:
            self._stretches.add(measured, estimate, trail_count)
            self._changed.notify()

    def close(self) -> None:
        """End the process."""
        with self._changed:
            self._ends.set()
            self._changed.notify()
            if self._child:
                self._child.kill()
        self._thread.join(END_S)

    def _run(self) -> None:
        if words := lacks("the drawing of walls", "scipy"):
            self._fail(f"no walls are drawn: {words}")
            return
        try:
            while (stretch := self._next()) is not None:
                segments, estimate, trail_count = stretch
                drawing, used_s = self._drawn(segments)
                self._show(shown_drawing(drawing, estimate, trail_count))
                if self._live:
                    self._ends.wait(used_s)
        except (OSError, EOFError, ValueError, pickle.UnpicklingError) as error:
            if not self._ends.is_set():
                self._fail(f"the walls are no longer drawn: {type(error).__name__}")
        finally:
            if self._child:
                self._child.kill()
                with suppress(OSError):
                    self._child.communicate()

    def _next(self) -> Stretch | None:
        """The next stretch, when it is complete; None at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._ends.is_set() or self._stretches.ready)
            if self._ends.is_set():
                return None
            self._child = self._child or subprocess.Popen(
                [sys.executable, "-c", CHILD],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | PAGES,
                start_new_session=True,  # Ctrl-C is for the run
            )
            return self._stretches.pop()

    def _drawn(self, segments: list[MeasuredSegment]) -> tuple[WalkDrawing, float]:
        """The drawing with these segments, and the seconds of the processor that it took."""
        child = self._child
        assert child is not None
        assert child.stdin is not None
        assert child.stdout is not None
        _send(child.stdin, segments)
        drawing, used_s = pickle.load(child.stdout)
        return drawing, used_s


class Stretches:
    """Segments that wait, cut into stretches of STRETCH_M, or of `longer` of the way before them."""

    def __init__(self, longer: float) -> None:
        self._longer = longer
        self._count = 0
        self._done_m = 0.0  # way of the stretches so far
        self._way_m = 0.0  # of the newest
        self._stretch: list[MeasuredSegment] = []
        self._cut: list[Stretch] = []

    def add(self, measured: MeasuredSegment, estimate: Estimate, trail_count: int) -> None:
        """A segment; beyond MOST_SEGMENTS it is dropped."""
        self._count += 1
        if self._count > MOST_SEGMENTS:
            return
        self._stretch.append(measured)
        self._way_m += math.hypot(measured.segment.dx_m, measured.segment.dy_m)
        if self._way_m >= max(STRETCH_M, self._longer * self._done_m):
            self._done_m += self._way_m
            self._cut.append((self._stretch, estimate, trail_count))
            self._stretch, self._way_m = [], 0.0

    @property
    def ready(self) -> bool:
        """Whether a stretch is complete."""
        return bool(self._cut)

    def pop(self) -> Stretch:
        """In a replay the oldest stretch; live, all of them as one."""
        if self._longer:
            return self._cut.pop(0)
        segments = [measured for stretch, _, _ in self._cut for measured in stretch]
        _, estimate, trail_count = self._cut[-1]
        self._cut.clear()
        return segments, estimate, trail_count


def _send(to: IO[bytes], what: object) -> None:
    pickle.dump(what, to)
    to.flush()


def main() -> None:
    """The process: a drawing, and the seconds of the processor that it took, for each stretch."""
    from echostep_app.mapping.growing import GrowingMap

    with suppress(AttributeError, OSError):
        os.nice(NICE)
    growing = GrowingMap()
    while True:
        try:
            segments: list[MeasuredSegment] = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        began_s = time.process_time()
        mapped = growing.grow(segments)
        _send(sys.stdout.buffer, (walk_drawing(mapped), time.process_time() - began_s))
