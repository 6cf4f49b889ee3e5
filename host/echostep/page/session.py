"""The session of one page: sends scenes at most 30 times a second, with at most two frames not yet drawn; takes requests.

In: a WebSocket, the mailbox. Out: frames. Owns what this page has been sent, its destination and its position in a replay. A page in the background
draws nothing, so nothing is sent to it; when it is visible again it gets the newest scene and the rest of the trail.
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
from echostep.page import protocol
from echostep.page.elements.guidance import Destination, RouteFinder, ShownGuidance
from echostep.page.elements.scene import PageScene, ParticleSample
from echostep.page.mailbox import Mailbox
from echostep.page.replay_cursor import ReplayCursor
from echostep.ports.check_in import CheckIn

FRAME_S = 1.0 / 30.0  # shortest time between two frames
MOST_UNDRAWN = 2  # frames that are sent but not reported as drawn
MOST_REQUESTS_A_SECOND = 240  # a page that sends more is disconnected
POLICY_VIOLATION = 1008  # WebSocket close code [RFC 6455, 7.4.1]


@dataclass(slots=True)
class PageCounts:
    """Counts over all pages. `unknown`: requests that could not be parsed. `refused`: requests and pages. `flooding`: pages that asked too often."""

    unknown: int = 0
    refused: int = 0
    flooding: int = 0


class PageSession:
    """Serves one page until it disconnects."""

    def __init__(self, socket: WebSocket, mailbox: Mailbox, route_finder: RouteFinder, counts: PageCounts) -> None:
        self.latency_s: deque[float] = deque(
            maxlen=512
        )  # from the arrival of an estimate's bytes to its frame being drawn
        self._socket = socket
        self._mailbox = mailbox
        self._route_finder = route_finder
        self._counts = counts
        self._cursor = ReplayCursor(mailbox.history) if mailbox.history is not None else None
        self._destination: Destination | None = None
        self._searches: set[asyncio.Task[None]] = set()
        self._news = asyncio.Event()
        self._undrawn: dict[
            int, int | None
        ] = {}  # number of a sent frame: `arrived_ns` of the estimate that is new in it
        self._seq = 0
        self._last: PageScene | None = None
        self._particles: ParticleSample | None = None
        self._trail_count = 0  # points of the trail that the page has
        self._frame_due = True  # the page needs a frame, even of the same scene

    def wake(self) -> None:
        """Look for something new to send."""
        self._news.set()

    async def run(self) -> None:
        """Serve until the page disconnects or sends too many requests."""
        replay = self._cursor is not None
        await self._socket.send_text(protocol.hello(self._mailbox.plan, self._mailbox.title, replay=replay))
        tasks = [asyncio.create_task(self._receive()), asyncio.create_task(self._send())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _receive(self) -> None:
        """Handle requests; returns when the page disconnects or floods."""
        second_began, requests = time.monotonic(), 0
        while True:
            event = await self._socket.receive()
            if event["type"] != "websocket.receive":
                return
            if time.monotonic() - second_began > 1.0:
                second_began, requests = time.monotonic(), 0
            requests += 1
            if requests > MOST_REQUESTS_A_SECOND:
                self._counts.flooding += 1
                await self._socket.close(POLICY_VIOLATION)
                return
            await self._handle(event.get("text"))

    async def _handle(self, text: str | None) -> None:
        request = None if text is None else protocol.parse_request(text)
        match request:
            case None:
                self._counts.unknown += 1
                return
            case protocol.FrameDrawn(seq):
                if (arrived_ns := self._undrawn.pop(seq, None)) is not None:
                    self.latency_s.append((time.monotonic_ns() - arrived_ns) * 1e-9)
            case CheckIn():
                if not self._mailbox.add_check_in(request):
                    self._counts.refused += 1
                    await self._socket.send_text('{"kind":"refused","what":"check_in"}')
            case protocol.GoTo(goal) if goal.level < len(self._mailbox.plan.levels):
                self._destination, self._frame_due = Destination(goal), True
            case protocol.EndGuidance():
                self._destination, self._frame_due = None, True
            case _ if self._cursor is not None:
                self._cursor.handle(request)
                self._frame_due = True
            case _:
                self._counts.refused += 1
        self._news.set()

    async def _send(self) -> None:
        """Send a frame when there is something new, not before `FRAME_S` after the last one."""
        due_s = 0.0
        while True:
            playing = self._cursor is not None and self._cursor.playing
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), FRAME_S if playing else None)
            if (early_s := due_s - time.monotonic()) > 0.0:
                await asyncio.sleep(early_s)
            self._news.clear()
            if len(self._undrawn) >= MOST_UNDRAWN:
                continue
            scene = self._cursor.scene(time.monotonic()) if self._cursor else self._mailbox.latest
            if scene is None or (scene is self._last and not self._frame_due and not playing):
                continue
            due_s = max(due_s, time.monotonic() - FRAME_S) + FRAME_S
            try:
                await self._socket.send_bytes(self._frame(scene))
            except (WebSocketDisconnect, RuntimeError):
                return

    def _frame(self, scene: PageScene) -> bytes:
        """A frame with what this page has not been sent yet; from then on it counts as sent."""
        self._frame_due = False
        self._seq += 1
        new_estimate = self._cursor is None and (self._last is None or scene.estimate is not self._last.estimate)
        self._undrawn[self._seq] = scene.arrived_ns if new_estimate else None
        begin = min(self._trail_count, scene.trail_count)  # a replay may go back
        particles = scene.particles if scene.particles is not self._particles else None
        guidance = self._guidance(scene)
        play = self._cursor.state() if self._cursor else None
        self._last, self._trail_count, self._particles = scene, scene.trail_count, scene.particles
        trail = self._mailbox.trail.part(begin, scene.trail_count)
        return protocol.frame(scene, self._seq, trail, begin, particles, guidance, play)

    def _guidance(self, scene: PageScene) -> ShownGuidance | None:
        """Guidance to the page's own destination, else the run's; starts a search for a route when one is due."""
        if not (scene.estimate and self._destination):
            return scene.guidance
        guidance = self._destination.guidance_at(scene.estimate)
        if self._destination.needs_route(scene.estimate):
            self._destination.searching = True
            task = asyncio.create_task(self._search(self._destination, scene.estimate))
            self._searches.add(task)
            task.add_done_callback(self._searches.discard)
        return guidance

    async def _search(self, destination: Destination, estimate: Estimate) -> None:
        """Search for the route to a destination in a thread; frames are sent meanwhile."""
        try:
            route = await asyncio.to_thread(self._route_finder.find, estimate, destination.goal)
            destination.set_route(route, "", estimate)
        except EchostepError as error:
            destination.set_route(None, str(error), estimate)
        self._frame_due = True
        self._news.set()
