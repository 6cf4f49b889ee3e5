# SPDX-License-Identifier: MIT
"""Reports over Meshtastic: the payload, its airtime, twenty wearers, and simulated nodes on pseudo terminals."""

from __future__ import annotations

import random
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from dataclasses import replace
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.inbox import Inbox, ListenerThread
from echostep_app.team.mesh import mesh
from echostep_app.team.mesh.mesh import (
    INTERVAL_S,
    MOST_USED,
    POSITION_EVERY,
    PRESETS,
    MeshListener,
    MeshNode,
    MeshTransport,
    airtime_s,
    interval_s,
)
from echostep_app.team.mesh.mesh_report import Unpacker, pack
from echostep_app.team.messages.report import Report, ReportedAlarm, decode, encode
from echostep_app.team.outbox import Outbox
from team.mesh_node import Air
from team.team_reports import PLAN, POSITION, report
from waiting import until

WEARERS = 20
OLDEST_S = 20.0  # that a position may be at the commander
DEMO = load_plan(PLAN)
UNPACKER = Unpacker(DEMO)
ALARM = ReportedAlarm("mayday", "no motion", 3, 41.0)


def unpacked(source: Report, number: int = 7) -> Report:
    """A report after the radio, and after the check that every report of a broker passes."""
    return decode(encode(UNPACKER.unpack(pack(source, number, 1_790_000_000.25))))


def test_a_report_survives_the_radio() -> None:
    source = report("änna", alarm=ALARM, battery_percent=63)
    found = unpacked(source)
    assert (found.team, found.name, found.run, found.sequence) == ("red", "änna", source.run, 7)
    assert (found.time, found.stale) == ("2026-09-21T14:13:20.250Z", "2026-09-21T14:13:50.250Z")
    assert (found.status, found.source, found.battery_percent, found.alarm) == ("tracking", "live", 63, ALARM)
    assert (found.plan, found.plan_sha256) == ("Demo office", DEMO.digest)
    p = found.position
    assert p is not None
    assert (p.x_m, p.y_m, p.floor, p.floor_name) == (POSITION.x_m, POSITION.y_m, 0, "Ground floor")
    expected = (POSITION.xx_m2, POSITION.xy_m2, POSITION.yy_m2, POSITION.heading_rad, POSITION.floor_probability)
    assert (p.xx_m2, p.xy_m2, p.yy_m2, p.heading_rad, p.floor_probability) == pytest.approx(expected, rel=3e-3)
    assert p.where
    assert found.place is not None
    assert found.motion is not None


def test_what_is_missing_stays_missing() -> None:
    waiting = unpacked(replace(report(), status="waiting", position=None, motion=None, place=None))
    assert (waiting.position, waiting.motion, waiting.place, waiting.alarm) == (None, None, None, None)
    without = unpacked(report(position=replace(POSITION, heading_rad=None)))
    assert without.position is not None
    assert (without.position.heading_rad, without.position.protection_m) == (None, None)


def test_another_plan_is_noticed() -> None:
    found = unpacked(report(plan_sha256="ab" * 32))
    assert (found.plan, found.plan_sha256[:8]) == ("", "abababab")


@given(
    x=st.floats(-1e5, 1e5), heading=st.floats(-7, 7), xx=st.floats(0, 1e12), yy=st.floats(0, 1e12),
    share=st.floats(-1, 1), floor=st.integers(-1000, 1000), z=st.floats(-1e5, 1e5), age=st.floats(0, 1e9),
)  # fmt: skip
def test_every_report_that_may_be_sent_is_believed(
    x: float, heading: float, xx: float, yy: float, share: float, floor: int, z: float, age: float
) -> None:
    position = replace(
        POSITION, x_m=x, heading_rad=heading, xx_m2=xx, yy_m2=yy, xy_m2=share * (xx * yy) ** 0.5, floor=floor, z_m=z, age_s=age,
    )  # fmt: skip
    assert unpacked(report(position=position)).position is not None


