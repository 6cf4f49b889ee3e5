# SPDX-License-Identifier: MIT
"""Reports on real sockets: a Mosquitto broker that dies and returns, TLS, datagrams and streams of Cursor on Target."""

from __future__ import annotations

import json
import random
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import paho.mqtt.client as paho
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from echostep_app.team import outbox
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.inbox import Inbox, ListenerThread
from echostep_app.team.messages.report import encode
from echostep_app.team.mqtt.publisher import Listener, MqttTransport
from echostep_app.team.roster import Member, MemberState, Roster
from players import playing
from team.network import at, box_to
from team.team_broker import Broker, Certificates, needs_broker
from team.team_reports import report
from waiting import PATIENCE_S, ends, until

pytestmark = pytest.mark.usefixtures("quick", "patient")


class Ear:
    """A commander without a screen."""

    def __init__(self, url: str) -> None:
        self.inbox, self.roster, self.times = Inbox(), Roster(), list[float]()
        self.words: list[str] = []
        self.reception = ListenerThread(Listener(parse_endpoint(url), ["echostep/+/+/+"], self.hear), self.words.append)

    def hear(self, topic: str | None, payload: bytes, retained: bool) -> None:
        self.inbox.put(topic, payload, retained)
        if topic and topic.endswith("/estimate") and payload.startswith(b'{"echostep_report"'):
            self.times.append((json.loads(payload)["position"] or {}).get("t_s", -1.0))

    def members(self) -> list[Member]:
        self.roster.take(*self.inbox.take_all())
        return self.roster.members(time.monotonic())

    def only(self) -> Member:
        (member,) = self.members()
        return member


@contextmanager
def listening(url: str) -> Iterator[Ear]:
    feed = Ear(url)
    try:
        assert until(lambda: feed.reception.connected)
        yield feed
    finally:
        feed.reception.close()


@needs_broker
def test_a_broker_that_dies_and_returns_loses_no_later_report(tmp_path: Path) -> None:
    words: list[str] = []
    with Broker(tmp_path) as broker, listening(broker.url) as feed:
        box = box_to(broker.url, words)
        for k in range(20):
            box.offer(at(float(k)))
        assert until(lambda: 19.0 in feed.times)
        broker.stop()
        assert until(lambda: words)
        for k in range(100, 105):
            box.offer(at(float(k)))
        broker.start()
        assert until(lambda: 104.0 in feed.times)
        for k in range(200, 250):
            box.offer(at(float(k)))
        assert until(lambda: 249.0 in feed.times)
        heard = dict.fromkeys(t for t in feed.times if t >= 200.0)  # a heartbeat may repeat the last one
        assert list(heard) == [float(k) for k in range(200, 250)]
        assert feed.only().state(time.monotonic()) is MemberState.TRACKING
        summary = box.close()
        assert until(lambda: feed.only().state(time.monotonic()) is MemberState.ENDED)
    assert "broken 1 times" in summary
    assert words[-1].endswith("connected again")


@needs_broker
def test_a_frozen_broker_neither_slows_the_tracker_nor_keeps_old_reports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outbox, "FRESH_S", 0.3)
    with Broker(tmp_path) as broker, listening(broker.url) as feed:
        box = box_to(broker.url)
        box.offer(at(0.0))
        assert until(lambda: 0.0 in feed.times)
        broker.freeze()
        for k in range(100):
            assert ends(partial(box.offer, at(1.0 + k)))
            time.sleep(0.01)  # at least: the first ones are older than FRESH_S in the end
        broker.thaw()
        assert until(lambda: 100.0 in feed.times)
        box.close()
    assert len(feed.times) < 80
    assert box.counts.overtaken > 30


