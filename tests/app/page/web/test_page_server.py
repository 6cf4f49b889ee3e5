# SPDX-License-Identifier: MIT
"""The page's server: frames to many pages, slow pages, access, noise."""

from __future__ import annotations

import contextlib
import json
import socket
import threading
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from echostep.errors import EchostepError
from echostep.ports.people.check_in import CheckIn
from echostep_app.page import protocol
from echostep_app.page.elements.scene import ParticleSample
from echostep_app.page.guarded_socket import MOST_UNDRAWN
from echostep_app.page.mailbox import MOST_CHECK_INS, Mailbox, popped
from echostep_app.page.server import MOST_PAGES, Address, PageServer
from page.frames import PLAN, fetched, header, next_frame, opened, scene, served
from waiting import PATIENCE_S, ends


def test_the_cloud_is_quantised_to_a_millimetre() -> None:
    rng = np.random.default_rng(0)
    x, y = (rng.uniform(-20.0, 20.0, 999).astype(np.float32) for _ in range(2))
    sent = protocol.frame(
        replace(scene(), particles=None),
        protocol.FrameParts(1, particles=ParticleSample(x, y, np.zeros(999, np.uint8), np.zeros(999, np.uint8))),
    )
    head = header(sent)["cloud"]
    at = 4 + int.from_bytes(sent[:4], "little")
    for column, k, origin in ((x, 0, "x0_m"), (y, 1, "y0_m")):
        back = head[origin] + head["step_m"] * np.frombuffer(sent, "<u2", 999, at + 2 * 999 * k)
        assert np.abs(back - column).max() < 1e-3


def test_a_page_that_sleeps_is_sent_nothing_and_catches_up() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene(0.0))
        with opened(server) as page:
            page.recv(timeout=PATIENCE_S)
            serials = [next_frame(page)["seq"]]
            for k in range(100):
                mailbox.trail.add(float(k), 0.0, 0)
                mailbox.publish(scene(float(k), trail_count=k + 1))
                if len(serials) < MOST_UNDRAWN:
                    serials.append(next_frame(page)["seq"])
            with pytest.raises(TimeoutError):
                page.recv(timeout=0.3)
            for serial in serials:
                page.send(json.dumps({"kind": "drawn", "seq": serial}))
            frame = next_frame(page)
    assert frame["t_s"] == 99.0
    trail = frame["trail"]
    assert trail["first"] + trail["count"] == 100


def test_the_tracker_never_waits_for_ten_pages_that_are_stuck() -> None:
    """Nor for the server's thread, which stands still meanwhile: whatever waited for either would never come to its end."""
    with served() as (server, mailbox), contextlib.ExitStack() as stack:
        for _ in range(10):
            stack.enter_context(opened(server))
        with standing_still(server):
            assert ends(partial(publish_crowds, mailbox))
        assert server.pages == 10


def publish_crowds(mailbox: Mailbox) -> None:
    for k in range(300):
        mailbox.publish(scene(float(k), particles=10_000))


@contextlib.contextmanager
def standing_still(server: PageServer) -> Iterator[None]:
    """The server's loop does nothing until the end."""
    stands, over = threading.Event(), threading.Event()

    def stand() -> None:
        stands.set()
        over.wait()

    assert server._loop
    server._loop.call_soon_threadsafe(stand)
    assert stands.wait(PATIENCE_S)
    try:
        yield
    finally:
        over.set()


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://evil.example", None),
        ("null", None),
        ("", None),
        (None, "evil.example"),
        ("http://evil.example:80", "evil.example:80"),
    ],
)
def test_another_site_is_refused(origin: str | None, host: str | None) -> None:
    with served() as (server, _):
        own = server.url.rstrip("/")
        with pytest.raises((InvalidStatus, ConnectionClosed)):
            connect_as(server, own if origin is None else origin, host).recv(timeout=PATIENCE_S)
        assert server.access_control.refused == 1
        assert server.pages == 0


@pytest.mark.parametrize(
    ("origin", "host", "forwarded"),
    [
        ("https://localhost:8443", "localhost:8443", ""),  # the proxy keeps the browser's Host
        ("https://walk.example.org", "127.0.0.1:8431", "walk.example.org"),  # or tells it beside its own
    ],
)
def test_a_page_behind_a_proxy_with_https_is_served(origin: str, host: str, forwarded: str) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        with connect_as(server, origin, host, forwarded) as page:
            assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "hello"


def test_a_page_that_a_proxy_hides_is_refused_and_the_reason_is_told_once() -> None:
    with served() as (server, _):
        for _ in range(2):
            with pytest.raises((ConnectionClosed, InvalidStatus)):
                connect_as(server, "https://localhost:8443", "127.0.0.1:8431").recv(timeout=PATIENCE_S)
        (told,) = server.shared.faults.notices
        for k in range(20):
            with pytest.raises((ConnectionClosed, InvalidStatus)):
                connect_as(server, f"https://evil{k}.example", "127.0.0.1:8431").recv(timeout=PATIENCE_S)
        assert len(server.shared.faults.notices) <= 4
    assert told.startswith(
        "a page of https://localhost:8443 (Host 127.0.0.1:8431) is refused by the page's server: a proxy before it must pass"
    )


