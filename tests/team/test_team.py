"""Reports, rosters and outboxes: what is told, what is believed, what is overtaken."""

from __future__ import annotations

import json
import math
import threading
import time
from dataclasses import replace
from xml.etree import ElementTree

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.errors import EchostepError
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.plan.model import Georeference, load_plan
from echostep.team import outbox
from echostep.team.commander import as_tree, table, update_roster
from echostep.team.cot import event, uid
from echostep.team.endpoint import parse_endpoint
from echostep.team.georeference import GroundPlane
from echostep.team.inbox import MESSAGES_PER_TOPIC, Inbox
from echostep.team.outbox import Outbox, aged, stamped
from echostep.team.picture import draw_team
from echostep.team.publish import ReportHistory
from echostep.team.report import BadReportError, Presence, Report, check_name, decode, encode, schema
from echostep.team.roster import MAX_MEMBERS, MAX_REASONS, MemberState, Roster
from team.team_reports import PLACE, PLAN, POSITION, report

NOW, UNIX = 1000.0, 1.8e9


def heard(*reports: Report, at_s: float = NOW, retained: bool = False) -> Roster:
    roster = Roster()
    for r in reports:
        roster.receive(f"echostep/{r.team}/{r.name}/estimate", encode(r), retained, at_s, UNIX)
    return roster


def said(name: str = "anna", sequence: int = 1, **fields: object) -> Report:
    return report(name, sequence, UNIX, **fields)


# what a report is


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


@given(st.binary(max_size=300))
def test_no_bytes_do_more_than_to_be_refused(payload: bytes) -> None:
    with pytest.raises(BadReportError):
        decode(payload)


@given(st.data())
def test_a_report_with_one_field_replaced_is_believed_only_as_the_schema_says(draw: st.DataObject) -> None:
    tree = json.loads(encode(report()))
    inside = draw.draw(st.sampled_from([tree, tree["position"], tree["motion"], tree["place"], tree["streams"]]))
    inside[draw.draw(st.sampled_from(sorted(inside)))] = draw.draw(JSON)
    payload = json.dumps(tree).encode("utf-8", "surrogatepass")
    roster = Roster()
    roster.receive("echostep/red/anna/estimate", payload, False, NOW, UNIX)
    assert len(roster.members(NOW)) + sum(roster.rejected.values()) == 1
    table(roster, load_plan(PLAN), NOW, connected=True)
    json.dumps(as_tree(roster, load_plan(PLAN), NOW), allow_nan=False)
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
    update_roster(inbox, roster)
    assert roster.received == len(letters)
    assert len(roster.members(time.monotonic())) <= 1
    table(roster, load_plan(PLAN), time.monotonic(), connected=False, columns=60)


@pytest.mark.parametrize("text", ["", " anna", "anna ", "a/b", "a+", "#", "a\nb", "\x1b[2J", "a\u200bb", "a" * 33])
def test_a_name_that_could_confuse_is_refused(text: str) -> None:
    with pytest.raises(BadReportError):
        check_name(text)


# the roster


def test_lost_and_stale_come_first() -> None:
    lost = said("zoe", status="lost", position=replace(POSITION, radius95_m=9.0))
    unsure = said("bob", status="uncertain", position=replace(POSITION, radius95_m=2.0))
    roster = heard(said("anna"), unsure, lost, said("waits", status="waiting", position=None))
    roster.receive("echostep/red/gone/estimate", encode(said("gone")), False, NOW - 30.0, UNIX - 30.0)
    order = [(m.report.name, m.state(NOW)) for m in roster.members(NOW)]
    assert order == [
        ("zoe", MemberState.LOST), ("gone", MemberState.STALE), ("bob", MemberState.UNCERTAIN), ("waits", MemberState.WAITING),
        ("anna", MemberState.TRACKING),
    ]  # fmt: skip


