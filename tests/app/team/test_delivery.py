# SPDX-License-Identifier: MIT
"""What is said of the delivery of reports is what the receiver said: a broker that refuses them, one that has them, a receiver without a
point for some.
"""

from __future__ import annotations

import shutil
import subprocess
import time
from dataclasses import replace
from pathlib import Path

import paho.mqtt.client as paho
import pytest

from echostep.tracker import Tracker
from echostep_app.team import inbox
from echostep_app.team.endpoint import Endpoint, Outlet, parse_endpoint
from echostep_app.team.inbox import MOST_TRIES, ListenerThread
from echostep_app.team.messages.report import ReportedAlarm
from echostep_app.team.mqtt import broker as mqtt
from echostep_app.team.mqtt.broker import RefusedError, UnwantedError
from echostep_app.team.mqtt.publisher import Listener, MqttTransport
from echostep_app.team.outbox import Delivery, Outbox
from echostep_app.team.publish import Publishing
from team.network import box_to
from team.team_broker import Broker, needs_broker
from team.team_reports import report
from waiting import PATIENCE_S, until
from walks import PLAN

MAYDAY = ReportedAlarm("mayday", "help", 1, 3.0)
needs_passwords = pytest.mark.skipif(
    shutil.which("mosquitto_passwd") is None, reason="mosquitto_passwd is not installed"
)


@pytest.fixture
def guarded(tmp_path: Path) -> Broker:
    """A broker that lets wearer1 publish for team `green` alone."""
    passwords, rules = tmp_path / "pw", tmp_path / "acl"
    subprocess.run(["mosquitto_passwd", "-b", "-c", passwords, "wearer1", "x"], check=True, capture_output=True)
    rules.write_text("user wearer1\ntopic readwrite echostep/green/anna/#\n")
    return Broker(tmp_path, f"password_file {passwords}", f"acl_file {rules}")


