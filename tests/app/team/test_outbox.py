# SPDX-License-Identifier: MIT
"""The outbox: the newest report first, broken lines, heartbeats; motion, places, events and addresses."""

from __future__ import annotations

import math
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.plan import Georeference
from echostep_app.team import outbox
from echostep_app.team.cot import event, uid
from echostep_app.team.endpoint import parse_endpoint
from echostep_app.team.messages.report import BadReportError, Report, check_name, decode, encode
from echostep_app.team.outbox import Delivery, Outbox, stamped
from echostep_app.team.publish import GroundPlane, ReportHistory
from team.team_reports import PLACE, POSITION, UNIX, report
from waiting import PATIENCE_S, until
from walks import PLAN


class Recorded:
    """A line that keeps what it is given."""

    def __init__(self) -> None:
        self.sent: list[Report] = []

    def open(self) -> None:
        pass

    def send(self, report: Report) -> Delivery:
        self.sent.append(report)
        return Delivery.SENT

    def close(self, *, ended: bool) -> None:
        pass


@pytest.mark.usefixtures("patient")
def test_every_report_goes_out_when_the_line_is_quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "HEARTBEAT_S", PATIENCE_S)
    line = Recorded()
    box = Outbox(line, "line", print)
    for k in range(500):
        box.offer(report(position=replace(POSITION, t_s=float(k))))
    assert "500 of 500 reports sent, 0 overtaken" in box.close()
    assert [r.position.t_s for r in line.sent if r.position] == [float(k) for k in range(500)]
    assert [r.sequence for r in line.sent] == list(range(1, 501))


def test_a_position_is_known_until_it_is_older_than_an_estimate_can_be() -> None:
    sharp = report(position=replace(POSITION, xx_m2=0.0, xy_m2=0.0, yy_m2=0.0, radius95_m=0.0))
    assert [stamped(sharp, 3, UNIX, age_s, 0).status for age_s in (2.5, 3.5)] == ["uncertain", "lost"]
    settled = stamped(sharp, 3, UNIX, 2.0, 0)
    assert settled.position
    assert settled.place
    assert (settled.status, settled.place.sd_m, settled.last_place) == ("tracking", PLACE.sd_m, None)


@pytest.mark.usefixtures("patient")
def test_a_heartbeat_repeats_the_last_report(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outbox, "HEARTBEAT_S", 0.05)
    line = Recorded()
    box = Outbox(line, "line", print)
    box.offer(report())
    assert until(lambda: len(line.sent) > 3)
    box.close()
    assert [r.sequence for r in line.sent] == list(range(1, len(line.sent) + 1))
    assert line.sent[3].position
    assert line.sent[3].position.age_s > 0.1
    assert box.counts.sent == 1


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
    turned = replace(PLAN, georeference=Georeference(16.0, 48.0, 0.5 * math.pi), uncertainty_m=0.4)
    there = GroundPlane(turned).place(100.0, 0.0, 0.3, 0.0)  # the plan's x points north
    assert there.lat_deg == pytest.approx(48.0 + 100.0 / 111_200.0, abs=1e-6)
    assert there.lon_deg == pytest.approx(16.0, abs=1e-9)
    assert there.course_deg == pytest.approx(0.0, abs=1e-9)
    assert there.sd_m == pytest.approx(0.5)
    west = GroundPlane(turned).place(0.0, 100.0, 0.3, 0.5 * math.pi)
    assert west.lon_deg == pytest.approx(16.0 - 100.0 / 74_630.0, abs=1e-6)
    assert west.course_deg == pytest.approx(270.0)


def test_a_replay_says_that_it_is_one_and_when_it_was_recorded() -> None:
    recorded = "2026-11-21T10:00:00.000Z"
    made = {source: event(report(source=source, recorded=recorded, place=PLACE)) for source in ("replay", "simulated")}
    replayed, simulated = (ElementTree.fromstring(made[source] or b"") for source in ("replay", "simulated"))
    assert (replayed.get("how"), simulated.get("how")) == ("m-r", "m-s")
    assert replayed.get("start") == recorded < str(replayed.get("time"))
    assert f"recorded {recorded}" in (replayed.findtext("detail/remarks") or "")
    assert decode(encode(report(recorded=recorded))).recorded == recorded


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
    expected = {"lat": "48.20000000", "lon": "16.37000000", "hae": "9999999.0", "ce": "0.32", "le": "9999999.0"}
    assert point.attrib == expected
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
        ("mqtts://host?key=x", "key belongs to a certificate"),
        ("mqtts://host?colour=red", "colour"),
        ("cot+udp://me:secret@host", "user"),
        ("ftp://me:secret@host", "ftp|expected"),
        ("cot+tcp://h?name=takserver", "ca, cert, key, password and name are for cot"),
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
