# SPDX-License-Identifier: MIT
"""Every event that a report can become is valid by what the public schema of Cursor on Target demands, written down as facts."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import datetime
from decimal import Decimal, InvalidOperation
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from echostep_app.team.cot import HOW, event
from echostep_app.team.messages.report import Report, ReportedPlace
from team.team_reports import report

REQUIRED = ("version", "type", "uid", "time", "start", "stale", "how")
OPTIONAL = ("access", "qos", "opex")
PATTERNS = {"type": r"\w+(-\w+)*(;[^;]*)?", "how": r"\w(-\w+)*", "qos": r"\d-\w-\w"}
HOW_MACHINE = {
    "m-i": "mensurated", "m-g": "GPS", "m-m": "magnetic", "m-s": "simulated", "m-f": "fused", "m-c": "configured",
    "m-p": "predicted", "m-r": "relayed",
}  # fmt: skip

POINT = {"lat": (Decimal(-90), Decimal(90)), "lon": (Decimal(-180), Decimal(180)), "hae": None, "ce": None, "le": None}
DATE_TIME = r"-?\d{4,}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)?"  # xs:dateTime


def faults(event: bytes) -> list[str]:
    """Everything in which an event differs from the schema; empty when it is valid."""
    top = ElementTree.fromstring(event)
    found = [] if top.tag == "event" else [f"the root is {top.tag}"]
    found += [f"no {name}" for name in REQUIRED if name not in top.attrib]
    found += [f"unknown attribute {name}" for name in top.attrib if name not in (*REQUIRED, *OPTIONAL)]
    for name, pattern in PATTERNS.items():
        if name in top.attrib and not re.fullmatch(pattern, top.attrib[name]):
            found.append(f"{name} is {top.attrib[name]!r}")
    found += [f"{name} is {top.get(name)!r}" for name in ("time", "start", "stale") if not _is_time(top.get(name, ""))]
    if _decimal(top.get("version", "")) is None or Decimal(top.get("version", "0")) < 2:
        found.append(f"version is {top.get('version')!r}")
    children = [child.tag for child in top]
    if children.count("point") != 1 or children.count("detail") > 1 or set(children) - {"point", "detail"}:
        found.append(f"children are {children}")
    for point in top.iter("point"):
        found += _point_faults(point)
    return found


def _point_faults(point: ElementTree.Element) -> list[str]:
    found = [f"unknown attribute {name} of point" for name in point.attrib if name not in POINT]
    for name, limits in POINT.items():
        value = _decimal(point.get(name, ""))
        if value is None or (limits and not limits[0] <= value <= limits[1]):
            found.append(f"{name} is {point.get(name)!r}")
    return found


def _decimal(text: str) -> Decimal | None:
    """xs:decimal: digits and a point, without exponent, infinity and NaN."""
    try:
        return Decimal(text) if re.fullmatch(r"[+-]?(\d+(\.\d*)?|\.\d+)", text) else None
    except InvalidOperation:
        return None


def _is_time(text: str) -> bool:
    if not re.fullmatch(DATE_TIME, text):
        return False
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return False
    return True


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
    assert all(0.0 <= float(t.get("course", "")) < 360.0 for t in ElementTree.fromstring(made(told)).iter("track"))


@pytest.mark.parametrize(("source", "meaning"), [("live", "fused"), ("replay", "relayed"), ("simulated", "simulated")])
def test_how_says_what_the_schema_says(source: str, meaning: str) -> None:
    assert HOW_MACHINE[HOW[source]] == meaning
