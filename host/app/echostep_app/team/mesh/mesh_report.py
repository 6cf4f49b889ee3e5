# SPDX-License-Identifier: MIT
"""A report in few bytes, for radios with little airtime.

In: reports; the plan, of which the receiver has a copy. Out: payloads, and reports again. Owns the layout, little-endian, version 1. What the
receiver can find from its plan (names of floors and rooms, place on Earth) is not sent.
"""

from __future__ import annotations

import math
import struct
from dataclasses import replace

from echostep.particles.ellipse import ellipse95
from echostep.plan import Plan
from echostep_app.plan.places.whereabouts import Whereabouts
from echostep_app.printing.lines import moment
from echostep_app.team.georeference import GroundPlane
from echostep_app.team.messages.report import Motion, Position, Report, ReportedAlarm, printable

VERSION = 1
LATE_AFTER_S = 30.0  # a position is late after three intervals; assumed
HEAD = struct.Struct("<B4s4sdHBB")  # version, run, first bytes of the plan's digest, Unix time, number, flags, battery
BODY = struct.Struct("<iieeeheebBeeHHB")  # as in `_packed`
ALARM = struct.Struct("<BHH")  # kind and reason, number, age in s
KINDS, REASONS = ("asking", "mayday", "over"), ("no motion", "help", "fall")
STATUSES = ("waiting", "tracking", "uncertain", "lost")
SOURCES = ("live", "replay", "simulated")
HAS_POSITION, HAS_ALARM = 0x10, 0x20
NO_HEADING, NO_BATTERY = -32768, 255
MOST_HALF = 60_000.0  # greatest number that is written as a float of 16 bits
MOST_NAMES = 120  # bytes of both names in UTF-8


def pack(report: Report, number: int, unix_s: float) -> bytes:
    """A report as a payload; `number` counts the payloads of this run."""
    flags = STATUSES.index(report.status) | SOURCES.index(report.source) << 2
    flags |= (HAS_POSITION if report.position else 0) | (HAS_ALARM if report.alarm else 0)
    battery = NO_BATTERY if report.battery_percent is None else report.battery_percent
    head = HEAD.pack(
        VERSION,
        bytes.fromhex(report.run),
        bytes.fromhex(report.plan_sha256[:8]),
        unix_s,
        number & 0xFFFF,
        flags,
        battery,
    )
    names = b"".join(bytes([len(part)]) + part for part in (report.team.encode(), report.name.encode()))
    alarm = report.alarm
    packed_alarm = b"" if alarm is None else ALARM.pack(
        KINDS.index(alarm.kind) | REASONS.index(alarm.reason) << 4, alarm.number & 0xFFFF, min(round(alarm.age_s), 0xFFFF)
    )  # fmt: skip
    return head + names + packed_alarm + (_packed(report.position, report.motion) if report.position else b"")


def _packed(p: Position, motion: Motion | None) -> bytes:
    heading = NO_HEADING if p.heading_rad is None else round(1e4 * math.remainder(p.heading_rad, math.tau))
    return BODY.pack(
        round(100.0 * p.x_m), round(100.0 * p.y_m), _half(p.xx_m2), _half(p.xy_m2), _half(p.yy_m2), heading,
        _half(p.heading_sd_rad), math.nan if p.protection_m is None else _half(p.protection_m),
        max(-128, min(p.floor, 127)), round(255.0 * p.floor_probability), _half(p.z_m), _half(p.z_sd_m),
        min(round(10.0 * p.age_s), 0xFFFF), min(round(motion.still_s), 0xFFFF) if motion else 0,
        min(round(10.0 * motion.speed_m_s), 255) if motion else 0,
    )  # fmt: skip


def _half(value: float) -> float:
    return max(-MOST_HALF, min(value, MOST_HALF))


class Unpacker:
    """Makes reports of payloads, with the receiver's plan."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._words = plan, Whereabouts(plan)
        self._ground = GroundPlane(plan) if plan.georeference else None

    def unpack(self, payload: bytes) -> Report:
        """The report of a payload; raises ValueError for what is none."""
        try:
            return self._unpacked(payload)
        except (struct.error, IndexError, OverflowError) as error:
            raise ValueError(f"not a report: {error}") from error

    def _unpacked(self, payload: bytes) -> Report:
        version, run, digest, unix_s, number, flags, battery = HEAD.unpack_from(payload)
        if version != VERSION:
            raise ValueError(f"version {version}, expected {VERSION}")
        if not 0.0 < unix_s < 4e9:
            raise ValueError("its time is not possible")
        team, at = _text(payload, HEAD.size)
        name, at = _text(payload, at)
        same = self._plan.digest.startswith(digest.hex())
        report = Report(
            1, team, name, run.hex(), number, moment(unix_s), moment(unix_s + LATE_AFTER_S), SOURCES[flags >> 2 & 3], STATUSES[flags & 3],  # type: ignore[arg-type]
            None, None, None, None, printable(self._plan.name, 64) if same else "", self._plan.digest if same else digest.hex().ljust(64, "0"),
            "", None if battery == NO_BATTERY else min(battery, 100), 0,
        )  # fmt: skip
        if flags & HAS_ALARM:
            kind, count, age_s = ALARM.unpack_from(payload, at)
            at += ALARM.size
            alarm = ReportedAlarm(KINDS[kind & 15], REASONS[kind >> 4], count, float(age_s))  # type: ignore[arg-type]
            report = replace(report, alarm=alarm)
        return self._placed(report, BODY.unpack_from(payload, at)) if flags & HAS_POSITION else report

    def _placed(self, report: Report, fields: tuple[float, ...]) -> Report:
        """The report with position, motion and place on Earth."""
        x_cm, y_cm, xx, xy, yy, heading, heading_sd, protection, floor, sure, z, z_sd, age, still, speed = fields
        level, x, y, radius = int(floor), x_cm / 100.0, y_cm / 100.0, ellipse95(xx, xy, yy).major_m
        most = math.sqrt(max(xx * yy, 0.0)) * (1.0 - 1e-6)  # rounding must not make it more than a covariance can be
        xy = max(-most, min(xy, most))
        known = 0 <= level < len(self._plan.levels)
        turned = None if heading == NO_HEADING else heading / 1e4
        position = Position(
            t_s=0.0, age_s=age / 10.0, x_m=x, y_m=y, xx_m2=xx, xy_m2=xy, yy_m2=yy, radius95_m=radius,
            heading_rad=turned, heading_sd_rad=heading_sd, floor=level,
            floor_name=printable(self._plan.levels[level].name, 64) if known else "", floor_probability=sure / 255.0,
            z_m=z, z_sd_m=z_sd, where=printable(self._words.words(x, y, level), 100),
            protection_m=None if math.isnan(protection) else protection,
        )  # fmt: skip
        place = self._ground.place(x, y, radius / 2.4477, turned) if self._ground else None
        return replace(report, position=position, motion=Motion(0, 0.0, speed / 10.0, float(still)), place=place)


def _text(payload: bytes, at: int) -> tuple[str, int]:
    """A name and where it ends."""
    end = at + 1 + payload[at]
    if end > len(payload):
        raise ValueError("it ends within a name")
    return payload[at + 1 : end].decode(), end
