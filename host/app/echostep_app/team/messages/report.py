# SPDX-License-Identifier: MIT
"""The report that a tracker sends to its commander, as JSON.

In: a `Report`, or the bytes of a payload from an untrusted sender. Out: the bytes, or the `Report`. Owns nothing. The limits are in
each field; the JSON Schema is generated from them (`schema`), and `decode` rejects values outside them.
"""

from __future__ import annotations

import json
import math
import re
import unicodedata
from dataclasses import dataclass
from datetime import datetime
from functools import lru_cache
from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta

from echostep.errors import EchostepError
from echostep.fields import LIMIT_M, field_of
from echostep.ports.people.payloads import is_covariance

MAX_PAYLOAD = 8192  # bytes; a report has about 900
WITHOUT_PLAN = 64 * "0"  # the SHA-256 of no file: the wearer is tracked without a plan, in a frame of its own


def between(least: float, most: float, words: str) -> Meta:
    """The limits of a number, both included, and its meaning."""
    return Meta(ge=least, le=most, description=words)


Metres = Annotated[float, between(-LIMIT_M, LIMIT_M, "m, on the plan (x east, y north)")]
Name = Annotated[
    str, Meta(min_length=1, max_length=32, pattern="^[^/+#]*$", description="printable characters, no / + #")
]
Moment = Annotated[str, Meta(min_length=20, max_length=32, description="UTC, RFC 3339, by the tracker's clock")]
Heading = Annotated[float, between(-7.0, 7.0, "rad counter-clockwise from x")]


class BadReportError(ValueError):
    """A payload that is not a valid report; the text is the reason in a few words."""


@dataclass(frozen=True, slots=True)
class Position:
    """Where the wearer is on the plan."""

    t_s: Annotated[float, between(-1e9, 1e12, "the tracker's own clock at the estimate, s")]
    age_s: Annotated[
        float,
        between(
            0.0, 1e9, "seconds since the estimate was made; the covariance has grown by as many seconds of walking"
        ),
    ]
    x_m: Metres
    y_m: Metres
    xx_m2: Annotated[float, between(0.0, 1e12, "covariance of x and x, m2")]
    xy_m2: Annotated[float, between(-1e12, 1e12, "covariance of x and y, m2")]
    yy_m2: Annotated[float, between(0.0, 1e12, "covariance of y and y, m2")]
    radius95_m: Annotated[float, between(0.0, 1e7, "longer half axis of the 95 % ellipse, m")]
    heading_rad: Heading | None
    heading_sd_rad: Annotated[float, between(0.0, 100.0, "standard deviation, rad")]
    floor: Annotated[int, between(-1000, 1000, "index of the level in the plan")]
    floor_name: Annotated[str, Meta(max_length=64, description="name of the level")]
    floor_probability: Annotated[float, between(0.0, 1.0, "probability that the wearer is on this floor")]
    z_m: Annotated[float, between(-LIMIT_M, LIMIT_M, "height of the floor under the wearer, on the plan's scale, m")]
    z_sd_m: Annotated[float, between(0.0, LIMIT_M, "standard deviation of z_m, m")]
    where: Annotated[
        str, Meta(max_length=100, description="the room or the corridor, in words; empty where the plan names none")
    ] = ""
    protection_m: Annotated[
        Annotated[float, Meta(ge=0.0, le=1e7)] | None,
        Meta(description="radius beyond which the error is at a risk of 1 in 1,000, m; missing where no radius is"),
    ] = None


@dataclass(frozen=True, slots=True)
class Motion:
    """How the wearer moves."""

    steps: Annotated[int, between(0, 2**53, "steps of the foot that carries the MTx")]
    walked_m: Annotated[float, between(0.0, 1e9, "length of the track so far, m")]
    speed_m_s: Annotated[float, between(0.0, 100.0, "over the last seconds, m/s")]
    still_s: Annotated[float, between(0.0, 1e9, "seconds since the last step")]


@dataclass(frozen=True, slots=True)
class ReportedPlace:
    """Position on Earth, when the plan has a georeference."""

    lat_deg: Annotated[float, between(-90.0, 90.0, "WGS 84")]
    lon_deg: Annotated[float, between(-180.0, 180.0, "WGS 84")]
    hae_m: Annotated[float, between(-1e4, 1e5, "height over the ellipsoid, m")] | None
    sd_m: Annotated[float, between(0.0, 1e7, "standard deviation along the worst direction, georeference included, m")]
    hae_sd_m: Annotated[float, between(0.0, 1e7, "standard deviation of hae_m, m")] | None
    course_deg: Annotated[float, between(0.0, 360.0, "heading, clockwise from true north")] | None