def connect_as(server: PageServer, origin: str, host: str | None, forwarded: str = "") -> ClientConnection:
    headers = {"Origin": origin} if origin else {}
    headers |= {"X-Forwarded-Host": forwarded} if forwarded else {}
    if host is None:
        return connect(f"ws{server.url[4:]}socket", additional_headers=headers, origin=None, open_timeout=PATIENCE_S)
    name, port = server.url[7:].rstrip("/").split(":")
    there = socket.create_connection((name, int(port)))
    return connect(f"ws://{host}/socket", additional_headers=headers, sock=there, open_timeout=PATIENCE_S)


def test_without_the_token_nothing_answers() -> None:
    with PageServer(Mailbox(PLAN, "test", replay=False), Address("0.0.0.0", 0)) as server:
        port, token = server.url.split(":")[2].split("/")[:2]
        local = f"http://127.0.0.1:{port}"
        assert len(token) >= 20
        for path in ("", "static/main.js", "lines/0", f"{token[:-1]}/", "../"):
            assert fetched(f"{local}/{path}").status == 404
        with socket.create_connection(("127.0.0.1", int(port))) as raw:
            raw.sendall(b"GET page HTTP/1.0\r\n\r\n")
            assert b" 404 " in raw.recv(1000)
        with pytest.raises(InvalidStatus):
            connect(f"ws{local[4:]}/socket", origin=Origin(local), open_timeout=PATIENCE_S)
        page = fetched(f"{local}/{token}/")
        assert b"echostep" in page.body
        assert "script-src 'self'" in page.headers["content-security-policy"]
        with connect(f"ws{local[4:]}/{token}/socket", origin=Origin(local), open_timeout=PATIENCE_S) as page_socket:
            assert json.loads(page_socket.recv(timeout=PATIENCE_S))["kind"] == "hello"


def test_noise_is_counted_and_the_page_goes_on() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        with opened(server) as page:
            noise: list[str | bytes] = [
                "",
                "{",
                "[]",
                "null",
                '{"kind":"sudo"}',
                '{"kind":["x"]}',
                '{"kind":"go_to","x_m":1e999}',
                b"\x00\xff",
            ]
            for sent in noise:
                page.send(sent)
            page.send('{"kind":"go_to","x_m":5,"y_m":7.5}')
            page.recv(timeout=PATIENCE_S)
            frame = next_frame(page)
            while frame["guidance"] is None:
                page.send(json.dumps({"kind": "drawn", "seq": frame["seq"]}))
                frame = next_frame(page)
        assert frame["guidance"]["own"]
        assert frame["goal"] == {"x_m": 5.0, "y_m": 7.5, "level": 0}
        assert server.counts.unknown == len(noise)


def test_too_long_or_too_many_messages_end_the_socket_alone() -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        for message, count in (("x" * 5000, 1), ("{}", 1000)):
            with opened(server) as page, pytest.raises(ConnectionClosed):
                send_and_listen(page, message, count)
        assert server.counts.flooding == 1
        with opened(server) as page:
            assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "hello"


def send_and_listen(page: ClientConnection, message: str, count: int) -> None:
    for _ in range(count):
        page.send(message)
    for _ in range(5):
        page.recv(timeout=PATIENCE_S)


def test_so_many_pages_and_no_more() -> None:
    with served() as (server, _), contextlib.ExitStack() as stack:
        for _ in range(MOST_PAGES):
            stack.enter_context(opened(server)).recv(timeout=PATIENCE_S)
        with opened(server) as late, pytest.raises(ConnectionClosed):
            late.recv(timeout=PATIENCE_S)
        assert server.pages == MOST_PAGES


@pytest.mark.slow
def test_too_many_check_ins_are_refused() -> None:
    said = '{"kind":"check_in","x_m":2,"y_m":7.5,"heading_rad":null,"sd_m":0.5}'
    with served() as (server, mailbox), opened(server) as page:
        page.recv(timeout=PATIENCE_S)
        for _ in range(MOST_CHECK_INS + 1):
            page.send(said)
        busy = "Not accepted: this is a replay, or the tracker is too busy."
        assert json.loads(page.recv(timeout=PATIENCE_S)) == {"kind": "refused", "reason": busy}
        assert list(popped(mailbox.check_ins)) == [CheckIn(2.0, 7.5, None, 0.5)] * MOST_CHECK_INS
        page.send(said.replace("7.5", "8.5"))
        assert json.loads(page.recv(timeout=PATIENCE_S))["reason"] == "Not accepted: it is inside a wall."
        page.send('{"kind":"undo","undo":1}')
        assert json.loads(page.recv(timeout=PATIENCE_S))["reason"] == "It is too late to undo this."
        page.send(said.replace("check_in", "consider"))
        assert json.loads(page.recv(timeout=PATIENCE_S))["text"].startswith("In North corridor.")
        assert not list(popped(mailbox.check_ins))
    with served(Mailbox(PLAN, "a replay", replay=True)) as (server, mailbox), opened(server) as page:
        assert json.loads(page.recv(timeout=PATIENCE_S))["replay"]
        page.send(said)
        assert json.loads(page.recv(timeout=PATIENCE_S))["kind"] == "refused"
        assert not list(popped(mailbox.check_ins))


def test_an_address_that_is_taken_is_named_or_another_is_found() -> None:
    with served() as (server, _):
        port = int(server.url.rstrip("/").rsplit(":", 1)[1])
        with pytest.raises(EchostepError, match=f"--port {port}"):
            PageServer(Mailbox(PLAN, "test", replay=False), Address(port=port))
    with pytest.raises(EchostepError, match="no-such-host"):
        PageServer(Mailbox(PLAN, "test", replay=False), Address("no-such-host.invalid", 0))
