"""One page on its socket: scenes go out, at most 30 a second and never more than two that it has not drawn; requests come in.

In: a WebSocket, the stage. Out: nothing. Owns what this page has seen, its destination and its place in a replay. A page that sleeps draws nothing,
so nothing is sent; when it wakes it gets the newest scene and the trail from where it was.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from dataclasses import dataclass

from starlette.websockets import WebSocket, WebSocketDisconnect

from echostep.errors import EchostepError
from echostep.localization.estimate import Estimate
from echostep.page import protocol as wire
from echostep.page.elements.guidance import Errand, Ways
from echostep.page.elements.scene import PageScene, Specks
from echostep.page.mailbox import Mailbox
from echostep.page.replay_cursor import Cursor
from echostep.ports.check_in import CheckIn

FRAME_S = 1.0 / 30.0
MOST_UNDRAWN = 2
MOST_REQUESTS_A_SECOND = 240
POLICY = 1008


@dataclass(slots=True)
class PageCounts:
    """Of all pages together: what came over the sockets and was not understood or not taken, and pages that asked too much."""

    unknown: int = 0
    refused: int = 0
    flooding: int = 0


class Session:
    """Speaks with one page until it goes away."""

    def __init__(self, socket: WebSocket, stage: Mailbox, ways: Ways, counts: PageCounts) -> None:
        self.latency_s: deque[float] = deque(
            maxlen=512
        )  # from the coming of an estimate's bytes to the word that it is drawn
        self._socket = socket
        self._stage = stage
        self._ways = ways
        self._counts = counts
        self._cursor = Cursor(stage.film) if stage.film is not None else None
        self._errand: Errand | None = None
        self._looking: set[asyncio.Task[None]] = set()
        self._news = asyncio.Event()
        self._undrawn: dict[
            int, int | None
        ] = {}  # serial number of a frame sent: birth of the estimate that is new in it
        self._serial = 0
        self._last: PageScene | None = None
        self._specks: Specks | None = None
        self._walked = 0
        self._asked = True

    def wake(self) -> None:
        """There may be something new to send."""
        self._news.set()

    async def run(self) -> None:
        """Until the page goes away or misbehaves."""
        await self._socket.send_text(wire.hello(self._stage.plan, self._stage.title, replay=self._cursor is not None))
        tasks = [asyncio.create_task(self._hear()), asyncio.create_task(self._show())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _hear(self) -> None:
        began, asked = time.monotonic(), 0
        while True:
            event = await self._socket.receive()
            if event["type"] != "websocket.receive":
                return
            if time.monotonic() - began > 1.0:
                began, asked = time.monotonic(), 0
            asked += 1
            if asked > MOST_REQUESTS_A_SECOND:
                self._counts.flooding += 1
                await self._socket.close(POLICY)
                return
            await self._take(event.get("text"))

    async def _take(self, text: str | None) -> None:
        request = None if text is None else wire.parse_request(text)
        match request:
            case None:
                self._counts.unknown += 1
                return
            case wire.Drawn(serial):
                if (born_ns := self._undrawn.pop(serial, None)) is not None:
                    self.latency_s.append((time.monotonic_ns() - born_ns) * 1e-9)
            case CheckIn():
                if not self._stage.check_in(request):
                    self._counts.refused += 1
                    await self._socket.send_text('{"kind":"refused","what":"check_in"}')
            case wire.GoTo(goal) if goal.level < len(self._stage.plan.levels):
                self._errand, self._asked = Errand(goal), True
            case wire.GoNowhere():
                self._errand, self._asked = None, True
            case _ if self._cursor is not None:
                self._cursor.take(request)
                self._asked = True
            case _:
                self._counts.refused += 1
        self._news.set()

    async def _show(self) -> None:
        due_s = 0.0
        while True:
            runs = self._cursor is not None and self._cursor.playing
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), FRAME_S if runs else None)
            if (early_s := due_s - time.monotonic()) > 0.0:
                await asyncio.sleep(early_s)
            self._news.clear()
            if len(self._undrawn) >= MOST_UNDRAWN:
                continue
            scene = self._cursor.scene(time.monotonic()) if self._cursor else self._stage.latest
            if scene is None or (scene is self._last and not self._asked and not runs):
                continue
            due_s = max(due_s, time.monotonic() - FRAME_S) + FRAME_S
            try:
                await self._socket.send_bytes(self._frame(scene))
            except (WebSocketDisconnect, RuntimeError):
                return

    def _frame(self, scene: PageScene) -> bytes:
        """A frame with what this page has not seen; it is then counted as sent."""
        self._asked = False
        self._serial += 1
        news = self._cursor is None and (self._last is None or scene.told is not self._last.told)
        self._undrawn[self._serial] = scene.born_ns if news else None
        begin = min(self._walked, scene.walked)
        new = scene.specks if scene.specks is not self._specks else None
        guidance = scene.guidance
        if scene.told and self._errand:
            guidance = self._errand.guidance(scene.told)
            if self._errand.lacks_way(scene.told):
                self._errand.looking = True
                task = asyncio.create_task(self._look(self._errand, scene.told))
                self._looking.add(task)
                task.add_done_callback(self._looking.discard)
        play = self._cursor.state() if self._cursor else None
        self._last, self._walked, self._specks = scene, scene.walked, scene.specks
        return wire.frame(scene, self._serial, self._stage.trail.part(begin, scene.walked), begin, new, guidance, play)

    async def _look(self, errand: Errand, told: Estimate) -> None:
        """Look for the way of an errand; the pages go on meanwhile."""
        try:
            errand.found(await asyncio.to_thread(self._ways.way, told, errand.goal), "", told)
        except EchostepError as error:
            errand.found(None, str(error), told)
        self._asked = True
        self._news.set()
