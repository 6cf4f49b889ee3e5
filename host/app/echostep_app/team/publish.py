# SPDX-License-Identifier: MIT
"""Publishing: a tracker's estimates as reports, to each endpoint of `--publish`.

In: estimates, in the tracker's thread. Out: reports, to one outbox per endpoint. Owns the outboxes, and the history that steps, distance walked and
rates are computed from.
"""

from __future__ import annotations

import importlib.metadata
import math
import secrets
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import numpy as np

from echostep.errors import EchostepError
from echostep.localization import Estimate, TrackStatus
from echostep.odometry import WearerWatch
from echostep.particles.ellipse import CHI2_95
from echostep.path import Odometer
from echostep.plan import Level, Plan
from echostep.tracker import Tracker
from echostep_app.board.faults.health import all_findings
from echostep_app.plan.georeference import EarthTransform
from echostep_app.plan.places.bearing import KNOWN_HEADING_RAD
from echostep_app.plan.places.whereabouts import Whereabouts
from echostep_app.printing.lines import moment
from echostep_app.team.age import aged, no_better
from echostep_app.team.cot import StreamTransport, UdpTransport
from echostep_app.team.endpoint import BROKERS, Endpoint, Outlet
from echostep_app.team.messages.report import (
    WITHOUT_PLAN,
    Motion,
    Position,
    Report,
    ReportedAlarm,
    ReportedPlace,
    StreamReport,
    printable,
)
from echostep_app.team.outbox import HEARTBEAT_S, Delivery, Outbox, Transport
from echostep_app.wearer.alarm import watch_of
from echostep_app.wearer.steady_status import SteadyStatus

Source = Literal["live", "replay", "simulated"]
AVERAGING_S = 3.0  # of speed and rates
MIN_SPEED_SPAN_S = 0.5  # a speed over less time is reported as 0
MAX_PROTECTION_M = 100.0  # a larger protection radius is not reported: it says no more than none
POWER_SUPPLIES = Path("/sys/class/power_supply")


class Publishing:
    """`publish` offers new estimates to all outboxes; leaving the context sends the last ones and prints the counts."""

    def __init__(
        self,
        outlet: Outlet,
        tracker: Tracker,
        source: Source,
        print_line: Callable[[str], None],
        recorded: Callable[[int], float] | None = None,
    ) -> None:
        """`recorded`: arrival time in ns -> Unix time of a recording that is replayed."""
        self._recorded = recorded
        self._tracker, self._print_line = tracker, print_line
        self._watch, self._steady = watch_of(tracker), SteadyStatus()
        self._history, self._levels = ReportHistory(), tracker.plan.levels
        self._history_before_estimate, self._offered_s = ReportHistory(), time.monotonic()
        self.run = run = secrets.token_hex(4)
        self._empty = empty_report(tracker.plan, outlet.name, outlet.team, run, source)
        self._ground = GroundPlane(tracker.plan) if tracker.plan.georeference else None
        self._whereabouts = Whereabouts(tracker.plan)
        transports = [(_transport(e, tracker.plan, outlet, run), str(e)) for e in outlet.endpoints]
        self._outboxes = [Outbox(transport, name, print_line) for transport, name in transports]
        self._last = self._empty
        self._known: Position | None = None  # the last position that was a place
        self._offer(self._empty)

    def publish(self, estimates: Sequence[Estimate]) -> None:
        """Offer a report of each estimate to the outboxes; never blocks. Without estimates, heartbeats before the first one."""
        alarm = reported_alarm(self._watch, self._tracker.front_end.newest_s)
        if not estimates:
            told = self._last.alarm
            if (alarm and (alarm.kind, alarm.number)) != (told and (told.kind, told.number)):
                self._offer(replace(self._last, alarm=alarm))  # with the last position
            self._offer_heartbeat(time.monotonic())
            return
        self._offered_s = math.inf
        streams = self._history.streams(self._tracker, estimates[0].t_s)
        for estimate in (self._steady.shown(each, self._tracker) for each in estimates):
            where = printable(self._whereabouts.words(estimate.x_m, estimate.y_m, estimate.level), 100)
            motion = self._history.motion(estimate)
            report = report_of(self._empty, self._levels, self._ground, estimate, motion, streams)
            assert report.position
            report = replace(report, position=replace(report.position, where=where))
            if estimate.claims_place:
                self._known = report.position
            else:
                last = self._known and aged(self._known, max(estimate.t_s - self._known.t_s, 0.0))
                report = no_better(replace(report, position=None, last_place=last), "lost")
            tilt_rad = self._watch.trunk_tilt_rad(self._tracker.front_end.newest_s)  # NaN without a sensor
            tilt_deg = None if math.isnan(tilt_rad) else float(round(math.degrees(tilt_rad)))
            recorded = self._recorded_at(estimate.t_s)
            self._offer(replace(report, recorded=recorded, alarm=alarm, trunk_tilt_deg=tilt_deg))

    @property
    def fault(self) -> str:
        """Why reports do not go out at present, in a sentence for each endpoint that fails; empty while they do. Its address is in the lines."""
        return "; ".join(f"{box.name.partition(':')[0]}: {box.fault}" for box in self._outboxes if box.fault)

    def receipt(self, number: int) -> str:
        """State of delivery of the mayday with this number, in a sentence."""
        kinds = [
            delivery for box in self._outboxes if box.delivered
            for alarm, delivery in (box.delivered,) if (alarm.kind, alarm.number) == ("mayday", number)
        ]  # fmt: skip
        if Delivery.ACKNOWLEDGED in kinds:
            return "The team's broker has it; no commander has answered yet."
        if kinds:
            return "It was sent; whether it has arrived is not known."
        return f"It has not gone out: {self.fault}." if self.fault else "It is being sent."

    def _recorded_at(self, t_s: float) -> str | None:
        """When an estimate was recorded; None in a live run, and where the recording has no time of day."""
        if self._recorded is None:
            return None
        try:
            return moment(self._recorded(self._tracker.arrival_ns(t_s)))
        except (ValueError, OverflowError, OSError):  # damaged times
            return None

    def _offer_heartbeat(self, now_s: float) -> None:
        """Before the first estimate, report the streams every HEARTBEAT_S."""
        if now_s - self._offered_s >= HEARTBEAT_S:
            self._offered_s = now_s
            streams = self._history_before_estimate.streams(self._tracker, now_s)
            self._offer(replace(self._empty, alarm=self._last.alarm, streams=streams))

    def end(self) -> None:
        """The run is over: the last reports go out, and receivers are told; returns at once. What does not go out is tried on."""
        for outbox in self._outboxes:
            if not outbox.fault:
                outbox.begin_close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()
        for outbox in self._outboxes:
            self._print_line(outbox.close())

    def _offer(self, report: Report) -> None:
        last, alarm = self._last.alarm, report.alarm
        if alarm and alarm.kind == "mayday" and (last is None or last.kind != "mayday") and self.fault:
            self._print_line(f"MAYDAY has not gone out: {self.fault}")
        self._last = report
        for outbox in self._outboxes:
            outbox.offer(report)