@dataclass(frozen=True, slots=True)
class StreamReport:
    """Health of the sensors' streams."""

    mtx_hz: Annotated[float, between(0.0, 1e6, "samples of the MTx per second")]
    board_hz: Annotated[float, between(0.0, 1e6, "messages of the sensor board per second")]
    bad: Annotated[int, between(0, 2**53, "frames that failed a check, both ports, since the start")]
    lost: Annotated[int, between(0, 2**53, "frames that were sent but not received, both ports, since the start")]
    dropped: Annotated[int, between(0, 2**53, "messages that the board dropped because its buffer was full")]
    synchronised: Annotated[bool, Meta(description="the MTx is timed by its SyncOut wire")]
    findings: Annotated[
        tuple[Annotated[str, Meta(max_length=100)], ...],
        Meta(max_length=4, description="faults of the sensors, the worst first"),
    ]


@dataclass(frozen=True, slots=True)
class ReportedAlarm:
    """The wearer's alarm."""

    kind: Annotated[
        Literal["asking", "mayday", "over"],
        Meta(
            description="asking: still for 20 s, or fallen, the wearer is asked; mayday: help is needed; over: it was, for 30 s"
        ),
    ]
    reason: Annotated[
        Literal["no motion", "fall", "help"],
        Meta(description="fall: an impact, then lying; help: the wearer asked for it"),
    ]
    number: Annotated[int, between(1, 2**53, "counts the alarms of this run")]
    age_s: Annotated[float, between(0.0, 1e9, "seconds since the last motion, the fall, the call for help, or the end")]


@dataclass(frozen=True, slots=True)
class Report:
    """The whole report; `position` is missing until the tracker has its first estimate, and while it is lost."""

    echostep_report: Annotated[Literal[1], Meta(description="version of this form")]
    team: Name
    name: Name
    run: Annotated[str, Meta(pattern="^[0-9a-f]{8}$", description="one run of one tracker; another run, another one")]
    sequence: Annotated[int, between(0, 2**53, "counts the reports made in this run")]
    time: Annotated[Moment, Meta(description="when it was sent: UTC, RFC 3339, by the tracker's clock")]
    stale: Annotated[Moment, Meta(description="until when it holds, by the same clock")]
    source: Annotated[Literal["live", "replay", "simulated"], Meta(description="where the bytes come from")]
    status: Annotated[
        Literal["waiting", "tracking", "uncertain", "lost"],
        Meta(
            description="waiting: no estimate; tracking: error below 1 m at 95 %; lost: above 5 m at 50 %, or silent sensors; uncertain: between"
        ),
    ]
    position: Annotated[Position | None, Meta(description="missing while waiting and while lost")]
    motion: Annotated[Motion | None, Meta(description="missing while waiting")]
    place: Annotated[ReportedPlace | None, Meta(description="missing without a georeference")]
    streams: Annotated[StreamReport | None, Meta(description="missing until something is heard")]
    plan: Annotated[str, Meta(max_length=64, description="name of the plan that the wearer is tracked on")]
    plan_sha256: Annotated[
        str, Meta(pattern="^[0-9a-f]{64}$", description="SHA-256 of the plan's file; zeros without a plan")
    ]
    version: Annotated[str, Meta(max_length=32, description="version of echostep on the tracker")]
    battery_percent: Annotated[int, between(0, 100, "charge of the tracker's computer")] | None
    superseded: Annotated[int, between(0, 2**53, "reports that a newer one overtook before they could be sent")]
    recorded: Annotated[
        Moment | None, Meta(description="when the position was recorded, in a replay: UTC, by the recorder's clock")
    ] = None
    alarm: Annotated[ReportedAlarm | None, Meta(description="missing while all is well")] = None
    trunk_tilt_deg: Annotated[
        Annotated[float, Meta(ge=0.0, le=180.0)] | None,
        Meta(
            description="angle of the trunk to its direction while walking; missing where the belt has no accelerometer"
        ),
    ] = None
    last_place: Annotated[
        Position | None,
        Meta(description="while lost: the last position that was known, with its age; missing where there was none"),
    ] = None

    @property
    def last_known(self) -> Position | None:
        """The position; while lost, the last known one."""
        return self.position or self.last_place

    @property
    def sent_s(self) -> float:
        """Unix time of `time`."""
        return _unix(self.time)

    @property
    def stale_after_s(self) -> float:
        """How long the report holds."""
        return _unix(self.stale) - _unix(self.time)


