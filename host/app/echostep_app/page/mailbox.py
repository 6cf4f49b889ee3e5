# SPDX-License-Identifier: MIT
"""The mailbox between the tracker's thread and the server's thread; neither waits for the other.

In: scenes from the tracker's thread, check-ins from the server's thread. Out: the latest scene (in a replay: the history of all scenes), the trail,
and the check-ins for the tracker. Owns these.
"""

from __future__ import annotations

import math
import queue
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import TypeVar

from echostep.plan import Plan
from echostep.ports.people.check_in import Call, CheckIn, Undo
from echostep_app.page.elements.drawn_walls import ShownDrawing
from echostep_app.page.elements.marks import BLOCKED, ShownMark, ShownOrder, closed_places
from echostep_app.page.elements.scene import PageScene
from echostep_app.page.over_time import OverTime
from echostep_app.page.web.exchange import Exchange
from echostep_app.plan.places.bearing import north_rad
from echostep_app.plan.routing import EXIT, Goal, RoutePlace

MOST_CHECK_INS = 16  # in the queue to the tracker; further ones are refused: a person makes a few in a minute

MOST_STRUCK = 32  # passages
SAME_M = 1.5  # from a passage that is struck out: a tap there means it

T = TypeVar("T")


class PageTrail:
    """The walked path as points. Points are only appended, so any thread may read the points up to a length that it has read before."""

    def __init__(self) -> None:
        self._rows = array("f")

    def __len__(self) -> int:
        return len(self._rows) // 3

    def add(self, x_m: float, y_m: float, level: int) -> None:
        """Append a point in map metres; NaN coordinates break the line."""
        self._rows.extend((x_m, y_m, level))

    def part(self, begin: int, end: int) -> bytes:
        """Points [begin, end) as rows of float32 x, y, level."""
        return self._rows[3 * begin : 3 * end].tobytes()


class SceneHistory:
    """All scenes of a replay, in order of `t_s`."""

    def __init__(self) -> None:
        self._scenes: list[PageScene] = []
        self._t_s: list[float] = []

    def __len__(self) -> int:
        return len(self._t_s)

    def add(self, scene: PageScene) -> None:
        """Append a scene; one that is earlier than the last scene gets the last scene's time."""
        self._scenes.append(scene)
        self._t_s.append(max(scene.t_s, self._t_s[-1]) if self._t_s else scene.t_s)

    def _index_at(self, t_s: float) -> int:
        """Index of the last scene at or before `t_s`; 0 when all scenes are later."""
        return max(bisect_right(self._t_s, t_s) - 1, 0)

    @property
    def span_s(self) -> tuple[float, float] | None:
        """Times of the first and the last scene; None before the first."""
        return (self._t_s[0], self._t_s[-1]) if self._t_s else None

    def at(self, t_s: float) -> PageScene:
        """The scene that is shown at `t_s`."""
        return self._scenes[self._index_at(t_s)]

    def stepped(self, t_s: float, steps: int) -> float:
        """Time of the scene `steps` scenes after the one that is shown at `t_s`, or of the first or last one."""
        return self._t_s[min(max(self._index_at(t_s) + steps, 0), len(self) - 1)]


