"""Publishing: a tracker's estimates -> reports -> every endpoint that was asked for.

In: estimates, in the tracker's thread. Out: reports offered to one outbox an endpoint. Owns the outboxes and the facts that need a memory: steps,
distance walked, rates.
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

from echostep.board.health import board_findings
from echostep.errors import EchostepError
from echostep.localization.estimate import CHI2_95, Estimate
from echostep.plan.model import Level, Plan
from echostep.team.cot import StreamLine, UdpLine
from echostep.team.endpoint import Endpoint, Outlet
from echostep.team.georeference import GroundPlane
from echostep.team.mqtt import MqttLine
from echostep.team.outbox import HEARTBEAT_S, Line, Outbox
from echostep.team.report import Motion, Position, Report, StreamReport, printable
from echostep.tracker import Tracker

Source = Literal["live", "replay", "simulated"]
PACE_S = 3.0  # speed and rates are taken over so long
UNKNOWN_RAD = 1.0  # a heading with a larger standard deviation is not told
SUPPLIES = Path("/sys/class/power_supply")


class Publishing:
    """`tell` the estimates as they come; leaving the context sends what is fresh and says how it went."""

    def __init__(self, outlet: Outlet, tracker: Tracker, source: Source, say: Callable[[str], None]) -> None:
        self._tracker, self._say = tracker, say
        self._trail, self._levels = PublishedTrail(), tracker.plan.levels
        self._before, self._told_s = PublishedTrail(), time.monotonic()  # the first estimate
        run = secrets.token_hex(4)
        self._blank = blank(tracker.plan, outlet.name, outlet.team, run, source)
        self._ground = GroundPlane(tracker.plan) if tracker.plan.georeference else None
        lines = [(_line(e, tracker.plan, outlet, run), str(e)) for e in outlet.endpoints]
        self._outboxes = [Outbox(line, name, say) for line, name in lines]
        self._offer(self._blank)

    def tell(self, estimates: Sequence[Estimate]) -> None:
        """Offer a report of each estimate; takes microseconds and never waits."""
        if not estimates:
            self._still_waiting(time.monotonic())
            return
        self._told_s = math.inf
        streams = self._trail.streams(self._tracker, estimates[0].t_s)
        for estimate in estimates:
            self._offer(
                report(self._blank, self._levels, self._ground, estimate, self._trail.motion(estimate), streams)
            )

    def _still_waiting(self, now_s: float) -> None:
        """Before the first estimate, tell now and then how the streams are."""
        if now_s - self._told_s >= HEARTBEAT_S:
            self._told_s = now_s
            self._offer(replace(self._blank, streams=self._before.streams(self._tracker, now_s)))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        for outbox in self._outboxes:
            outbox.end()
        for outbox in self._outboxes:
            self._say(outbox.close())

    def _offer(self, made: Report) -> None:
        for outbox in self._outboxes:
            outbox.offer(made)


class PublishedTrail:
    """What one estimate does not tell: steps and way so far, rates of the streams."""

    def __init__(self) -> None:
        self._last: Estimate | None = None
        self._walked_m = 0.0
        self._stepped_s = math.nan
        self._recent: deque[tuple[float, float]] = deque()  # t_s, walked_m
        self._counts: deque[tuple[float, int, int]] = deque()  # t_s, samples, frames

    def motion(self, e: Estimate) -> Motion:
        """How the wearer has moved until this estimate."""
        last, self._last = self._last, e
        if last is None or e.step != last.step:
            self._stepped_s = e.t_s
            self._walked_m += 0.0 if last is None else math.hypot(e.x_m - last.x_m, e.y_m - last.y_m)
        self._recent.append((e.t_s, self._walked_m))
        while self._recent[0][0] < e.t_s - PACE_S:
            self._recent.popleft()
        span_s, way_m = e.t_s - self._recent[0][0], self._walked_m - self._recent[0][1]
        speed = min(way_m / span_s, 100.0) if span_s > 0.5 else 0.0
        return Motion(max(e.step, 0), min(self._walked_m, 1e9), speed, max(e.t_s - self._stepped_s, 0.0))

    def streams(self, tracker: Tracker, t_s: float) -> StreamReport:
        """Health of the streams; rates by the tracker's clock."""
        intake = tracker.intake
        board, mtx, status = intake.board.counts, intake.mtx.counts, intake.status
        counts = (t_s, mtx.good, board.good)
        self._counts.append(counts)
        while len(self._counts) > 2 and self._counts[1][0] < t_s - PACE_S:
            self._counts.popleft()
        span_s = t_s - self._counts[0][0]
        mtx_hz, board_hz = ((counts[k] - self._counts[0][k]) / span_s if span_s > 0.0 else 0.0 for k in (1, 2))
        return StreamReport(
            mtx_hz=min(mtx_hz, 1e6),
            board_hz=min(board_hz, 1e6),
            bad=board.rejected + mtx.bad_checksum + mtx.bad_length + mtx.incomplete,
            lost=board.lost + mtx.lost,
            dropped=0 if status is None else sum(v for k, v in status._asdict().items() if k.startswith("dropped_")),
            synchronised=bool(intake.timeline.synchronised),
            findings=tuple(printable(f"{f.subject} {f.what}", 100) for f in board_findings(intake.words)[:4]),
        )


