# SPDX-License-Identifier: MIT
"""Connections that say nothing, or little, block no other connection and are closed."""

from __future__ import annotations

import contextlib
import logging
import socket
from collections.abc import Iterator

import pytest

from echostep_app.page.server import PageServer
from echostep_app.page.web import connections
from page.frames import fetched, opened, scene, served
from waiting import PATIENCE_S, until

IDLE = 150  # more than one address may have


@contextlib.contextmanager
def idle(server: PageServer, count: int, sent: bytes = b"") -> Iterator[list[socket.socket]]:
    """Connections of which each sends some bytes and then nothing."""
    port = int(server.url.split(":")[2].split("/")[0])
    with contextlib.ExitStack() as stack:
        opened_ones = []
        for _ in range(count):
            one = stack.enter_context(socket.create_connection(("127.0.0.1", port), PATIENCE_S))
            with contextlib.suppress(OSError):
                one.sendall(sent)
            opened_ones.append(one)
        yield opened_ones


def is_closed(one: socket.socket) -> bool:
    one.setblocking(False)
    try:
        return one.recv(1) == b""
    except BlockingIOError:
        return False
    except OSError:
        return True


@pytest.mark.slow
@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-a: "])
def test_idle_connections_block_no_other(sent: bytes) -> None:
    with served() as (server, mailbox):
        mailbox.publish(scene())
        with idle(server, IDLE, sent) as sockets:
            assert until(lambda: server.connections.closed > 0)
            assert fetched(server.url).status == 200
            with opened(server) as page:
                assert page.recv(timeout=PATIENCE_S)
            assert len(server.connections) <= connections.MOST_OF_ADDRESS
            assert until(lambda: any(is_closed(one) for one in sockets))


@pytest.mark.slow
def test_a_connection_without_a_request_is_closed_and_a_page_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    with served() as (server, mailbox), opened(server) as page:
        mailbox.publish(scene())
        monkeypatch.setattr(connections, "REQUEST_S", 0.2)  # after the page's own request, which may take its time
        monkeypatch.setattr(connections, "ANSWER_S", 0.2)
        monkeypatch.setattr(connections, "SWEEP_S", 0.05)
        with idle(server, 3) as sockets:
            assert until(lambda: all(is_closed(one) for one in sockets))
        assert server.connections.closed == 3
        assert page.recv(timeout=PATIENCE_S)
        assert server.pages == 1


def test_connections_faster_than_the_budget_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "ACCEPTS_A_SECOND", 0.001)
    monkeypatch.setattr(connections, "BURST", 5)
    monkeypatch.setattr(connections, "REQUEST_S", 10.0 * PATIENCE_S)  # none of them is closed for its silence
    with served() as (server, _), idle(server, 20):
        assert until(lambda: len(server.connections) == 5)
        assert server.connections.closed == 0


def test_forty_pages_that_open_at_once_wait_for_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each for what it needs to be drawn; what is beyond the budget would wait for a quarter of an hour."""
    monkeypatch.setattr(connections, "ACCEPTS_A_SECOND", 0.001)
    with served() as (server, _):
        for part in ("", "static/main.js", "lines/0", "static/theme.js"):
            assert all(fetched(f"{server.url}{part}").status == 200 for _ in range(40))


def test_the_libraries_log_lines_have_a_budget(capsys: pytest.CaptureFixture[str]) -> None:
    with served() as (server, _):
        for k in range(1000):
            logging.getLogger("asyncio").error("out of system resource %d", k)
        assert len(server.shared.faults.notices) <= 20
    assert "out of system" not in capsys.readouterr().err