@needs_broker
@needs_passwords
@pytest.mark.process
def test_a_refused_report_is_told_at_once_and_not_counted_as_sent(
    guarded: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the broker's first answer: neither the wait for another one nor a second try comes to its end here."""
    monkeypatch.setattr("echostep_app.team.mqtt.broker.ANSWER_S", 10.0 * PATIENCE_S)
    monkeypatch.setattr("echostep_app.team.outbox.RETRY_PAUSES_S", (10.0 * PATIENCE_S,))
    with guarded as broker:
        words: list[str] = []
        box = box_to(f"mqtt://wearer1:x@127.0.0.1:{broker.port}", words)
        box.offer(report())
        assert until(lambda: words)
        said = box.close()
    assert "the broker does not let user wearer1 publish as red/anna (Not authorized): check --team, --name" in words[0]
    assert "0 of 1 reports sent" in said
    assert "at the end: the broker does not let" in said


@needs_broker
@needs_passwords
@pytest.mark.process
@pytest.mark.usefixtures("patient")
def test_what_the_rules_allow_is_acknowledged_and_other_topics_are_refused(guarded: Broker) -> None:
    with guarded as broker:
        url = f"mqtt://wearer1:x@127.0.0.1:{broker.port}"
        outlet = Outlet((parse_endpoint(url),), "anna", "green")
        lines: list[str] = []
        with Publishing(outlet, Tracker(PLAN), "live", lines.append) as publishing:
            assert publishing.receipt(1) == "It is being sent."
            publishing._offer(replace(report(), team="green", alarm=MAYDAY))
            assert until(lambda: "broker has it" in publishing.receipt(1))
            assert publishing.receipt(2) == "It is being sent."
            assert publishing.fault == ""
        assert "2 of 2 reports sent" in lines[-1]
        listener = Listener(parse_endpoint(url), ["echostep/green/anna/#"], lambda *_: None)
        listener.open()
        with pytest.raises(UnwantedError, match="Not authorized"):
            listener.publish("echostep-table/green/mark", b"{}")
        listener.close()


@needs_broker
@pytest.mark.process
def test_the_version_is_negotiated_anew_and_an_old_one_cannot_refuse_so_its_answer_is_no_receipt(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither silence nor an old broker before decides on the version of the next connection."""
    connect, is_old = mqtt.connect, [False, True, False, False, False]

    def connecting(client: paho.Client, endpoint: Endpoint) -> int:
        if client.protocol == paho.MQTTv5 and is_old.pop(0):
            raise RefusedError("an old one")
        return connect(client, endpoint)

    def kind() -> Delivery:
        transport.open()
        made = transport.send(report())
        transport.close(ended=True)
        return made

    monkeypatch.setattr(mqtt, "connect", connecting)
    with Broker(tmp_path) as broker:
        transport = MqttTransport(parse_endpoint(broker.url), "red", "anna", "0123abcd")
        assert [kind(), kind(), kind()] == [Delivery.ACKNOWLEDGED, Delivery.SENT, Delivery.ACKNOWLEDGED]
        broker.freeze()
        monkeypatch.setattr(mqtt, "ANSWER_S", 0.2)
        with pytest.raises(TimeoutError, match="does not answer"):
            transport.open()
        monkeypatch.setattr(mqtt, "ANSWER_S", PATIENCE_S)
        broker.thaw()
        assert kind() is Delivery.ACKNOWLEDGED


@needs_broker
@pytest.mark.process
def test_a_frozen_broker_is_told_within_3_s_and_the_connection_lasts(tmp_path: Path) -> None:
    """By those who send, in whose queue reports come, and by those who only hear."""
    with Broker(tmp_path) as broker:
        lines: list[str] = []
        box = box_to(broker.url, lines)
        receiver = ListenerThread(Listener(parse_endpoint(broker.url), ["echostep/#"], lambda *_: None), lines.append)
        box.offer(report())
        assert until(lambda: box.counts.sent and receiver.connected)
        broker.freeze()
        began_s = time.monotonic()
        box.offer(report())
        assert until(lambda: box.fault.startswith("no answer for ") and not receiver.connected)
        assert time.monotonic() - began_s < 3.0
        broker.thaw()
        assert until(lambda: not box.fault and receiver.connected and not receiver.fault)
        receiver.close()
        assert "connection broken 0 times" in box.close()
    assert lines == []


def test_a_mayday_that_cannot_go_out_is_told_first_and_holds_up_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """The pause before the next try is not waited for."""
    monkeypatch.setattr("echostep_app.team.outbox.RETRY_PAUSES_S", (10.0 * PATIENCE_S,))
    lines: list[str] = []
    outlet = Outlet((parse_endpoint("mqtt://127.0.0.1:1"),), "anna", "green")
    with Publishing(outlet, Tracker(PLAN), "live", lines.append) as publishing:
        assert until(lambda: publishing.fault)
        publishing._offer(report(alarm=MAYDAY))
        assert any(line.startswith("MAYDAY has not gone out: mqtt: connection refused") for line in lines)
        assert publishing.receipt(1).startswith("It has not gone out: mqtt: connection refused")
        assert lines[0].startswith("mqtt://127.0.0.1:1: connection refused")


def test_a_transport_that_leaves_reports_out_sends_none() -> None:
    class Leaving:
        def open(self) -> None: ...

        def send(self, _: object) -> Delivery:
            return Delivery.LEFT_OUT

        def close(self, *, ended: bool) -> None: ...

    box = Outbox(Leaving(), "leaving", print)
    box.offer(report(alarm=MAYDAY))
    assert until(lambda: box.counts.left_out)
    assert "0 of 1 reports sent, 0 overtaken by newer ones, 0 unsent, 1 left out" in box.close()
    assert box.delivered is None


class Refusing:
    """A broker at whose connection one message breaks; the others are taken."""

    def __init__(self, poison: bytes) -> None:
        self.opened = 0
        self.taken: list[bytes] = []
        self._poison = poison

    def open(self) -> str:
        self.opened += 1
        return ""

    def run_once(self, timeout_s: float) -> None:
        """Nothing comes."""

    def probe(self) -> None:
        """It answers."""

    def publish(self, topic: str, payload: bytes) -> None:
        if payload == self._poison:
            raise ConnectionError(f"{topic} breaks it")
        self.taken.append(payload)

    def close(self) -> None:
        """Nothing to close."""


def test_a_message_that_breaks_the_connection_every_time_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those behind it come through."""
    monkeypatch.setattr(inbox, "RETRY_PAUSES_S", (0.0,))
    broker, said = Refusing(b"too large"), list[str]()
    receiver = ListenerThread(broker, said.append)
    assert not receiver.waiting
    receiver.send("beacons", b"too large")
    receiver.send("mark", b"small")
    assert until(lambda: broker.taken == [b"small"])
    assert until(lambda: not receiver.waiting)
    receiver.close()
    assert broker.opened == MOST_TRIES + 1
    assert "a message of 9 bytes on beacons is given up: the broker does not take it" in said