class ReportHistory:
    """What depends on several estimates: distance walked, speed, rates of the streams."""

    def __init__(self) -> None:
        self._last: Estimate | None = None
        self._odometer = Odometer()
        self._last_step_s = math.nan
        self._recent: deque[tuple[float, float]] = deque()  # t_s, mark on the path
        self._counts: deque[tuple[float, int, int]] = deque()  # t_s, samples, frames

    def motion(self, e: Estimate) -> Motion:
        """Steps, distance, speed and time at rest up to this estimate."""
        last, self._last = self._last, e
        if last is None or e.step != last.step:
            self._last_step_s = e.t_s
            self._odometer.add(0.0 if last is None else math.hypot(e.x_m - last.x_m, e.y_m - last.y_m))
        self._recent.append((e.t_s, self._odometer.path_m))
        while self._recent[0][0] < e.t_s - AVERAGING_S:
            self._recent.popleft()
        span_s, distance_m = e.t_s - self._recent[0][0], self._odometer.since_m(self._recent[0][1])
        speed = min(distance_m / span_s, 100.0) if span_s > MIN_SPEED_SPAN_S else 0.0
        return Motion(max(e.step, 0), min(self._odometer.path_m, 1e9), speed, max(e.t_s - self._last_step_s, 0.0))

    def streams(self, tracker: Tracker, t_s: float) -> StreamReport:
        """Health of the input streams; rates over AVERAGING_S of the clock of `t_s`."""
        state = tracker.streams
        board, mtx = state.board, state.mtx
        counts = (t_s, mtx.good, board.good)
        self._counts.append(counts)
        while len(self._counts) > 2 and self._counts[1][0] < t_s - AVERAGING_S:
            self._counts.popleft()
        span_s = t_s - self._counts[0][0]
        mtx_hz, board_hz = ((counts[k] - self._counts[0][k]) / span_s if span_s > 0.0 else 0.0 for k in (1, 2))
        return StreamReport(
            mtx_hz=min(mtx_hz, 1e6),
            board_hz=min(board_hz, 1e6),
            bad=board.rejected + mtx.bad_checksum + mtx.bad_length + mtx.incomplete,
            lost=board.lost + mtx.lost,
            dropped=state.reports.dropped,
            synchronised=state.synchronised,
            findings=tuple(
                printable(f"{f.subject} {f.what}", 100) for f in all_findings(state.reports, state.foot_reports)[:4]
            ),
        )