def test_only_the_commanders_clock_makes_somebody_stale() -> None:
    roster = Roster()
    for k, off_s in enumerate((-86_400.0, 86_400.0, 0.0)):
        name = f"n{k}"
        roster.receive(f"echostep/red/{name}/estimate", encode(report(name, 1, UNIX + off_s)), False, NOW, UNIX)
    assert {m.state(NOW + 9.0) for m in roster.members(NOW + 9.0)} == {MemberState.TRACKING}
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
    notes = [m["notes"] for m in as_tree(roster, load_plan(PLAN), NOW)["members"]]
    assert len(notes) == 2
    assert all("name used twice" in n[0] for n in notes)


def test_a_restarted_tracker_replaces_its_former_run() -> None:
    roster = heard(said())
    roster.receive(
        "echostep/red/anna/presence", encode(Presence(1, "0123abcd", "broken")), False, NOW + 1.0, UNIX + 1.0
    )
    roster.receive("echostep/red/anna/estimate", encode(said(run="ffffffff")), False, NOW + 2.0, UNIX + 2.0)
    assert [m.report.run for m in roster.members(NOW + 2.0)] == ["ffffffff"]


def test_old_reports_and_clocks_that_jump_are_counted() -> None:
    roster = heard(said(sequence=4), said(sequence=3), said(sequence=4))
    assert roster.rejected == {"older than what was heard before": 2}
    roster.receive("echostep/red/anna/estimate", encode(said(sequence=4)), True, NOW, UNIX)  # after a new connection
    assert roster.rejected == {"older than what was heard before": 2}
    roster.receive("echostep/red/anna/estimate", encode(report(sequence=8, at_s=UNIX + 3600.0)), False, NOW, UNIX)
    (member,) = roster.members(NOW)
    assert (member.missed, member.notes["clock jumped"]) == (3, 1)


def test_a_position_that_jumps_is_noted() -> None:
    far = said(sequence=2, position=replace(POSITION, x_m=300.0, t_s=13.0))
    near = said(sequence=3, position=replace(POSITION, x_m=303.0, t_s=14.0))
    assert heard(said(), far, near).members(NOW)[0].notes == {"position jumped": 1}


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
    update_roster(inbox, roster)
    assert {(m.report.name, m.report.sequence) for m in roster.members(NOW)} == {("anna", 10_000), ("bob", 1)}
    assert roster.rejected == {"flood": 10_000 - MESSAGES_PER_TOPIC, "too long": 1, "unknown topic": 1}
    assert roster.received == 10_003


# the outbox


class Recorded:
    """A line that keeps what it is given, and breaks when it is told to."""

    def __init__(self) -> None:
        self.sent: list[Report] = []
        self.broken = False
        self.hold = threading.Event()
        self.hold.set()
        self.opened = 0

    def open(self) -> None:
        if self.broken:
            raise ConnectionRefusedError("nobody there")
        self.opened += 1

    def send(self, report: Report) -> None:
        self.hold.wait(5.0)
        if self.broken:
            raise BrokenPipeError("it broke")
        self.sent.append(report)

    def close(self, *, ended: bool) -> None:
        pass


def until(true: object, seconds: float = 8.0) -> None:
    assert callable(true)
    end_s = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end_s, "waited in vain"
        time.sleep(0.01)


def test_every_report_goes_out_when_the_line_is_quick() -> None:
    line = Recorded()
    box = Outbox(line, "line", print)
    for k in range(500):
        box.offer(report(position=replace(POSITION, t_s=float(k))))
    assert "500 of 500 reports sent, 0 overtaken" in box.close()
    assert [r.position.t_s for r in line.sent if r.position] == [float(k) for k in range(500)]
    assert [r.sequence for r in line.sent] == list(range(1, 501))


def test_a_slow_line_sends_the_newest_and_counts_the_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "FRESH_S", 0.05)
    line = Recorded()
    line.hold.clear()
    box = Outbox(line, "line", print)
    slowest = 0.0
    for k in range(3000):
        began = time.perf_counter()
        box.offer(report(position=replace(POSITION, t_s=float(k))))
        slowest = max(slowest, time.perf_counter() - began)
    time.sleep(0.1)
    line.hold.set()
    until(lambda: line.sent and line.sent[-1].position and line.sent[-1].position.t_s == 2999.0)
    box.close()
    assert len(line.sent) < 1200
    assert box.counts.sent + box.counts.overtaken == box.counts.offered == 3000
    assert line.sent[-1].superseded == box.counts.overtaken
    assert slowest < 1.0  # a queue that waits for the line would need seconds