@given(st.binary(max_size=240))
def test_any_bytes_are_a_report_or_a_value_error(payload: bytes) -> None:
    for data in (payload, pack(report(), 1, 1.7e9)[: len(payload)], b"\x01" + payload):
        try:
            UNPACKER.unpack(data)
        except ValueError:
            continue


def test_airtime_by_hand() -> None:
    """40 bytes and 24 around them. SF 7: (512 - 28 + 44) / 28 -> 19 blocks; 20.25 + 8 + 95 symbols of 0.512 ms. SF 11: 12 blocks."""
    assert airtime_s(PRESETS["SHORT_FAST"], 40) == pytest.approx(123.25 * 0.512e-3)
    assert airtime_s(PRESETS["LONG_FAST"], 40) == pytest.approx(88.25 * 8.192e-3)
    assert airtime_s(PRESETS["SHORT_TURBO"], 40) == pytest.approx(123.25 * 0.256e-3)


def test_how_often_twenty_wearers_may_send() -> None:
    """Every 10 s by the short presets; Meshtastic's default preset carries them once a minute."""
    size = len(pack(report("wearer-17"), 1, time.time()))
    assert size <= 75
    for preset in ("SHORT_FAST", "SHORT_TURBO", "SHORT_SLOW"):
        assert interval_s(PRESETS[preset], size, WEARERS) <= 13.0, preset
    assert interval_s(PRESETS["SHORT_FAST"], size, WEARERS) == INTERVAL_S
    assert interval_s(PRESETS["LONG_FAST"], size, WEARERS) > 50.0


