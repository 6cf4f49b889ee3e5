# SPDX-License-Identifier: MIT
"""The session of one commander's page: frames at most 30 times a second, with at most two that the page has not drawn.

In: a WebSocket, the feed. Out: frames. Owns what this page has been sent, and which wearer it has chosen. A page in the background draws nothing, so
nothing is sent to it. A frame, little-endian:

    u32         length of the JSON header, padded with spaces to a multiple of four
    bytes       the header (`TableHeader`)
    float32[7]  `places` rows: wearer, x, y, level, heading, 95 % radius, protection radius (`Operation.scene`)
    float32[5]  `trail` rows: wearer, x, y, level, age in seconds
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from starlette.websockets import WebSocket

from echostep_app.operation import requests
from echostep_app.operation.distress import ShownDistress
from echostep_app.operation.operation import Operation, TableScene
from echostep_app.operation.orders import ShownOrder
from echostep_app.operation.recorded.past import PastView, ShownTime
from echostep_app.operation.recorded.tape import Tape
from echostep_app.operation.words import ShownDetails, ShownEvent, ShownWearer
from echostep_app.page.elements.marks import ShownMark
from echostep_app.page.guarded_socket import MOST_UNDRAWN, UNKNOWN, GuardedSocket
from echostep_app.page.protocol import FRAME_S, encode, hello, packed
from echostep_app.page.requests import FrameDrawn, Seek, SetPlaying, SetSpeed
from echostep_app.page.shared import PageCounts
from echostep_app.page.web.exchange import Exchange
from echostep_app.page.web.faults import Faults
from echostep_app.team.messages.crews import Crew

PLACE_BYTES, TRAIL_BYTES = 7 * 4, 5 * 4
BAR_S = 0.5  # between two frames of one scene: the time bar grows
PAST = "The page shows the past: return to now first."


@dataclass(frozen=True, slots=True)
class TableHeader:
    """One moment. `seq`: the page returns it when the frame is drawn. `list`, `marks`, `crews`, `log`: None when the page has them already.

    `trail_from` 0: trails begin anew. `details`, `distress`: of the chosen wearer. `time`: of the time bar. The field names are keys of the JSON.
    """

    seq: int
    unix_s: float
    places: int
    trail: int
    trail_from: int
    list: tuple[ShownWearer, ...] | None
    summary: str
    refused: str
    connected: bool
    fault: str
    waiting: int
    details: ShownDetails | None
    distress: ShownDistress | None
    marks: tuple[ShownMark, ...] | None
    order: ShownOrder | None
    crews: tuple[Crew, ...] | None
    log: tuple[ShownEvent, ...] | None
    time: ShownTime | None
    kind: Literal["table"] = "table"


class TableFeed:
    """The newest scene; the receiver's thread publishes, the server's thread reads."""

    def __init__(self, operation: Operation, title: str, tape: Tape | None = None) -> None:
        """`tape`: of the operation's recording, by which a page can show the past."""
        self.operation = operation
        self.title = title
        self.tape = tape
        self.latest: TableScene | None = None
        self.exchange = Exchange()
        self.on_publish: Callable[[], None] | None = None
        self.send: Callable[[str, bytes], bool] | None = None  # topic and payload, to the broker

    def act(self, request: requests.Action) -> str:
        """Send a page's request to the broker, which distributes it to all commanders; returns the reason of a refusal, or nothing."""
        message = self.operation.act(request, time.time(), time.monotonic())
        if isinstance(message, str):
            return message
        if self.send is None or not self.send(*message):
            return "Not sent: the broker does not take it."
        return ""

    def publish(self, scene: TableScene) -> None:
        """Replace the scene and call `on_publish`."""
        self.latest = scene
        if self.on_publish:
            self.on_publish()