@dataclass(frozen=True, slots=True)
class Presence:
    """The retained message besides the reports: the tracker is online, has ended, or its connection broke (last will at the broker)."""

    echostep_presence: Literal[1]
    run: Annotated[str, Meta(pattern="^[0-9a-f]{8}$")]
    presence: Literal["online", "ended", "broken"]


T = TypeVar("T")
_REPORTS, _PRESENCES = msgspec.json.Decoder(Report), msgspec.json.Decoder(Presence)


def encode(report: Report | Presence) -> bytes:
    """The payload, JSON in UTF-8."""
    return msgspec.json.encode(report)


def decode(payload: bytes) -> Report:
    """Decode a payload; raises BadReportError and no other exception, for any bytes."""
    report = decode_as(payload, _REPORTS)
    check_name(report.team)
    check_name(report.name)
    if not 0.0 <= report.stale_after_s <= 86_400.0:
        raise BadReportError("stale is not within a day after time")
    p, findings = report.position, report.streams.findings if report.streams else ()
    if report.status != "lost" and (p is None) != (report.status == "waiting"):
        raise BadReportError("status and position contradict each other")
    if report.status != "lost" and report.last_place is not None:
        raise BadReportError("status and last place contradict each other")
    texts = [report.plan, report.version, *findings]
    for q in (p, report.last_place):
        if q is not None and not is_covariance(q.xx_m2, q.xy_m2, q.yy_m2):
            raise BadReportError("position: not a covariance")
        texts += [q.floor_name, q.where] if q else []
    for text in texts:
        if not is_printable(text):
            raise BadReportError("unprintable text")
    return report


def decode_presence(payload: bytes) -> Presence:
    """As `decode`, for a presence message."""
    return decode_as(payload, _PRESENCES)


def decode_as(payload: bytes, decoder: msgspec.json.Decoder[T]) -> T:
    """The message in a payload; raises BadReportError that names the wrong field, without text of the sender, which may control a terminal."""
    if len(payload) > MAX_PAYLOAD:
        raise BadReportError("too long")
    try:
        return decoder.decode(payload)
    except UnicodeDecodeError as error:
        raise BadReportError("not UTF-8") from error
    except msgspec.ValidationError as error:
        path, is_missing = field_of(error)
        name = re.sub(r"\[\d+\]", "", path)  # as many sentences as fields
        raise BadReportError(
            f"no field `{name}`" if is_missing else f"wrong field {name}" if name else "not a report"
        ) from error
    except (msgspec.DecodeError, RecursionError) as error:
        raise BadReportError("not JSON") from error


def check_name(text: str) -> None:
    """Raises BadReportError when a name is not safe in an MQTT topic or on a terminal."""
    if not 1 <= len(text) <= 32 or text != text.strip() or not is_printable(text) or any(c in "/+#" for c in text):
        raise BadReportError("a name has 1 to 32 printable characters, none of them / + #")


def checked_name(option: str, text: str) -> str:
    """A valid name from a command-line option; raises EchostepError."""
    try:
        check_name(text)
    except BadReportError as error:
        raise EchostepError(f"{option} {text!r}: {error}") from error
    return text


def printable(text: str, most: int) -> str:
    """A text cut to `most` characters, with unprintable ones replaced by spaces."""
    return "".join(c if is_printable(c) else " " for c in text[:most])


def is_printable(text: str) -> bool:
    """Whether a text has no control or format characters, line separators or lone surrogates."""
    if text.isascii():
        return text.isprintable()  # the same, and fast: most texts are ASCII
    return all(unicodedata.category(c) not in ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp") for c in text)


# Each member's last report is asked several times at each look; two times a report, 256 members
@lru_cache(maxsize=4096)
def _unix(text: str) -> float:
    try:
        seconds = datetime.fromisoformat(text)
        unix_s = seconds.timestamp() if seconds.tzinfo else math.nan
    except (ValueError, OverflowError) as error:
        raise BadReportError("not a time") from error
    if not -1e10 < unix_s < 1e11:
        raise BadReportError("not a time in UTC")
    return unix_s


def schema() -> str:
    """JSON Schema (2020-12) of a report, as text."""
    made = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "echostep report"}
    return json.dumps(made | msgspec.json.schema(Report), indent=2) + "\n"