class Clock:
    """A clock that is set."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def monotonic(self) -> float:
        return self.now_s

    def time(self) -> float:
        return 1.79e9 + self.now_s


class Channel:
    """One channel: who sends waits until it is free and then for a random time; packets that begin within one symbol of the other are lost."""

    def __init__(self, clock: Clock) -> None:
        self.clock, self.free_s, self.busy_s = clock, 0.0, 0.0
        self.heard: list[tuple[float, bytes]] = []
        self.draw = random.Random(1)

    def transmit(self, payload: bytes) -> None:
        lasts_s = airtime_s(PRESETS["SHORT_FAST"], len(payload))
        begin_s = max(self.clock.now_s, self.free_s) + self.draw.uniform(0.0, 0.05)
        self.free_s = begin_s + lasts_s
        self.busy_s += lasts_s
        if self.draw.random() > 0.1:  # one packet in ten is lost
            self.heard.append((self.free_s, payload))


@pytest.mark.slow
def test_twenty_wearers_for_ten_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    """On one channel, a packet in ten lost: the position at the commander is at most 20 s old but when two in a row are lost."""
    clock = Clock()
    channel = Channel(clock)

    class Node:
        modem = PRESETS["SHORT_FAST"]

        def __init__(self, _port: str) -> None:
            self.draw = channel.draw

        def send(self, data: bytes) -> None:
            channel.transmit(data)

        def send_position(self, *_: Any) -> None:
            channel.transmit(bytes(30))

        def close(self) -> None:
            pass

    monkeypatch.setattr(mesh, "time", clock)
    monkeypatch.setattr(mesh, "MeshNode", Node)
    monkeypatch.setattr(random, "uniform", channel.draw.uniform)
    endpoint = parse_endpoint(f"mesh:///dev/none?wearers={WEARERS}")
    wearers = [MeshTransport(endpoint, ("red", f"w{k}"), print) for k in range(WEARERS)]
    for wearer in wearers:
        wearer.open()
    for _ in range(1200):
        clock.now_s += 0.5
        for k, wearer in enumerate(wearers):
            if clock.now_s > 1000.0 + 0.5 * k:
                wearer.send(report(f"w{k}", at_s=clock.time()))
    came: dict[str, list[float]] = defaultdict(list)
    for at_s, payload in channel.heard:
        if len(payload) > 30:
            came[UNPACKER.unpack(payload).name].append(at_s)
    gaps = [b - a for times in came.values() for a, b in zip(times, times[1:], strict=False)]
    assert len(came) == WEARERS
    assert channel.busy_s / 600.0 < MOST_USED
    assert sorted(gaps)[int(0.95 * len(gaps))] <= OLDEST_S
    assert max(gap for gap in gaps if gap < 1.5 * INTERVAL_S) <= INTERVAL_S + 1.5  # when none was lost


@pytest.mark.parametrize("reason", ["no motion", "fall", "help"])
def test_every_reason_of_an_alarm_is_sent(reason: Literal["no motion", "fall", "help"]) -> None:
    sent = report(alarm=replace(ALARM, reason=reason))
    assert UNPACKER.unpack(pack(sent, 1, 1_790_000_000.25)).alarm == sent.alarm


def test_an_alarm_goes_out_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[bytes] = []

    class Node:
        modem = PRESETS["SHORT_FAST"]

        def __init__(self, _port: str) -> None:
            pass

        def send(self, data: bytes) -> None:
            sent.append(data)

    monkeypatch.setattr(mesh, "MeshNode", Node)
    transport = MeshTransport(parse_endpoint("mesh:///dev/none"), ("red", "kim"), print)
    transport.open()
    quiet = report(place=None)
    for source in (quiet, quiet, replace(quiet, alarm=ALARM), replace(quiet, alarm=ALARM), quiet):
        transport.send(source)
    assert [UNPACKER.unpack(data).alarm for data in sent] == [None, ALARM, None]


@pytest.fixture
def air() -> Iterator[Air]:
    with Air() as air:
        yield air


@pytest.mark.slow
def test_a_report_goes_from_node_to_node(air: Air) -> None:
    """By the package's serial API: outbox, two pseudo terminals, and into the commander's inbox. Positions are Meshtastic's own too."""
    mine, theirs = air.node(), air.node()
    inbox = Inbox()
    listener = MeshListener(parse_endpoint(f"mesh://{theirs.port}"), "red", DEMO, inbox.put)
    words: list[str] = []
    with closing(ListenerThread(listener, words.append)) as receiver:
        assert until(lambda: receiver.connected), words
        transport = MeshTransport(parse_endpoint(f"mesh://{mine.port}"), ("red", "kim"), words.append)
        box = Outbox(transport, "mesh", words.append)
        box.offer(report("kim"))
        messages: list[Any] = []

        def heard() -> list[Any]:
            messages.extend(inbox.take_all()[0])
            return messages

        assert until(heard), words
        box.close()
    assert messages[0].topic == "echostep/red/kim/estimate"
    found = decode(messages[0].payload)
    assert found.position is not None
    assert (found.position.x_m, found.position.y_m) == (POSITION.x_m, POSITION.y_m)
    ports = [packet.decoded.portnum for packet in air.sent]
    assert ports[:2] == [256, 3]
    assert all(packet.hop_limit == 0 for packet in air.sent)
    assert POSITION_EVERY > 1


@pytest.mark.long
def test_a_node_that_answers_late_is_connected_and_gets_the_report(air: Air, monkeypatch: pytest.MonkeyPatch) -> None:
    """It boots: its port is there, it answers only after the first attempt to connect has been given up."""
    node, words, heard = air.node(), list[str](), list[Any]()
    transport = MeshTransport(parse_endpoint(f"mesh://{node.port}"), ("red", "kim"), words.append)
    with monkeypatch.context() as booting:
        booting.setattr(mesh, "ANSWER_S", 1)
        booting.setattr(node, "_heed", heard.append)
        box = Outbox(transport, "mesh", words.append)
        box.offer(report("kim"))
        assert until(lambda: any("no Meshtastic node answers" in line for line in words)), words
        assert heard

    def arrived() -> bool:
        box.offer(report("kim"))
        return bool(air.sent)

    assert until(arrived), words
    box.close()
    assert any("connected again" in line for line in words)