def test_a_broken_line_is_opened_again_and_no_later_report_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "RETRY_PAUSES_S", (0.02, 0.05))
    line, words = Recorded(), list[str]()
    box = Outbox(line, "line", words.append)
    box.offer(report())
    until(lambda: line.sent)
    line.broken = True
    for k in range(5):
        box.offer(report(position=replace(POSITION, t_s=100.0 + k)))
        time.sleep(0.03)
    line.broken = False
    until(lambda: line.sent[-1].position and line.sent[-1].position.t_s == 104.0)
    for k in range(50):
        box.offer(report(position=replace(POSITION, t_s=200.0 + k)))
    summary = box.close()
    assert [r.position.t_s for r in line.sent if r.position and r.position.t_s >= 200.0] == [
        200.0 + k for k in range(50)
    ]
    assert line.opened == 2
    assert words == ["line: it broke; tracking goes on, trying again", "line: connected again"]
    assert "connection broken 1 times" in summary


def test_a_line_that_never_opens_does_not_hold_up_the_end() -> None:
    line = Recorded()
    line.broken = True
    box = Outbox(line, "line", lambda _: None)
    box.offer(report())
    began = time.monotonic()
    assert "0 of 1 reports sent, 0 overtaken by newer ones, 1 unsent" in box.close()
    assert time.monotonic() - began < 3.0


def test_silence_makes_a_position_wide_and_lost() -> None:
    fresh = stamped(report(), 2, UNIX, 0.5, 0)
    silent = stamped(report(), 3, UNIX, 4.0, 0)
    assert fresh.position
    assert silent.position
    assert silent.place
    assert (fresh.status, fresh.position.xx_m2) == ("tracking", POSITION.xx_m2)
    assert (silent.status, silent.position.age_s) == ("lost", 4.0)
    assert silent.position.xx_m2 == pytest.approx(POSITION.xx_m2 + 36.0)
    assert silent.position.radius95_m > 14.0
    assert silent.place.sd_m == pytest.approx(math.hypot(PLACE.sd_m, 6.0))
    assert aged(POSITION, 0.0) == POSITION
    decode(encode(silent))


def test_a_heartbeat_repeats_the_last_report(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "HEARTBEAT_S", 0.05)
    line = Recorded()
    box = Outbox(line, "line", print)
    box.offer(report())
    until(lambda: len(line.sent) > 3)
    box.close()
    assert [r.sequence for r in line.sent] == list(range(1, len(line.sent) + 1))
    assert line.sent[3].position
    assert line.sent[3].position.age_s > 0.1
    assert box.counts.sent == 1


# the facts


def test_motion_knows_steps_way_pace_and_rest() -> None:
    trail = ReportHistory()
    walk = [
        Estimate(0.5 * k, 0.6 * min(k, 10), 0.0, 0.1, 0.0, 0.1, 0.0, 0.1, min(k, 10), TrackStatus.TRACKING)
        for k in range(21)
    ]
    motions = [trail.motion(e) for e in walk]
    assert motions[10].speed_m_s == pytest.approx(1.2)
    assert motions[20].walked_m == pytest.approx(6.0)
    assert motions[20].still_s == pytest.approx(5.0)
    assert (motions[20].speed_m_s, motions[20].steps) == (0.0, 10)


def test_a_place_on_earth() -> None:
    turned = replace(load_plan(PLAN), georeference=Georeference(16.0, 48.0, 0.5 * math.pi), uncertainty_m=0.4)
    there = GroundPlane(turned).place(100.0, 0.0, 0.3, 0.0)  # the plan's x points north
    assert there.lat_deg == pytest.approx(48.0 + 100.0 / 111_200.0, abs=1e-6)
    assert there.lon_deg == pytest.approx(16.0, abs=1e-9)
    assert there.course_deg == pytest.approx(0.0, abs=1e-9)
    assert there.sd_m == pytest.approx(0.5)
    west = GroundPlane(turned).place(0.0, 100.0, 0.3, 0.5 * math.pi)
    assert west.lon_deg == pytest.approx(16.0 - 100.0 / 74_630.0, abs=1e-6)
    assert west.course_deg == pytest.approx(270.0)