def blank(plan: Plan, name: str, team: str, run: str, source: Source) -> Report:
    """The report of a tracker that has no estimate yet; number and times are stamped when it is sent."""
    return Report(
        echostep_report=1, team=team, name=name, run=run, sequence=0, time="", stale="", source=source, status="waiting",
        position=None, motion=None, place=None, streams=None, plan=printable(plan.name, 64), plan_sha256=plan.digest,
        version=importlib.metadata.version("echostep")[:32], battery_percent=battery_percent(), superseded=0,
    )  # fmt: skip


def report(
    blank: Report,
    levels: Sequence[Level],
    ground: GroundPlane | None,
    e: Estimate,
    motion: Motion,
    streams: StreamReport,
) -> Report:
    """The report of an estimate."""
    radius = e.ellipse95.major_m
    heading = e.heading_rad if e.heading_sd_rad <= UNKNOWN_RAD else None
    position = Position(
        t_s=e.t_s, age_s=0.0, x_m=e.x_m, y_m=e.y_m, xx_m2=e.xx_m2, xy_m2=e.xy_m2, yy_m2=e.yy_m2, radius95_m=radius,
        heading_rad=heading, heading_sd_rad=min(e.heading_sd_rad, 100.0), floor=e.level, floor_name=printable(levels[e.level].name, 64),
        floor_probability=min(max(e.levels[e.level], 0.0), 1.0), z_m=e.z_m, z_sd_m=e.z_sd_m,
    )  # fmt: skip
    there = ground.place(e.x_m, e.y_m, radius / math.sqrt(CHI2_95), heading) if ground else None
    return replace(blank, status=e.status.value, position=position, motion=motion, place=there, streams=streams)


def battery_percent() -> int | None:
    """Charge of this computer's battery; None without one."""
    for path in sorted(SUPPLIES.glob("BAT*/capacity")):
        try:
            return max(0, min(100, int(path.read_text())))
        except (OSError, ValueError):
            continue
    return None


def _line(endpoint: Endpoint, plan: Plan, outlet: Outlet, run: str) -> Line:
    if endpoint.scheme in ("mqtt", "mqtts"):
        return MqttLine(endpoint, outlet.team, outlet.name, run)
    if plan.georeference is None:
        raise EchostepError(
            f"{endpoint}: the plan has no georeference, and TAK needs latitude and longitude: add one to the plan, or use mqtt://"
        )
    return UdpLine(endpoint) if endpoint.scheme == "cot+udp" else StreamLine(endpoint)
