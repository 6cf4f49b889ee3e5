# SPDX-License-Identifier: MIT
"""Outboxes on a real network, and a TAK server for one connection."""

from __future__ import annotations

import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from echostep_app.session.team.feeds import MarkFeed
from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.team.endpoint import parse_endpoint, parse_outlet
from echostep_app.team.messages.report import Report
from echostep_app.team.mqtt.publisher import MqttTransport
from echostep_app.team.outbox import Outbox
from team.team_reports import POSITION, report
from waiting import PATIENCE_S


def at(t_s: float, name: str = "anna") -> Report:
    return report(name, position=replace(POSITION, t_s=t_s))


def box_to(url: str, words: list[str] | None = None, name: str = "anna", run: str = "0123abcd") -> Outbox:
    said: list[str] = [] if words is None else words
    endpoint = parse_endpoint(url)
    return Outbox(MqttTransport(endpoint, "red", name, run), str(endpoint), said.append)


def feed_of(url: str, name: str) -> tuple[TeamSubscription, MarkFeed]:
    """What a wearer of team red on the demo's plan hears of the commanders, once the subscription is open."""
    outlet = parse_outlet([url], name, "red")
    subscription = TeamSubscription(outlet.endpoints[0], print)
    return subscription, MarkFeed(subscription, outlet, "0123abcd", report().plan_sha256)


@contextmanager
def tak(server: Path | None, authority: Path | None = None) -> Iterator[tuple[int, list[bytes]]]:
    """By TLS with the certificate `server`, which may want one of the `authority`; None: without TLS. Its port, and what it was sent."""
    context, received = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), list[bytes]()
    if server:
        context.load_cert_chain(server)
    if authority:
        context.load_verify_locations(authority)
        context.verify_mode = ssl.CERT_REQUIRED
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(PATIENCE_S)

        def serve() -> None:
            with suppress(OSError), listening.accept()[0] as plain:
                if not server:
                    plain.sendall(b"MQTT or something else that is no TLS\n" * 10)
                    plain.recv(1000)
                    return
                with context.wrap_socket(plain, server_side=True) as wrapped:
                    wrapped.sendall(b"welcome")
                    received.append(wrapped.recv(100))

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield listening.getsockname()[1], received
        thread.join()
