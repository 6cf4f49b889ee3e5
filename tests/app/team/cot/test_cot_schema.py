# SPDX-License-Identifier: MIT
"""Every event that a report can become is valid by the public schema."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep_app.team.cot import HOW, event
from echostep_app.team.messages.report import Report, ReportedPlace
from team.cot_schema import HOW_MACHINE, faults
from team.team_reports import report

NAMES = st.text(st.characters(exclude_categories=("C", "Z"), exclude_characters="/+#"), min_size=1, max_size=32)


def made(source: Report) -> bytes:
    found = event(source)
    assert found is not None
    return found


@given(
    name=NAMES, team=NAMES, lat=st.floats(-90, 90), lon=st.floats(-180, 180), sd_m=st.floats(0, 1e7),
    hae_m=st.none() | st.floats(-10_000, 100_000), course=st.none() | st.floats(0, 360),
    source=st.sampled_from(sorted(HOW)),
)  # fmt: skip
def test_every_report_makes_a_valid_event(
    name: str, team: str, lat: float, lon: float, sd_m: float, hae_m: float | None, course: float | None, source: str
) -> None:
    place = ReportedPlace(lat, lon, hae_m, sd_m, None if hae_m is None else 2.0, course)
    told = replace(report(), place=place, name=name, team=team, source=source)  # type: ignore[arg-type]
    assert faults(made(told)) == []


@pytest.mark.parametrize(("source", "meaning"), [("live", "fused"), ("replay", "relayed"), ("simulated", "simulated")])
def test_how_says_what_the_schema_says(source: str, meaning: str) -> None:
    assert HOW_MACHINE[HOW[source]] == meaning


WRONG = {
    "version": "1.0", "type": "a f", "how": "machine", "time": "noon", "stale": "2026-13-01T00:00:00Z", "qos": "high",
    "colour": "red",
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_attribute_is_found(name: str) -> None:
    top = ElementTree.fromstring(made(report()))
    top.set(name, WRONG[name])
    assert len(faults(ElementTree.tostring(top))) == 1


@pytest.mark.parametrize(("name", "value"), [("lat", "90.1"), ("lon", "nan"), ("ce", "1e-3"), ("hae", "")])
def test_a_wrong_point_is_found(name: str, value: str) -> None:
    top = ElementTree.fromstring(made(report()))
    top[0].set(name, value)
    assert faults(ElementTree.tostring(top)) == [f"{name} is {value!r}"]


def test_a_missing_or_doubled_part_is_found() -> None:
    top = ElementTree.fromstring(made(report()))
    del top.attrib["uid"]
    top.append(top[0])
    assert faults(ElementTree.tostring(top)) == ["no uid", "children are ['point', 'detail', 'point']"]
