# SPDX-License-Identifier: MIT
"""A mayday on its way: reports, Cursor on Target, the roster and the terminal."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import pytest

from echostep.ports.chunks import Chunk
from echostep.ports.people.check_in import PERSON, Call
from echostep.tracker import Tracker
from echostep_app.team.cot import alarm_words, events
from echostep_app.team.endpoint import Outlet
from echostep_app.team.messages.report import BadReportError, ReportedAlarm, decode, encode
from echostep_app.team.publish import Publishing
from team.cot.test_cot_schema import faults
from team.team_reports import PLACE, report
from walks import PLAN

MAYDAY = ReportedAlarm("mayday", "no motion", 3, 34.0)
OVER = ReportedAlarm("over", "no motion", 3, 2.0)


def test_an_alarm_reads_back_and_hostile_ones_are_refused_by_name() -> None:
    made = report(alarm=MAYDAY)
    assert decode(encode(made)) == made
    for old, new in ((b'"mayday"', b'"party"'), (b'"number":3', b'"number":0'), (b'"age_s":34.0', b'"age_s":-1')):
        with pytest.raises(BadReportError, match="alarm"):
            decode(encode(made).replace(old, new))


def test_a_mayday_is_an_emergency_with_place_floor_radius_and_heading() -> None:
    assert [faults(made) for made in events(report(alarm=MAYDAY))] == [[], []]
    plain, alert = (ElementTree.fromstring(made) for made in events(report(alarm=MAYDAY)))
    assert (plain.get("type"), alert.get("type")) == ("a-f-G-U-C", "b-a-o-tbl")
    assert alert.get("uid") == f"{plain.get('uid')}-9-1-1"
    link, emergency = alert.find("detail/link"), alert.find("detail/emergency")
    assert link is not None
    assert emergency is not None
    assert (link.get("uid"), link.get("relation")) == (plain.get("uid"), "p-p")
    assert (emergency.get("type"), emergency.text) == ("911 Alert", "anna")
    (point,) = alert.iter("point")
    assert (point.get("lat"), point.get("ce")) == (f"{PLACE.lat_deg:.8f}", "0.31")
    words = alert.findtext("detail/remarks") or ""
    assert words.startswith("mayday: no motion for 34 s; ")
    assert "95 % within 0.8 m" in words
    assert "Ground floor" in words
    track = plain.find("detail/track")
    assert track is not None
    assert track.get("course") == "61.4"


def test_its_end_cancels_the_emergency_and_a_question_is_none() -> None:
    _, over = (ElementTree.fromstring(made) for made in events(report(alarm=OVER)))
    assert over.get("type") == "b-a-o-can"
    cancel = over.find("detail/emergency")
    assert cancel is not None
    assert cancel.get("cancel") == "true"
    assert len(events(report(alarm=replace(MAYDAY, kind="asking")))) == 1
    (unplaced,) = map(ElementTree.fromstring, events(report(alarm=MAYDAY, place=None)))
    assert unplaced.get("type") == "b-a-o-tbl"
    unknown = dict.fromkeys(("hae", "ce", "le"), "9999999.0")
    assert unplaced.find("point").attrib == {"lat": "0.0", "lon": "0.0"} | unknown  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("alarm", "words"),
    [
        (MAYDAY, "mayday: no motion for 34 s"),
        (ReportedAlarm("mayday", "help", 1, 5.0), "mayday: asked for help 5 s ago"),
        (ReportedAlarm("mayday", "fall", 1, 14.0), "mayday: fall 14 s ago"),
        (ReportedAlarm("asking", "fall", 1, 4.0), "asked whether all is well: fall 4 s ago"),
        (ReportedAlarm("asking", "no motion", 1, 22.0), "asked whether all is well: no motion for 22 s"),
        (OVER, "mayday over for 2 s"),
    ],
)
def test_an_alarm_in_words(alarm: ReportedAlarm, words: str) -> None:
    assert alarm_words(alarm) == words


def test_a_call_for_help_is_reported_although_no_estimate_comes() -> None:
    tracker = Tracker(PLAN)
    publishing = Publishing(Outlet((), "anna", "red"), tracker, "live", print)
    assert publishing._last.alarm is None
    publishing.publish(tracker.feed(Chunk(PERSON, 0, Call(help=True).encode())))
    assert publishing._last.alarm == ReportedAlarm("mayday", "help", 1, 0.0)
    publishing.publish(tracker.feed(Chunk(PERSON, 0, Call(help=False).encode())))
    assert publishing._last.alarm == ReportedAlarm("over", "help", 1, 0.0)
