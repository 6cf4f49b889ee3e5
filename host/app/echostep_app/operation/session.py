# SPDX-License-Identifier: MIT
"""The session of one commander's page.

In: a WebSocket, the feed. Out: frames. Owns the state sent to this page, and its chosen wearer. A frame, little-endian:

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
from echostep_app.operation.recorded.tape import OperationTape, TapeHead
from echostep_app.operation.words import ShownDetails, ShownEvent, ShownWearer
from echostep_app.page.elements.marks import ShownMark
from echostep_app.page.guarded_socket import UNKNOWN, GuardedSocket
from echostep_app.page.player import Player, PlayState
from echostep_app.page.protocol import encode, hello, packed
from echostep_app.page.requests import FrameDrawn, Seek, SetPlaying, SetSpeed, Step
from echostep_app.page.shared import PageCounts
from echostep_app.page.web.exchange import Exchange
from echostep_app.page.web.faults import Faults
from echostep_app.team.messages.crews import Crew

PLACE_BYTES, TRAIL_BYTES = 7 * 4, 5 * 4
RECORDED = "Not accepted: this is a recorded operation."


@dataclass(frozen=True, slots=True)
class TableHeader:
    """One moment. `seq`: the page returns it when the frame is drawn. `list`, `marks`, `crews`, `log`: None when the page has them already.

    `trail_from` 0: trails restart. `details`, `distress`: of the chosen wearer. `play`: state of a replay. The field names are keys of the JSON.
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
    play: PlayState | None
    kind: Literal["table"] = "table"


class TableFeed:
    """The newest scene; the receiver's thread publishes, the server's thread reads."""

    def __init__(self, operation: Operation, title: str, tape: OperationTape | None = None) -> None:
        """`tape`: of a recorded operation, of which each page plays any moment."""
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
        self._trail_end = 0  # number of the next point of the trails that the page needs
        self._last: TableScene | None = None
        self._chosen: int | None = None
        self._shown: Operation = feed.operation  # whose scene was sent last
        if feed.tape:
            self._player, self._head = Player(feed.tape), TapeHead(feed.tape)

    async def _greet(self) -> None:
        feed = self._feed
        replay = self._player is not None
        await self.tell(encode(hello(feed.operation.plan, feed.title, feed.exchange.run, replay=replay)))

    async def _handle(self, text: str | None) -> str:
        request = requests.parse_request(text)
        self._news.set()
        match request:
            case None:
                self._counts.unknown += 1
                return UNKNOWN
            case FrameDrawn(seq):
                self._undrawn.pop(seq, None)
            case requests.Choose(number):
                self._chosen, self._frame_due = number, True
            case Seek() | SetPlaying() | SetSpeed() | Step():
                if self._player is not None:
                    self._player.handle(request)
                    self._frame_due = True
            case _ if self._player is not None:
                return RECORDED
            case _:
                return self._feed.act(request)
        return ""

    async def _tell_run(self) -> None:
        """Nothing: each frame says it."""

    async def _next_frame(self) -> bytes | None:
        operation, scene = self._feed.operation, self._feed.latest
        if self._player is not None:
            if (t_s := self._player.move(time.monotonic())) is None:
                return None
            operation, scene = await asyncio.to_thread(self._head.at, t_s)
        if scene is None or (scene is self._last and not self._frame_due):
            return None
        return self._frame(operation, scene)

    def _frame(self, operation: Operation, scene: TableScene) -> bytes:
        """A frame with what this page has not been sent yet; from then on it counts as sent."""
        if operation is not self._shown:
            self._shown, self._trail_end, self._last = operation, 0, None
        begin, last = self._trail_end, self._last
        lists = self._frame_due or last is None or scene.rows is not last.rows
        trail, self._trail_end = operation.trail(begin, scene.t_s)
        chosen = self._chosen if lists else None
        header = TableHeader(
            seq=self._numbered(),
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
            play=self._player.state() if self._player else None,
        )
        self._last = scene
        return packed(header, scene.places + trail)