def test_an_event_of_cursor_on_target() -> None:
    made = event(report(battery_percent=55, place=replace(PLACE, sd_m=0.311)))
    assert made is not None
    top = ElementTree.fromstring(made)
    assert (top.tag, top.get("version"), top.get("type"), top.get("how")) == ("event", "2.0", "a-f-G-U-C", "m-f")
    assert top.get("uid") == "echostep-red-anna"
    times = [top.get(key) for key in ("time", "start", "stale")]
    assert times[0] == times[1] is not None
    point = top.find("point")
    assert point is not None
    assert point.attrib == {
        "lat": "48.20000000",
        "lon": "16.37000000",
        "hae": "9999999.0",
        "ce": "0.32",
        "le": "9999999.0",
    }
    group = top.find("detail/__group")
    assert group is not None
    assert group.attrib == {"name": "Red", "role": "Team Member"}
    contact, track, status = (top.find(f"detail/{name}") for name in ("contact", "track", "status"))
    assert contact is not None
    assert contact.get("callsign") == "anna"
    assert track is not None
    assert (track.get("course"), track.get("speed")) == ("61.4", "1.20")
    assert status is not None
    assert status.get("battery") == "55"
    assert "95 % within 0.8 m" in (top.findtext("detail/remarks") or "")
    assert event(report(place=None)) is None


def test_every_wearer_has_his_own_uid() -> None:
    pairs = [("a", "b"), ("a-b", "c"), ("a", "b-c"), ("a-b-c", "d"), ("a", "b-c-d"), ("a-b", "c-d")]
    assert len({uid(*pair) for pair in pairs}) == len(pairs)


@given(st.text(max_size=32))
def test_no_name_breaks_the_xml(name: str) -> None:
    try:
        check_name(name)
    except BadReportError:
        return
    made = event(report(name))
    assert made is not None
    contact = ElementTree.fromstring(made).find("detail/contact")
    assert contact is not None
    assert contact.get("callsign") == name


# addresses


@pytest.mark.parametrize(
    ("url", "why"),
    [
        ("localhost:1883", "mqtt://"),
        ("http://localhost", "mqtt://"),
        ("mqtt://", "HOST"),
        ("mqtt://host:99999", "not an address"),
        ("mqtt://host:0", "HOST"),
        ("mqtt://[::1", "not an address"),
        ("mqtt://host/path", "HOST"),
        ("mqtt://host?ca=x", "ca"),
        ("mqtts://host?cert=x", "belong together"),
        ("mqtts://host?colour=red", "colour"),
        ("cot+udp://me:secret@host", "user"),
        ("ftp://me:secret@host", "ftp|expected"),
    ],
)
def test_a_wrong_address_is_named_without_its_password(url: str, why: str) -> None:
    with pytest.raises(EchostepError, match=why) as found:
        parse_endpoint(url)
    assert "secret" not in str(found.value)


def test_an_address_with_everything() -> None:
    e = parse_endpoint("mqtts://me:p%40ss@[::1]:8884?ca=a.pem&cert=b.pem&key=c.pem")
    assert (e.host, e.port, e.user, e.password, e.secure) == ("::1", 8884, "me", "p@ss", True)
    assert str(e) == "mqtts://[::1]:8884"
    assert e.files == {"ca": "a.pem", "cert": "b.pem", "key": "c.pem"}


def test_the_picture_of_a_team(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("team")
    roster = heard(said(), said("$x_1$", status="lost"), said("w", status="waiting", position=None))
    for name in ("team.png", "team.svg"):
        draw_team(folder / name, load_plan(PLAN), roster.members(NOW), NOW)
        assert (folder / name).stat().st_size > 10_000
