"""The stage: where the tracker leaves scenes and the pages find them; neither waits for the other.

In: scenes from the tracker's thread, check-ins from the server's. Out: the latest scene, or in a replay all of them (the film), the trail, and the
check-ins for the tracker. Owns these.
"""

from __future__ import annotations

import queue
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator

from echostep.page.elements.scene import PageScene
from echostep.plan.model import Plan
from echostep.ports.check_in import CheckIn

MOST_CHECK_INS = 16  # that wait for the tracker; one more is refused


class PageTrail:
    """The way so far: points that are only ever appended; any thread may read."""

    def __init__(self) -> None:
        self._rows = array("f")

    def __len__(self) -> int:
        return len(self._rows) // 3

    def add(self, x_m: float, y_m: float, level: int) -> None:
        """One more point."""
        self._rows.extend((x_m, y_m, level))

    def part(self, begin: int, end: int) -> bytes:
        """Points [begin, end) as rows of float32 x, y, level."""
        return self._rows[3 * begin : 3 * end].tobytes()


class Film:
    """All scenes of a replay, in order of `t_s`."""

    def __init__(self) -> None:
        self._scenes: list[PageScene] = []
        self._t_s: list[float] = []

    def __len__(self) -> int:
        return len(self._t_s)

    def __getitem__(self, k: int) -> PageScene:
        return self._scenes[k]

    def add(self, scene: PageScene) -> None:
        """One more; one that is not later than the last takes its time."""
        self._scenes.append(scene)
        self._t_s.append(max(scene.t_s, self._t_s[-1]) if self._t_s else scene.t_s)

    def at(self, t_s: float) -> int:
        """Index of the last scene at or before a time."""
        return max(bisect_right(self._t_s, t_s) - 1, 0)

    def t_s(self, k: int) -> float:
        """Time of a scene."""
        return self._t_s[k]


class Mailbox:
    """What tracker and pages share."""

    def __init__(self, plan: Plan, title: str, *, replay: bool) -> None:
        """`replay`: keep all scenes, and take no check-ins."""
        self.plan = plan
        self.title = title
        self.trail = PageTrail()
        self.film = Film() if replay else None
        self.latest: PageScene | None = None
        self.on_news: Callable[[], None] | None = None
        self._check_ins: queue.Queue[CheckIn] = queue.Queue(MOST_CHECK_INS)

    def publish(self, scene: PageScene) -> None:
        """The tracker has something new."""
        if self.film is not None:
            self.film.add(scene)
        self.latest = scene
        if self.on_news:
            self.on_news()

    def check_in(self, said: CheckIn) -> bool:
        """A page has something for the tracker; whether it is taken."""
        if self.film is not None or said.level >= len(self.plan.levels):
            return False
        try:
            self._check_ins.put_nowait(said)
        except queue.Full:
            return False
        return True

    def said(self) -> Iterator[CheckIn]:
        """The check-ins that came since; never waits."""
        while True:
            try:
                yield self._check_ins.get_nowait()
            except queue.Empty:
                return
