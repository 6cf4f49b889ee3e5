# SPDX-License-Identifier: MIT
"""Frames of the page for tests: a scene, a server, a client that reads the socket."""

from __future__ import annotations

import contextlib
import json
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from email.message import Message
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from board_runs import ROOT
from echostep.localization import Estimate, TrackStatus
from echostep.plan import load_plan
from echostep_app.page.elements.echo_lines import EchoLine
from echostep_app.page.elements.scene import PageScene, ParticleSample
from echostep_app.page.mailbox import Mailbox
from echostep_app.page.server import Address, PageServer
from waiting import PATIENCE_S

PLAN = load_plan(ROOT / "host/core/echostep/plans/demo.json")


LOCAL = Address(port=0)


BEAT = '"kind":"beat"'


class PageConnection(ClientConnection):
    """A page's socket without the beats, which come whenever a second is over."""

    def recv(self, timeout: float | None = None, decode: bool | None = None) -> Any:
        end_s = None if timeout is None else time.monotonic() + timeout
        while True:
            received = super().recv(None if end_s is None else end_s - time.monotonic(), decode)
            if not (isinstance(received, str) and BEAT in received):
                return received


def told(
    x_m: float = 2.0, y_m: float = 7.5, t_s: float = 1.0, status: TrackStatus = TrackStatus.TRACKING, sd_m: float = 0.1
) -> Estimate:
    return Estimate(t_s, x_m, y_m, sd_m**2, 0.0, sd_m**2, 0.0, 0.02, 1, status)


def scene(t_s: float = 1.0, trail_count: int = 0, particles: int = 300) -> PageScene:
    x = np.linspace(1.0, 3.0, particles, dtype=np.float32)
    cloud = ParticleSample(x, x + 5.0, np.full(particles, 200, np.uint8), np.zeros(particles, np.uint8))
    return PageScene(
        time.monotonic_ns(),
        t_s,
        told(t_s=t_s),
        cloud,
        (EchoLine(t_s, 0, 2.0, 7.5, 1.6, 1.0, None),),
        None,
        trail_count,
        "",
    )


class Answer(NamedTuple):
    status: int
    headers: Message
    body: bytes


def fetched(url: str) -> Answer:
    """What the server answers, an error's body too; the connection is closed (an `HTTPError` would hold it)."""
    try:
        with urllib.request.urlopen(url, timeout=PATIENCE_S) as answer:
            return Answer(answer.status, answer.headers, answer.read())
    except urllib.error.HTTPError as error:
        with error:
            return Answer(error.code, error.headers, error.read())


def opened_url(url: str) -> ClientConnection:
    origin = Origin("/".join(url.split("/")[:3]))
    return connect(
        f"ws{url[4:]}socket",
        origin=origin,
        max_size=None,
        max_queue=None,  # as a browser, which reads on whatever its page does: beats would fill a short queue
        open_timeout=PATIENCE_S,
        create_connection=PageConnection,
    )


def header(received: str | bytes) -> dict[str, Any]:
    assert isinstance(received, bytes)
    length = int.from_bytes(received[:4], "little")
    return dict(json.loads(received[4 : 4 + length]))


def lines_of(url: str, level: int) -> dict[str, NDArray[np.float32]]:
    """The lines of a level by kind, as the page reads them."""
    received = fetched(f"{url}lines/{level}").body
    counts = header(received)
    assert all(isinstance(count, int) for count in counts.values())
    rows = np.frombuffer(received[4 + int.from_bytes(received[:4], "little") :], "<f4").reshape(-1, 4)
    return dict(zip(counts, np.split(rows, np.cumsum(list(counts.values()))[:-1]), strict=True))


def next_frame(page: ClientConnection) -> dict[str, Any]:
    return header(page.recv(timeout=PATIENCE_S))


@contextlib.contextmanager
def served(mailbox: Mailbox | None = None, address: Address = LOCAL) -> Iterator[tuple[PageServer, Mailbox]]:
    mailbox = mailbox or Mailbox(PLAN, "test", replay=False)
    with PageServer(mailbox, address) as server:
        yield server, mailbox


def opened(server: PageServer) -> ClientConnection:
    return opened_url(server.url)