class TableSession(GuardedSocket):
    """Serves one page until it disconnects."""

    def __init__(self, socket: WebSocket, feed: TableFeed, faults: Faults, counts: PageCounts) -> None:
        super().__init__(socket, feed.exchange, faults, counts)
        self._feed = feed
        self._undrawn: set[int] = set()  # numbers of frames
        self._seq = 0
        self._trail_end = 0  # number of the next point of the trails that the page needs
        self._last: TableScene | None = None
        self._chosen: int | None = None
        self._due = True  # the page needs a frame, even of the same scene
        self._view = PastView(feed.tape) if feed.tape else None
        self._shown: Operation = feed.operation  # whose scene was sent last
        self._sent_s = 0.0  # when, on the monotonic clock

    async def _greet(self) -> None:
        await self.tell(
            encode(hello(self._feed.operation.plan, self._feed.title, self._feed.exchange.run, replay=False))
        )

    async def _handle(self, text: str | None) -> str:
        request = requests.parse_request(text)
        match request:
            case None:
                self._counts.unknown += 1
                return UNKNOWN
            case FrameDrawn(seq):
                self._undrawn.discard(seq)
                self._news.set()
            case requests.Choose(number):
                self._chosen, self._due = number, True
                self._news.set()
            case Seek() | SetPlaying() | SetSpeed() | requests.Now():
                if self._view is not None:
                    self._view.handle(request)
                    self._due = True
                    self._news.set()
            case _ if self._view is not None and self._view.is_past:
                return PAST
            case _:
                return self._feed.act(request)
        return ""

    async def _send(self) -> None:
        """Send a frame when there is something new, not before `FRAME_S` after the last one."""
        due_s = 0.0
        while True:
            await self._news.wait()
            if (early_s := due_s - time.monotonic()) > 0.0:
                await asyncio.sleep(early_s)
            self._news.clear()
            if len(self._undrawn) >= MOST_UNDRAWN:
                continue
            operation, scene = await self._moment()
            if scene is None or (scene is self._last and not self._is_due()):
                continue
            due_s = max(due_s, time.monotonic() - FRAME_S) + FRAME_S
            await self.tell(self._frame(operation, scene))

    async def _moment(self) -> tuple[Operation, TableScene | None]:
        """What this page shows: the newest scene, or one of the past, which another thread makes."""
        if self._view is not None and (t_s := self._view.moment(time.monotonic())) is not None:
            return await asyncio.to_thread(self._view.at, t_s)
        return self._feed.operation, self._feed.latest

    def _is_due(self) -> bool:
        """Whether the page gets a frame although the scene is unchanged: it requested one, or the time bar has grown."""
        is_past = self._view is not None and self._view.is_past
        return self._due or (is_past and time.monotonic() - self._sent_s >= BAR_S)

    def _frame(self, operation: Operation, scene: TableScene) -> bytes:
        """A frame with what this page has not been sent yet; from then on it counts as sent."""
        self._seq += 1
        self._undrawn.add(self._seq)
        if operation is not self._shown:
            self._shown, self._trail_end, self._last, self._due = operation, 0, None, True
        begin, last, self._sent_s = self._trail_end, self._last, time.monotonic()
        lists = self._due or last is None or scene.rows is not last.rows
        trail, self._trail_end = operation.trail(begin, scene.t_s)
        chosen, latest = self._chosen if lists else None, self._feed.latest or scene
        header = TableHeader(
            seq=self._seq,
            unix_s=scene.unix_s,
            places=len(scene.places) // PLACE_BYTES,
            trail=len(trail) // TRAIL_BYTES,
            trail_from=begin,
            list=scene.rows if lists else None,
            summary=scene.summary,
            refused=scene.refused,
            connected=scene.connected,
            fault=scene.fault,
            waiting=scene.waiting,
            details=None if chosen is None else operation.details(chosen, scene.t_s),
            distress=None if chosen is None else operation.distress(chosen, scene.t_s),
            marks=scene.marks if last is None or scene.marks is not last.marks else None,
            order=scene.order,
            crews=scene.crews if last is None or scene.crews is not last.crews else None,
            log=scene.log if last is None or scene.log is not last.log else None,
            time=self._view.shown(scene.t_s, sum(row.open_alarm for row in latest.rows)) if self._view else None,
        )
        self._last, self._due = scene, False
        return packed(header, scene.places + trail)