def reported_alarm(watch: WearerWatch, now_s: float) -> ReportedAlarm | None:
    """The wearer's alarm as it is reported."""
    alarm = watch.alarm
    if alarm is None:
        return None
    age_s = now_s - alarm.since_s
    age_s = min(age_s, 1e9) if age_s > 0.0 else 0.0  # NaN before the first samples
    return ReportedAlarm(alarm.kind.value, alarm.reason.value, alarm.number, age_s)


def empty_report(plan: Plan, name: str, team: str, run: str, source: Source) -> Report:
    """The report of a tracker without an estimate; number and times are set when it is sent."""
    return Report(
        echostep_report=1, team=team, name=name, run=run, sequence=0, time="", stale="", source=source, status="waiting",
        position=None, motion=None, place=None, streams=None, plan=printable(plan.name, 64),
        plan_sha256=plan.digest or WITHOUT_PLAN, version=importlib.metadata.version("echostep")[:32],
        battery_percent=battery_percent(), superseded=0,
    )  # fmt: skip


def report_of(
    empty: Report,
    levels: Sequence[Level],
    ground: GroundPlane | None,
    e: Estimate,
    motion: Motion,
    streams: StreamReport,
) -> Report:
    """The report of an estimate: the `empty` report with position, motion, streams and position on Earth."""
    position = position_of(levels, e)
    sd_m = position.radius95_m / math.sqrt(CHI2_95)
    place = ground.place(e.x_m, e.y_m, sd_m, position.heading_rad) if ground else None
    return replace(empty, status=e.status.value, position=position, motion=motion, place=place, streams=streams)


def position_of(levels: Sequence[Level], e: Estimate) -> Position:
    """The position of an estimate as it is reported."""
    return Position(
        t_s=e.t_s, age_s=0.0, x_m=e.x_m, y_m=e.y_m, xx_m2=e.xx_m2, xy_m2=e.xy_m2, yy_m2=e.yy_m2,
        radius95_m=e.ellipse95.major_m, heading_rad=e.heading_rad if e.heading_sd_rad <= KNOWN_HEADING_RAD else None,
        heading_sd_rad=min(e.heading_sd_rad, 100.0), floor=e.level, floor_name=printable(levels[e.level].name, 64),
        floor_probability=min(max(e.levels[e.level], 0.0), 1.0), z_m=e.z_m, z_sd_m=e.z_sd_m,
        protection_m=e.protection_m if e.protection_m <= MAX_PROTECTION_M and e.status is not TrackStatus.LOST else None,
    )  # fmt: skip


def battery_percent() -> int | None:
    """Charge of this computer's battery, in percent; None without a battery."""
    for path in sorted(POWER_SUPPLIES.glob("BAT*/capacity")):
        try:
            return max(0, min(100, int(path.read_text())))
        except (OSError, ValueError):
            continue
    return None


def _transport(endpoint: Endpoint, plan: Plan, outlet: Outlet, run: str) -> Transport:
    if endpoint.scheme in BROKERS:
        from echostep_app.team.mqtt.publisher import MqttTransport

        return MqttTransport(endpoint, outlet.team, outlet.name, run)
    if plan.georeference is None:
        raise EchostepError(
            f"{endpoint}: TAK needs latitude and longitude, and the plan has no georeference: add one to the plan, or use mqtt://"
        )
    return UdpTransport(endpoint) if endpoint.scheme == "cot+udp" else StreamTransport(endpoint)


class GroundPlane:
    """Transforms positions on a georeferenced plan to WGS 84."""

    def __init__(self, plan: Plan) -> None:
        """Raises ValueError when the plan has no georeference that can be used."""
        if plan.georeference is None:
            raise ValueError("the plan has no georeference")
        self._rotation_rad = plan.georeference.rotation_rad
        self._uncertainty_m = plan.uncertainty_m or 0.0
        self._earth = EarthTransform(plan.georeference)

    def place(self, x_m: float, y_m: float, sd_m: float, heading_rad: float | None) -> ReportedPlace:
        """A position on the plan, on Earth.

        `sd_m` is combined with the plan's uncertainty. The height stays unknown: a plan's heights do not refer to the ellipsoid.
        """
        ((lon, lat),) = self._earth.degrees(np.array([[x_m, y_m]]))
        course = None if heading_rad is None else (90.0 - math.degrees(heading_rad + self._rotation_rad)) % 360.0
        return ReportedPlace(float(lat), float(lon), None, math.hypot(sd_m, self._uncertainty_m), None, course)
