# SPDX-License-Identifier: MIT
"""Feeds from a real broker: teammates who can be met, shared beacons."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from echostep.ports.chunks import BOARD, Chunk
from echostep.ports.people.meeting import MEETING, parse_meeting
from echostep.ports.people.team_beacons import TEAM_BEACONS, SharedBeacon, TeamBeacons, parse_team_beacons
from echostep_app.session.chunk_streams import MessageSource, with_messages
from echostep_app.session.team import teammate_feed
from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.session.team.teammate_feed import TeammateFeed
from echostep_app.team.endpoint import parse_endpoint, parse_outlet
from echostep_app.team.inbox import MESSAGES_PER_TOPIC
from echostep_app.team.mqtt.publisher import Listener
from team.network import box_to
from team.team_broker import Broker, needs_broker
from team.team_reports import POSITION, report
from waiting import until
from walks import PLAN

ANNA, EVE, MARK = "echostep/red/anna/estimate", "echostep/blue/eve/estimate", "echostep-table/mark/0123abcd"


def subscribed() -> tuple[TeamSubscription, dict[str, list[str | None]]]:
    subscription = TeamSubscription(parse_endpoint("mqtt://127.0.0.1"), print)
    topics = {"red": ["echostep/red/+/+"], "anna": ["echostep/+/anna/+"], "marks": ["echostep-table/mark/#"]}
    heard: dict[str, list[str | None]] = {name: [] for name in topics}
    for name, of_name in topics.items():
        subscription.add(of_name, lambda message, name=name: heard[name].append(message.topic))  # type: ignore[misc]
    return subscription, heard


def test_readers_of_one_topic_both_get_it_and_others_do_not() -> None:
    subscription, heard = subscribed()
    for topic in (ANNA, EVE, MARK):
        subscription._inbox.put(topic, b"{}", False)
    subscription.look()
    subscription.look()
    assert heard == {"red": [ANNA], "anna": [ANNA], "marks": [MARK]}


def test_what_no_reader_gets_is_counted() -> None:
    subscription, heard = subscribed()
    subscription._inbox.put(None, b"{}", False)
    for _ in range(MESSAGES_PER_TOPIC + 2):
        subscription._inbox.put(MARK, b"{}", False)
    subscription.look()
    assert subscription.rejected == {"unknown topic": 1, "flood": 2}
    assert len(heard["marks"]) == MESSAGES_PER_TOPIC


def test_before_it_is_open_nothing_is_sent() -> None:
    subscription, _ = subscribed()
    assert not subscription.send("echostep/red/anna/beacons", b"{}")
    subscription.close()


RUN = "0000beac"


def arrival_ns(chunk: Chunk | None) -> int:
    return chunk.t_arrival_ns if chunk else 0


@needs_broker
@pytest.mark.usefixtures("patient")
def test_teammates_on_this_plan_can_be_met(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The wearer's own reports, those on another plan and those of another team are not among them."""
    monkeypatch.setattr("echostep_app.session.team.subscription.LOOK_S", 0.0)
    with Broker(tmp_path) as broker:
        feed, subscription = a_feed(broker, "bo", RUN)
        said: list[tuple[str, ...]] = []

        def hears(*names: str) -> bool:
            said.extend([news] if (news := feed.news()) is not None else [])
            return bool(said) and said[-1] == names

        boxes = {name: box_to(broker.url, name=name) for name in ("zoe", "bo", "eve", "anna")}
        boxes["zoe"].offer(report("zoe"))
        boxes["bo"].offer(report("bo"))
        boxes["eve"].offer(report("eve", plan_sha256="0" * 64))
        assert until(lambda: hears("zoe"))
        boxes["anna"].offer(report("anna", position=replace(POSITION, x_m=5.0)))
        assert until(lambda: hears("anna", "zoe"))
        source: MessageSource = MEETING, lambda: feed.meetings(["anna", "eve", "nobody", "bo"])
        chunks = [*with_messages([Chunk(BOARD, 7, b"")], [source], arrival_ns)]
        for box in boxes.values():
            box.close()
        subscription.close()
    assert [(chunk.port, chunk.t_arrival_ns) for chunk in chunks if chunk] == [(BOARD, 7), (MEETING, 7)]
    met = parse_meeting(chunks[1].data if chunks[1] else b"")
    assert met is not None
    assert (met.name, met.x_m, met.level, met.range_m) == ("anna", 5.0, 0, None)
    assert met.age_s >= POSITION.age_s


def a_beacon(number: int) -> SharedBeacon:
    return SharedBeacon(number, 4.0, 7.5, 0, 0.01, 0.0, 0.01)


@needs_broker
def test_beacons_reach_teammates_once_and_hostile_ones_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of this run, of another plan and of another team are not heard; those of an earlier run under the same name are."""
    monkeypatch.setattr("echostep_app.session.team.subscription.LOOK_S", 0.0)
    monkeypatch.setattr(teammate_feed, "SHARE_S", 0.0)
    early = TeamBeacons(1, "bo", "0000aaaa", PLAN.digest, (a_beacon(3),))
    heard: list[TeamBeacons] = []
    with Broker(tmp_path) as broker:
        publish(broker.url, "echostep/red/bo/beacons", early.encode())
        (bo, of_bo), (zoe, of_zoe) = (a_feed(broker, name, run) for name, run in (("bo", "0000bbbb"), ("zoe", RUN)))

        def hears(count: int) -> bool:
            bo.news()
            chunks = with_messages([Chunk(BOARD, 7, b"")], [(TEAM_BEACONS, bo.beacons)], arrival_ns)
            heard.extend(told for c in chunks if c and c.port == TEAM_BEACONS and (told := parse_team_beacons(c.data)))
            return len(heard) == count

        assert until(lambda: hears(1))
        zoe.share(lambda: None)  # its tracker does not know its place
        zoe.share(lambda: (a_beacon(7),))
        assert until(lambda: hears(2))
        bo.share(lambda: (a_beacon(8),))
        for topic, payload in (
            ("red/eve", TeamBeacons(1, "eve", RUN, "0" * 64, (a_beacon(1),)).encode()), ("blue/eve", zoe._shared),
            ("red/eve", zoe._shared), ("red/eve", b"[]"),
        ):  # fmt: skip
            publish(broker.url, f"echostep/{topic}/beacons", payload)
        zoe.share(lambda: (a_beacon(7), a_beacon(9)))
        assert until(lambda: hears(3) and sum(bo.rejected.values()) == 2)
        of_bo.close()
        of_zoe.close()
    assert [(told.name, told.run, [b.number for b in told.beacons]) for told in heard] == [
        ("bo", "0000aaaa", [3]), ("zoe", RUN, [7]), ("zoe", RUN, [7, 9]),
    ]  # fmt: skip
    assert bo.rejected == {"beacons and topic contradict each other": 1, "not valid beacons": 1}


def publish(url: str, topic: str, payload: bytes) -> None:
    sender = Listener(parse_endpoint(url), ["nothing"], lambda *_: None)
    sender.open()
    sender.publish(topic, payload)
    sender.close()


def a_feed(broker: Broker, name: str, run: str) -> tuple[TeammateFeed, TeamSubscription]:
    outlet = parse_outlet([broker.url], name, "red")
    subscription = TeamSubscription(outlet.endpoints[0], print)
    feed = TeammateFeed(subscription, outlet, run, PLAN)
    subscription.open()
    return feed, subscription
