# SPDX-License-Identifier: MIT
"""The team subscription: every reader gets the messages of its topics, and none of the others."""

from __future__ import annotations

from echostep_app.session.team.subscription import TeamSubscription
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.inbox import MESSAGES_PER_TOPIC

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
