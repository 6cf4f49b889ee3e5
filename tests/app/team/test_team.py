# SPDX-License-Identifier: MIT
"""Reports, rosters and outboxes: what is told, what is believed, what is overtaken."""

from __future__ import annotations

import json
import math
import time
from dataclasses import replace

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep_app.team.commander import as_tree, notes
from echostep_app.team.inbox import MESSAGES_PER_TOPIC, Inbox
from echostep_app.team.messages.report import (
    BadReportError,
    Presence,
    ReportedAlarm,
    check_name,
    decode,
    encode,
    schema,
)
from echostep_app.team.roster import CONTRADICTION, MAX_MEMBERS, MAX_REASONS, MemberState, Roster
from team.team_reports import NOW, POSITION, UNIX, heard, report, said
from walks import PLAN


def test_a_report_reads_back_as_it_was_and_obeys_its_schema() -> None:
    r = report()
    assert decode(encode(r)) == r
    tree = json.loads(schema())
    jsonschema.Draft202012Validator.check_schema(tree)
    jsonschema.validate(json.loads(encode(r)), tree)
    assert r.stale_after_s == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (b'"x_m":3.0', b'"x_m":NaN', "not JSON"),
        (b'"x_m":3.0', b'"x_m":1e999', "x_m"),
        (b'"x_m":3.0', b'"x_m":1' + b"0" * 400, "x_m"),
        (b'"x_m":3.0', b'"x_m":"3"', "x_m"),
        (b'"x_m":3.0', b'"x_m":null', "x_m"),
        (b'"xx_m2":0.04', b'"xx_m2":-1', "xx_m2"),
        (b'"xy_m2":0.01', b'"xy_m2":9.0', "covariance"),
        (b'"sequence":1', b'"sequence":' + b"9" * 5000, "sequence"),
        (b'"sequence":1', b'"sequence":-1', "sequence"),
        (b'"name":"anna"', b'"name":"an\\u001bna"', "name"),
        (b'"name":"anna"', b'"name":"an/na"', "name"),
        (b'"name":"anna"', b'"name":"\\u202eanna"', "name"),
        (b'"name":"anna"', b'"name":"\xff"', "UTF-8"),
        (b'"name":"anna"', b'"name":"\\ud800"', "JSON"),
        (b'"name":"anna"', b'"name":"' + b"a" * 33 + b'"', "name"),
        (b'"name":"anna"', b'"name":"' + b"a" * 9000 + b'"', "too long"),
        (b'"plan":"Demo office"', b'"plan":"\\u001b]0;x"', "unprintable"),
        (b'"time":"20', b'"time":"xx', "time"),
        (b'"stale":"20', b'"stale":"21', "stale"),
        (b'"stale":"20', b'"stale":"19', "stale"),
        (b'"status":"tracking"', b'"status":"waiting"', "contradict"),
        (b'"status":"tracking"', b'"status":"fine"', "status"),
        (b'"echostep_report":1', b'"echostep_report":2', "echostep_report"),
        (b"}", b"", "JSON"),
        (b"{", b"[" * 4000, "not a report|not JSON"),
        (b"{", b'{"a":' * 1000, "not JSON"),
        (b'"status":"tracking"', b'"status":"\\u001b[2J"', "^wrong field status$"),
        (b'"team":"red",', b"", "no field `team`"),
        (b'"findings":[]', b'"findings":["\\u001b[2J"]', "unprintable"),
        (b'"findings":[]', b'"findings":["a","b","c","d","e"]', "findings"),
    ],
)
def test_a_wrong_payload_is_refused_by_name(old: bytes, new: bytes, why: str) -> None:
    payload = encode(report()).replace(old, new, 1)
    with pytest.raises(BadReportError, match=why):
        decode(payload)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda v: st.lists(v) | st.dictionaries(st.text(), v),
    max_leaves=8,
)


@pytest.mark.long
@given(st.data())
def test_a_report_with_one_field_replaced_is_believed_only_as_the_schema_says(draw: st.DataObject) -> None:
    tree = json.loads(encode(report()))
    inside = draw.draw(st.sampled_from([tree, tree["position"], tree["motion"], tree["place"], tree["streams"]]))
    inside[draw.draw(st.sampled_from(sorted(inside)))] = draw.draw(JSON)
    payload = json.dumps(tree).encode("utf-8", "surrogatepass")
    roster = Roster()
    roster.receive("echostep/red/anna/estimate", payload, False, NOW, UNIX)
    assert len(roster.members(NOW)) + sum(roster.rejected.values()) == 1
    json.dumps(as_tree(roster, PLAN, NOW), allow_nan=False)
    if roster.members(NOW):
        jsonschema.validate(json.loads(payload), json.loads(schema()))