@pytest.mark.long
def test_twenty_wearers_on_pseudo_terminals(air: Air) -> None:
    """Twenty nodes and the commander's: three reports of each; never more than 20 s between two of one wearer."""
    inbox, words = Inbox(), list[str]()
    came: dict[str, list[float]] = defaultdict(list)
    listener = MeshListener(parse_endpoint(f"mesh://{air.node().port}"), None, DEMO, inbox.put)
    endpoints = [parse_endpoint(f"mesh://{air.node().port}?wearers={WEARERS}") for _ in range(WEARERS)]
    wearers = [MeshTransport(endpoint, ("red", f"w{k}"), words.append) for k, endpoint in enumerate(endpoints)]
    with ExitStack() as opened:
        receiver = opened.enter_context(closing(ListenerThread(listener, words.append)))
        with ThreadPoolExecutor(WEARERS) as pool:
            list(pool.map(lambda wearer: wearer.open(), wearers))
        for wearer in wearers:
            opened.callback(wearer.close, ended=True)
        assert until(lambda: receiver.connected), words

        def all_heard() -> bool:
            for k, wearer in enumerate(wearers):
                wearer.send(report(f"w{k}"))
            for message in inbox.take_all()[0]:
                came[decode(message.payload).name].append(message.received_s)
            return len(came) == WEARERS and min(map(len, came.values())) >= 3

        assert until(all_heard), (words, {name: len(times) for name, times in came.items()})
    gaps = [b - a for times in came.values() for a, b in zip(times, times[1:], strict=False)]
    assert max(gaps) <= OLDEST_S


def test_a_node_that_is_unplugged_is_an_os_error(air: Air) -> None:
    node = air.node()
    transport = MeshTransport(parse_endpoint(f"mesh://{node.port}"), ("red", "kim"), print)
    transport.open()
    node.unplug()

    def broken() -> bool:
        try:
            transport.send(report(alarm=ReportedAlarm("asking", "help", random.randrange(1, 60_000), 0.0)))
        except OSError:
            return True
        return False

    assert until(broken)
    transport.close(ended=False)
    with pytest.raises(OSError):  # noqa: PT011
        transport.open()


@pytest.mark.slow
def test_a_port_that_the_package_closes_under_a_write_is_an_os_error(air: Air) -> None:
    node = MeshNode(air.node().port)
    interface = node._interface
    wrapped = interface.stream

    class Closing:
        """A stream whose reader finds at the first write that the node is gone."""

        def write(self, _: bytes) -> None:
            interface.stream = None

        def read(self, _: int) -> bytes:
            """For the package's own thread, which may look at it meanwhile."""
            return b""

        def close(self) -> None:
            """Likewise."""

    interface.stream = Closing()
    with pytest.raises(ConnectionError, match="broke"):
        node.send(b"report")
    interface.stream = wrapped
    node.close()


def test_without_the_package_there_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "meshtastic", None)
    with pytest.raises(EchostepError, match=r"mesh:///dev/ttyUSB0 needs meshtastic, .* pip install 'echostep\[mesh\]'"):
        MeshTransport(parse_endpoint("mesh:///dev/ttyUSB0"), ("red", "kim"), print)


@pytest.mark.parametrize("url", ["mesh://", "mesh://host", "mesh:///dev/x?wearers=many", "mesh:///dev/x?ca=y"])
def test_what_is_no_port_is_named(url: str) -> None:
    with pytest.raises(EchostepError, match="expected mesh:///dev/PORT"):
        parse_endpoint(url)


@pytest.mark.parametrize("preset", [10, 14, 99])
def test_a_preset_of_newer_firmware_sends_seldom_and_says_so(preset: int) -> None:
    said: list[str] = []
    with Air(preset) as air:
        node = air.node()
        transport = MeshTransport(parse_endpoint(f"mesh://{node.port}"), ("red", "anna"), said.append)
        transport.open()
        transport.send(report())
        assert until(lambda: air.sent)
        transport.close(ended=True)
    assert "the node's modem preset is not known here" in said[0]
