# SPDX-License-Identifier: MIT
"""The team feed: places of another wearer from a real broker, as chunks.

The team subscription: every reader gets the messages of its topics, and none of the others.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from echostep.errors import EchostepError
from echostep.plan import load_plan
from echostep.tracker import Tracker
from echostep_app.ports.teammate import Teammate, parse_teammate
from echostep_app.session.options import OutputOptions
from echostep_app.session.session import Session
from echostep_app.session.team import feeds
from echostep_app.session.team.feeds import TeamFeed
from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.team.endpoint import parse_endpoint, parse_outlet
from echostep_app.team.inbox import MESSAGES_PER_TOPIC
from team.network import box_to
from team.team_broker import Broker, needs_broker
from team.team_reports import PLAN, POSITION, report
from waiting import until


def test_without_a_broker_it_is_said_what_is_missing(tmp_path: Path) -> None:
    for outlet in (None, parse_outlet(["cot+udp://127.0.0.1:6969"], "bo", "red")):
        output = OutputOptions(tmp_path, terminal=False, outlet=outlet)
        session = Session(Tracker(load_plan(PLAN)), "bo", "live", output, "wearer:anna")
        with pytest.raises(EchostepError, match=r"--guide wearer:anna needs .* --publish mqtt://HOST"), session:
            pass


@needs_broker
@pytest.mark.usefixtures("patient")
def test_the_newest_place_of_the_wearer_is_heard_although_the_broker_dies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feeds, "NEWS_S", 0.0)
    monkeypatch.setattr("echostep_app.session.team.subscription.LOOK_S", 0.0)
    said: list[str] = []
    heard: list[Teammate | None] = []
    with Broker(tmp_path) as broker:
        subscription = TeamSubscription(parse_endpoint(broker.url), said.append)
        feed = TeamFeed(subscription, "red", "anna", load_plan(PLAN), said.append)
        subscription.open()

        def is_at(x_m: float) -> bool:
            heard.extend(parse_teammate(payload) for payload in feed.pop())
            return any(place and place.x_m == x_m for place in heard)

        anna, eve = box_to(broker.url), box_to(broker.url, name="eve")
        eve.offer(report("eve", position=replace(POSITION, x_m=9.0)))
        anna.offer(report("anna", position=replace(POSITION, where="in Office 1")))
        assert until(lambda: is_at(3.0))
        broker.stop()
        assert until(lambda: any("trying again" in line for line in said))
        broker.start()
        anna.offer(report("anna", position=replace(POSITION, x_m=5.0)))
        assert until(lambda: is_at(5.0))
        anna.offer(report("anna", plan_sha256="0" * 64, position=replace(POSITION, x_m=6.0)))
        assert until(lambda: is_at(6.0) or any("another plan" in line for line in said))
        for box in (anna, eve):
            box.close()
        subscription.close()
    assert {place.name for place in heard if place} == {"anna"}
    assert heard[0] == Teammate("anna", 3.0, 2.0, 0, 0.8, "on Ground floor, in Office 1")
    assert not any(place and place.x_m == 6.0 for place in heard)


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