@given(st.binary(max_size=200), st.integers(0, 700), st.integers(0, 40))
def test_a_damaged_report_never_stops_the_roster(garbage: bytes, at: int, cut: int) -> None:
    payload = encode(said())
    roster = Roster()
    roster.receive("echostep/red/anna/estimate", payload[:at] + garbage + payload[at + cut :], True, NOW, UNIX)
    for member in roster.members(NOW):
        assert math.isfinite(member.silent_s(NOW))


@given(st.lists(st.tuples(
    st.none() | st.text(max_size=20) | st.sampled_from(["echostep/red/anna/estimate", "echostep/red/anna/presence"]),
    st.binary(max_size=60) | st.sampled_from([encode(report()), encode(Presence(1, "0123abcd", "broken"))]),
    st.booleans(),
)))  # fmt: skip
def test_no_sequence_of_messages_stops_the_commander(letters: list[tuple[str | None, bytes, bool]]) -> None:
    inbox, roster = Inbox(), Roster()
    for letter in letters:
        inbox.put(*letter)
    roster.take(*inbox.take_all())
    assert roster.received == len(letters)
    assert len(roster.members(time.monotonic())) <= 1


@pytest.mark.parametrize("text", ["", " anna", "anna ", "a/b", "a+", "#", "a\nb", "\x1b[2J", "a\u200bb", "a" * 33])
def test_a_name_that_could_confuse_is_refused(text: str) -> None:
    with pytest.raises(BadReportError):
        check_name(text)


def test_only_the_commanders_clock_makes_somebody_stale() -> None:
    roster = Roster()
    for k, off_s in enumerate((-86_400.0, 86_400.0, 0.0)):
        name = f"n{k}"
        roster.receive(f"echostep/red/{name}/estimate", encode(report(name, 1, UNIX + off_s)), False, NOW, UNIX)
    assert {m.state(NOW + 1.9) for m in roster.members(NOW + 1.9)} == {MemberState.TRACKING}
    assert {m.state(NOW + 11.0) for m in roster.members(NOW + 11.0)} == {MemberState.STALE}


def test_no_tracker_may_ask_for_endless_patience() -> None:
    patient = replace(said(), stale=said().stale.replace("2027", "2027")[:8] + "16T08:00:00.000Z")
    roster = heard(patient)
    assert patient.stale_after_s > 3600.0
    assert roster.members(NOW)[0].state(NOW + 61.0) is MemberState.STALE


def test_what_a_broker_remembers_is_as_old_as_it_says() -> None:
    roster = Roster()
    roster.receive("echostep/red/anna/estimate", encode(report(at_s=UNIX - 300.0)), True, NOW, UNIX)
    (member,) = roster.members(NOW)
    assert member.state(NOW) is MemberState.STALE
    assert member.silent_s(NOW) == pytest.approx(300.0)


def test_what_is_of_another_day_is_not_shown() -> None:
    roster = heard(report(at_s=UNIX - 90_000.0), retained=True)
    assert (roster.members(NOW), list(roster.rejected)) == ([], ["remembered by the broker for more than a day"])
    roster = heard(report(at_s=UNIX - 3000.0), retained=True)
    roster.receive("echostep/red/anna/presence", encode(Presence(1, "0123abcd", "ended")), True, NOW, UNIX)
    assert len(roster.members(NOW)) == 1
    assert len(roster.members(NOW + 700.0)) == 0


def test_two_trackers_of_one_name_are_both_shown_and_named() -> None:
    roster = heard(said(), said(run="ffffffff", sequence=5))
    assert roster.duplicates(NOW) == {("red", "anna")}
    notes = [m["notes"] for m in as_tree(roster, PLAN, NOW)["members"]]
    assert len(notes) == 2
    assert all("name used twice" in n[0] for n in notes)


def test_a_restarted_tracker_replaces_its_former_run() -> None:
    roster = heard(said())
    roster.receive(
        "echostep/red/anna/presence", encode(Presence(1, "0123abcd", "broken")), False, NOW + 1.0, UNIX + 1.0
    )
    roster.receive("echostep/red/anna/estimate", encode(said(run="ffffffff")), False, NOW + 2.0, UNIX + 2.0)
    assert [m.report.run for m in roster.members(NOW + 2.0)] == ["ffffffff"]