@needs_broker
def test_a_tracker_that_vanishes_leaves_its_last_will_and_its_last_place(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker:
        line = MqttTransport(parse_endpoint(broker.url), "red", "anna", "0123abcd")
        line.open()
        line.send(at(7.0))
        line.close(ended=False)
        with listening(broker.url) as feed:
            assert until(lambda: feed.members() and feed.only().presence == "broken")
            member = feed.only()
            assert (member.retained, member.state(time.monotonic())) == (True, MemberState.STALE)
            assert member.report.position
            assert member.report.position.t_s == 7.0


@needs_broker
def test_two_trackers_of_one_name_do_not_throw_each_other_out(tmp_path: Path) -> None:
    with Broker(tmp_path) as broker, listening(broker.url) as feed:
        boxes = [box_to(broker.url, run=run) for run in ("11111111", "22222222")]
        for k in range(5):
            for box, run in zip(boxes, ("11111111", "22222222"), strict=True):
                box.offer(replace(at(float(k)), run=run))
        assert until(lambda: len(feed.members()) == 2)
        assert feed.roster.duplicates(time.monotonic()) == {("red", "anna")}
        assert [box.counts.breaks for box in boxes] == [0, 0]
        for box in boxes:
            box.close()


@needs_broker
# Paho leaves a socket that failed to shake hands to the collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_tls_with_client_certificates(tmp_path: Path, certificates: Certificates) -> None:
    c = certificates
    asked = (f"cafile {c.ca}", f"certfile {c.server}", f"keyfile {c.server}", "require_certificate true")
    with Broker(tmp_path, *asked) as broker:
        url = f"mqtts://127.0.0.1:{broker.port}"
        with listening(url + c.query(c.client)) as feed:
            box = box_to(url + c.query(c.client))
            box.offer(at(3.0))
            assert until(lambda: 3.0 in feed.times)
            box.close()


@needs_broker
def test_a_commander_survives_garbage_and_floods(tmp_path: Path) -> None:
    rng = random.Random(5)
    with Broker(tmp_path, "max_queued_messages 100000") as broker, listening(broker.url) as feed:
        enemy = paho.Client(CallbackAPIVersion.VERSION2)
        enemy.connect("127.0.0.1", broker.port)
        enemy.loop_start()
        right = encode(report())
        enemy.publish("echostep/red/eve/estimate", b"\xff\xfe{", retain=True)
        enemy.publish("echostep/red/eve/estimate", b"x" * 30_000)
        enemy.publish("echostep/red/eve/estimate", b"x" * 1_000_000)
        enemy.publish("echostep/red/\u202eeve/estimate", right)
        enemy.publish("echostep/red/bob/estimate", right)
        enemy.publish("echostep/red/eve/presence", b"{}")
        assert until(lambda: feed.members() is not None and sum(feed.roster.rejected.values()) >= 5)
        assert {"not JSON", "too long", "name and topic contradict each other"} <= set(feed.roster.rejected)
        box = box_to(broker.url)
        for k in range(10_000):
            enemy.publish("echostep/red/eve/estimate", rng.randbytes(40))
            if k % 500 == 0:
                box.offer(at(float(k)))
        assert until(lambda: feed.members() is not None and feed.roster.received > 10_000)
        assert until(lambda: 9500.0 in feed.times)
        assert feed.only().report.name == "anna"
        enemy.loop_stop()
        enemy.disconnect()
        box.close()
    assert feed.words == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "nonsense",
    [
        b"",
        b"\x20\x02\x00\x00" + b"\xff" * 50,
        b"\x20\x01",
        b"\x00" * 100,
        b"HTTP/1.1 400 Bad Request\r\n\r\n",
        b"\xff" * 4096,
    ],
)
def test_a_broker_that_speaks_nonsense_stops_nobody(nonsense: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0.2)

        def serve() -> None:
            with suppress(OSError), server.accept()[0] as caller:  # the other end may be gone already
                caller.settimeout(PATIENCE_S)
                caller.recv(1000)
                caller.sendall(nonsense)
                time.sleep(0.05)

        url = f"mqtt://127.0.0.1:{server.getsockname()[1]}"
        words: list[str] = []
        with playing(serve):
            box, feed = box_to(url, words), Ear(url)
            try:
                box.offer(at(1.0))
                assert until(lambda: words and feed.words)
            finally:
                feed.reception.close()
                box.close()
    assert "trying again" in words[0]
