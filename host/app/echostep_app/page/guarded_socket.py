# SPDX-License-Identifier: MIT
"""The guarded socket of one page: the common part of the sessions of all pages.

In: a WebSocket. Out: texts, frames and a beat each second to the page; its requests, one by one, to the session. Owns the budget of requests, the
handling of faults, and the pace: at most 30 frames a second, at most two not yet drawn. A page in the background draws nothing, so nothing is sent to
it; when it is visible again it gets the newest moment.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from abc import ABC, abstractmethod

from starlette.websockets import WebSocket, WebSocketDisconnect

from echostep_app.page import protocol, requests
from echostep_app.page.player import Player
from echostep_app.page.protocol import FRAME_S
from echostep_app.page.shared import PageCounts
from echostep_app.page.web.exchange import Exchange
from echostep_app.page.web.faults import Faults

MOST_UNDRAWN = 2  # frames that are sent but not reported as drawn
BEAT_S = 1.0  # between two signs of life
UNKNOWN = "This page is of another version than the program: load it again."
TOO_LATE = "It came too late: do it again."
MOST_REQUESTS_A_SECOND = 240  # a page that sends more is disconnected
POLICY_VIOLATION, INTERNAL_ERROR = 1008, 1011  # WebSocket close codes [RFC 6455, 7.4.1]
SERVICE_RESTART = 1012  # [IANA]


class GuardedSocket(ABC):
    """A session greets, handles requests, and sends; `run` ends when one of these does."""

    def __init__(self, socket: WebSocket, exchange: Exchange, faults: Faults, counts: PageCounts) -> None:
        self._socket = socket
        self._exchange = exchange
        self._faults = faults
        self._counts = counts
        self._news = asyncio.Event()
        self._player: Player | None = None  # of a recorded run
        self._frame_due = True  # the page needs a frame, even of the same moment
        self._seq = 0  # number of the newest frame
        # Number of a sent frame: arrival (ns) of the bytes that are new in it
        self._undrawn: dict[int, int | None] = {}

    @abstractmethod
    async def _greet(self) -> None:
        """Send the first message."""

    @abstractmethod
    async def _handle(self, text: str | None) -> str:
        """Handle one request, None if it was not a text; the reason of a refusal, else empty."""

    @abstractmethod
    async def _next_frame(self) -> bytes | None:
        """The frame of what this page has not been sent yet; None while nothing is new."""

    @abstractmethod
    async def _tell_run(self) -> None:
        """Tell how the run stands, also a page in the background."""

    async def _send(self) -> None:
        """Send a frame when there is something new, not before `FRAME_S` after the last one; until cancelled."""
        due_s = 0.0
        while True:
            playing = self._player is not None and self._player.playing
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._news.wait(), FRAME_S if playing else None)
            if (early_s := due_s - time.monotonic()) > 0.0:
                await asyncio.sleep(early_s)
            self._news.clear()
            await self._tell_run()
            if len(self._undrawn) < MOST_UNDRAWN and (frame := await self._next_frame()) is not None:
                due_s = max(due_s, time.monotonic() - FRAME_S) + FRAME_S
                await self.tell(frame)

    def _numbered(self, arrived_ns: int | None = None) -> int:
        """The number of a new frame, which counts as sent."""
        self._frame_due = False
        self._seq += 1
        self._undrawn[self._seq] = arrived_ns
        return self._seq

    def wake(self) -> None:
        """Look for something new to send."""
        self._news.set()

    async def disconnect(self) -> None:
        """End the connection; the page comes back for the content served then."""
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await self._socket.close(SERVICE_RESTART)

    async def run(self) -> None:
        """Serve until the page disconnects or sends too many requests; a fault is logged and sent to the page."""
        tasks: list[asyncio.Task[None]] = []
        try:
            await self._greet()
            tasks = [asyncio.create_task(work()) for work in (self._receive, self._send, self._beat)]
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        except WebSocketDisconnect:
            pass
        except Exception as error:
            await self._fail(error)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _fail(self, error: Exception) -> None:
        """Log a fault, send it to the page, close the socket."""
        text = self._faults.note(error)
        with contextlib.suppress(WebSocketDisconnect):
            await self.tell(protocol.encode(protocol.Failed(text)))
            await self._socket.close(INTERNAL_ERROR)

    async def tell(self, message: str | bytes) -> None:
        """Send a text or a frame; raises WebSocketDisconnect when the page has disconnected."""
        try:
            await (self._socket.send_text(message) if isinstance(message, str) else self._socket.send_bytes(message))
        except RuntimeError as error:  # of Starlette: the socket is closed
            raise WebSocketDisconnect(INTERNAL_ERROR) from error

    async def _receive(self) -> None:
        """Handle requests; returns when the page disconnects or floods."""
        second_began, count = time.monotonic(), 0
        while True:
            event = await self._socket.receive()
            if event["type"] != "websocket.receive":
                return
            if time.monotonic() - second_began > 1.0:
                second_began, count = time.monotonic(), 0
            count += 1
            if count > MOST_REQUESTS_A_SECOND:
                self._counts.flooding += 1
                await self._socket.close(POLICY_VIOLATION)
                return
            await self._answer(event.get("text"))

    async def _answer(self, text: str | None) -> None:
        """Handle a request, one with an identity only once, and tell the page what came of it."""
        kept = requests.kept_request(text)
        if kept is None:
            reason = await self._handle(text)
        elif kept.until_s is not None and kept.until_s < time.monotonic() and not self._exchange.knows(kept.request):
            reason = TOO_LATE  # it lay in a wire, or here while all slept
        else:
            reason = await self._exchange.once(kept.request, lambda: self._handle(text))
        if reason and reason != UNKNOWN:
            self._counts.refused += 1
        if kept:
            await self.tell(protocol.encode(protocol.Answered(kept.request, reason)))
        elif reason and reason != UNKNOWN:
            await self.tell(protocol.encode(protocol.Refused(reason)))

    async def _beat(self) -> None:
        """Tell the page each second that the server is there, and how long ago the run was."""
        while True:
            await self.tell(protocol.encode(protocol.Beat(round(self._exchange.age_s, 1), time.monotonic())))
            await asyncio.sleep(BEAT_S)