def test_old_reports_and_those_that_did_not_come_are_counted() -> None:
    roster = heard(said(sequence=4), said(sequence=3), said(sequence=4))
    assert roster.rejected == {"older than what was heard before": 2}
    roster.receive("echostep/red/anna/estimate", encode(said(sequence=4)), True, NOW, UNIX)  # after a new connection
    assert roster.rejected == {"older than what was heard before": 2}
    roster.receive("echostep/red/anna/estimate", encode(report(sequence=8, at_s=UNIX + 3600.0)), False, NOW, UNIX)
    (member,) = roster.members(NOW)
    assert member.missed == 3


def test_two_senders_under_one_name_and_run_are_named() -> None:
    roster = heard(said())
    for k, sequence in enumerate(
        (1 << 53, 900, 10, 11, 901)
    ):  # forged: the first, which would make all others old, and the second
        made = report(sequence=sequence, at_s=UNIX + k)
        roster.receive("echostep/red/anna/estimate", encode(made), False, NOW + k, UNIX + k)
    (member,) = roster.members(NOW + 4.0)
    assert roster.rejected["a second sender under one name and run"] == 3
    assert f"{CONTRADICTION} 3 x" in notes(member, PLAN, NOW + 4.0, set())
    assert member.missed == 898


def test_late_is_not_lost_and_every_age_is_of_the_moment_it_is_shown() -> None:
    """A call for help comes before the end of a run, and that before silence; a newer report takes the end back."""
    roster = heard(said(alarm=ReportedAlarm("asking", "no motion", 1, 21.0)))
    (member,) = roster.members(NOW)
    assert [member.state(NOW + s).value for s in (1.9, 2.5, 4.0)] == ["tracking", "uncertain", "lost"]
    r = member.at(NOW + 4.0)
    assert (r.position, r.last_place and r.last_place.age_s) == (None, 4.0)
    assert r.last_place
    assert r.last_place.radius95_m == pytest.approx(POSITION.radius95_m + 6.0)
    assert r.alarm
    assert r.motion
    assert [r.alarm.age_s, r.motion.still_s] == pytest.approx([25.0, 4.4])
    ended, mayday = encode(Presence(1, "0123abcd", "ended")), ReportedAlarm("mayday", "help", 1, 0.0)
    roster.receive("echostep/red/anna/presence", ended, False, NOW + 8.0, UNIX)
    assert member.state(NOW + 60.0) is MemberState.ENDED
    roster.receive("echostep/red/anna/estimate", encode(said(sequence=5)), False, NOW + 60.0, UNIX)
    assert member.state(NOW + 70.5) is MemberState.STALE
    roster.receive("echostep/red/anna/estimate", encode(said(sequence=6, alarm=mayday)), False, NOW + 71.0, UNIX)
    roster.receive("echostep/red/anna/presence", ended, False, NOW + 71.0, UNIX)
    assert member.state(NOW + 72.0) is MemberState.MAYDAY


def test_strangers_fill_neither_roster_nor_reasons() -> None:
    roster = heard(said())
    for k in range(MAX_MEMBERS + 50):
        roster.receive(f"echostep/red/n{k}/estimate", encode(said(f"n{k}")), False, NOW, UNIX)
        roster.receive(f"echostep/red/x/{k}", b"", False, NOW, UNIX)
        roster.receive("echostep/red/anna/estimate", b'{"team": %d' % k, False, NOW, UNIX)
    assert len(roster.members(NOW)) == MAX_MEMBERS
    assert roster.members(NOW)[0].report.name == "anna"
    for k in range(100):
        roster.count_rejected(f"made up {k}")
    assert len(roster.rejected) <= MAX_REASONS + 1
    assert roster.rejected[f"more than {MAX_MEMBERS} trackers"] == 51


def test_a_flood_on_one_topic_costs_the_others_nothing() -> None:
    inbox, roster = Inbox(), Roster()
    for k in range(1, 10_001):
        inbox.put("echostep/red/anna/estimate", encode(said(sequence=k)) if k > 9_990 else b"?", False)
    inbox.put("echostep/red/bob/estimate", encode(said("bob")), False)
    inbox.put("echostep/red/bob/estimate", b"x" * 1_000_000, False)
    inbox.put(None, b"", False)
    roster.take(*inbox.take_all())
    assert {(m.report.name, m.report.sequence) for m in roster.members(NOW)} == {("anna", 10_000), ("bob", 1)}
    assert roster.rejected == {"flood": 10_000 - MESSAGES_PER_TOPIC, "too long": 1, "unknown topic": 1}
    assert roster.received == 10_003