class Mailbox:
    """State shared by the tracker's thread and the server's thread. `goal`: the destination chosen on a page, the same for all pages."""

    def __init__(self, plan: Plan, title: str, *, replay: bool, keeps: bool = False) -> None:
        """`replay`: pages play the scenes, and check-ins are refused. `keeps`: the same from `end` on."""
        self.plan = plan
        self.title = title
        self.trail = PageTrail()
        self.history = SceneHistory()
        self.over_time = OverTime(tuple(level.name for level in plan.levels), north_rad(plan))
        self.replay = replay
        self.summary: str | None = None  # how well the run went, once it is over
        self.failure = ""  # the error that ends the run, in words
        self._keeps = keeps
        self.latest: PageScene | None = None
        self.goal: Goal | None = None
        self.goes_back = False  # without an exit the run itself guides to it: back along the own way
        self.errand = ""  # who sent the wearer to the destination, in words
        self.marks: tuple[ShownMark, ...] = ()  # of the commanders, and of this run's pages; replaced, never changed
        self._struck: tuple[ShownMark, ...] = ()  # those of the pages: no way
        # In order of `t_s`; a live run has the newest only; replaced, never changed
        self._drawings: tuple[ShownDrawing, ...] = ()
        self.team: tuple[str, ...] = ()  # names of the teammates who can be met; replaced, never changed
        self.on_publish: Callable[[], None] | None = None
        self.exchange = Exchange()
        self.check_ins: queue.Queue[CheckIn | Undo | Call] = queue.Queue(MOST_CHECK_INS)
        self.met: queue.Queue[str] = queue.Queue(MOST_CHECK_INS)  # names of teammates
        self.understood: queue.Queue[str] = queue.Queue(MOST_CHECK_INS)  # identities of orders
        self.orders: tuple[ShownOrder, ...] = ()  # of the commanders; replaced, never changed

    def publish(self, scene: PageScene) -> None:
        """Store a new scene and call `on_publish`; called in the tracker's thread."""
        if self.replay:
            self.history.add(scene)
        self.over_time.note(scene)
        self.show(scene)

    def show(self, scene: PageScene) -> None:
        """Show a scene that is no part of the walk, and call `on_publish`."""
        self.latest = scene
        self._announce()

    def set_goal(self, goal: Goal | None, errand: str = "") -> None:
        """Set the destination of all pages and call `on_publish`; None ends the guidance to it. `errand`: who sent the wearer there, in words."""
        self.goal, self.errand = goal, errand
        self._announce()

    def set_marks(self, marks: tuple[ShownMark, ...]) -> None:
        """Replace the commanders' marks and call `on_publish`."""
        self.marks = (*marks, *self._struck)
        self._announce()

    @property
    def closed(self) -> tuple[RoutePlace, ...]:
        """The places at which there is no way."""
        return closed_places(self.marks)

    def strike(self, place: RoutePlace) -> None:
        """Mark that there is no way at a place; where that is marked by this run, remove the mark."""
        others, at = [mark for mark in self.marks if mark not in self._struck], (place.x_m, place.y_m)
        kept = [m for m in self._struck if m.level != place.level or math.dist((m.x_m, m.y_m), at) > SAME_M]
        new = ShownMark(f"{BLOCKED} {at}", BLOCKED, *at, place.level, "")
        self._struck = tuple(kept) if len(kept) < len(self._struck) else (*kept, new)[-MOST_STRUCK:]
        self.set_marks(tuple(others))

    def set_orders(self, orders: tuple[ShownOrder, ...]) -> None:
        """Replace the commanders' orders; calls `on_publish` when they have changed. A new one to leave makes the exit the destination."""
        if orders != self.orders:
            if {order.id for order in orders if order.urgent} - {order.id for order in self.orders}:
                self.goal, self.errand = EXIT, ""
            self.orders = orders
            self._announce()

    def add_drawing(self, drawing: ShownDrawing) -> None:
        """Show a new drawing from its time on and call `on_publish`; called in the drawing's thread."""
        before = self._drawings if self.replay or self._keeps else ()
        self._drawings = (*before, drawing)
        self._announce()

    def drawing_at(self, t_s: float) -> ShownDrawing | None:
        """The newest drawing at a time; None before the first."""
        drawings = self._drawings
        count = bisect_right(drawings, t_s, key=attrgetter("t_s"))
        return drawings[count - 1] if count else None

    def set_team(self, names: tuple[str, ...]) -> None:
        """Replace the list of teammates for meetings and call `on_publish`."""
        self.team = names
        self._announce()

    def keep(self, scene: PageScene) -> None:
        """Add the scene of an estimate to the run over time, and to the history that is played after `end`, if the run keeps one."""
        self.over_time.add(scene)
        if self._keeps and not self.replay:
            self.history.add(scene)

    def end(self, summary: str) -> None:
        """The run is over; a history that was kept is played from now on."""
        self.summary = summary
        self.exchange.rest()
        self.replay = self.replay or (self._keeps and len(self.history) > 0)
        self._announce()

    def fail(self, words: str) -> None:
        """An error ends the run."""
        self.failure = words
        self._announce()

    def add(self, waiting: queue.Queue[T], item: T) -> bool:
        """Queue a page's message; False when it is refused: in a replay, or with a full queue."""
        if self.replay:
            return False
        try:
            waiting.put_nowait(item)
        except queue.Full:
            return False
        return True

    def _announce(self) -> None:
        if self.on_publish:
            self.on_publish()


def popped(waiting: queue.Queue[T]) -> Iterator[T]:
    """Remove and yield the queued items; never waits."""
    while True:
        try:
            yield waiting.get_nowait()
        except queue.Empty:
            return
