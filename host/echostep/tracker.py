"""The tracker: chunks in, estimates out. The only module where the stages meet.

In: chunks in order of arrival. Out: estimates; for views, copies of the state (`TrackerState`, `StreamState`, `Particles`). Owns the front end,
the filter and the random generator. Live, replay and simulation all use `Tracker.take`. No wall clock is read here: equal chunks give equal
estimates, bit for bit, in portions of any size.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.board.findings import BoardReports
from echostep.board.frames import FrameCounts
from echostep.board.gateway import BeaconReading, Gateway, GatewayCounts
from echostep.board.messages import Identity, Status
from echostep.errors import EchostepError
from echostep.legs.heading import CompassErrors
from echostep.localization.beacon_map import BeaconPlace
from echostep.localization.estimate import Estimate, estimate, unobserved
from echostep.localization.map_filter import FilterSettings, MapFilter
from echostep.localization.particle_kernels import Move, systematic
from echostep.localization.particles import CloudSettings
from echostep.odometry.front_end import FrontEnd, FrontEndCounts
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Plan, Pose
from echostep.ports.check_in import HEADING_SD_RAD, PERSON, CheckIn, parse_check_in
from echostep.ports.chunks import GATEWAY, Chunk, Portion, portion_of
from echostep.settings import Settings
from echostep.walls.level_sheet import lay_out_levels
from echostep.xsens.reader import MtxCounts

MAX_READINGS = 4096  # of beacons, that wait for their segment; beyond it the oldest are dropped; by reason
KNOWN_SD_RAD = 0.5  # of a heading; by reason: with a larger one the particles are spread over all headings
NO_PINGS = (np.empty(0), np.empty(0, np.int64), np.empty(0))
Watch = Callable[[MeasuredSegment | None, Estimate], None]  # called with each estimate and its segment; None: a dropout


@dataclass(frozen=True, slots=True)
class TrackerState:
    """The tracker after the newest chunk.

    `last_segment` belongs to `estimate`; `pending_segments` follow it and wait for their pings. `plan_explained`: running mean log-likelihood of the
    echoes under the plan (about 1 when tracked well), NaN before the first segment. `beacon_numbers`: by slot. `beacon_heard_s`: time of the newest
    reading that the filter used. `waits_for_start`: neither a start nor a check-in is known yet.
    """

    estimate: Estimate | None
    last_segment: PathSegment | None
    pending_segments: tuple[PathSegment, ...]
    waits_for_start: bool
    check_ins: int
    bad_check_ins: int
    particle_count: int
    plan_explained: float
    beacon_numbers: tuple[int, ...]
    beacon_heard_s: float | None


@dataclass(frozen=True, slots=True)
class StreamState:
    """Counts of each input stream since the start, and the newest reports of the board.

    `status`, `identity`: the newest with a plausible time. `synchronised`: SyncOut edges time the MTx samples.
    """

    board: FrameCounts
    mtx: MtxCounts
    gateway: GatewayCounts
    front_end: FrontEndCounts
    pings: int
    synchronised: bool
    board_restarts: int
    status: Status | None
    identity: Identity | None
    reports: BoardReports


@dataclass(frozen=True, slots=True)
class Particles:
    """n particles: `x_m`, `y_m` (n,) in the map, `level` (n,) index in the plan, `log_weight` (n,), 0 for the heaviest of all particles."""

    x_m: Floats
    y_m: Floats
    level: Ints
    log_weight: Floats


class Tracker:
    """Call `feed` with every chunk, or `take` with portions of them; both return the estimates that become certain."""

    def __init__(
        self,
        plan: Plan,
        start: Pose | None = None,
        settings: Settings | None = None,
        seed: int = 0,
        *,
        waits: bool = False,
    ) -> None:
        """`start`: pose of the trunk at the beginning; the plan's own start when None. `waits`: without either, wait for a check-in."""
        pose = start or plan.start
        if pose is None and not waits:
            raise EchostepError("the plan has no start: give one with --start X,Y,DEG")
        if pose is not None and pose.level >= len(plan.levels):
            raise EchostepError(f"the start is on level {pose.level}, the plan has {len(plan.levels)}, counted from 0")
        self.settings = settings or Settings()
        self.plan = plan
        self.start = pose
        s = self.settings
        self.front_end = FrontEnd(
            s.mtx, s.ranger, s.foot, s.gait, s.wearer, s.gyro, None if s.compass == CompassErrors() else s.compass
        )
        self.laid_out = lay_out_levels(plan)
        self.filter: MapFilter | None = None  # from the first segment on
        self.gateway = Gateway()
        self.watchers: list[Watch] = []  # called in this order
        self._readings: list[BeaconReading] = []  # that wait for their segment
        self._check_ins = self._bad_check_ins = 0
        self._check_in: CheckIn | None = None  # the newest
        self._segment: PathSegment | None = None  # the newest
        self._estimate: Estimate | None = None  # the newest
        self._rng = np.random.default_rng(seed)

    @property
    def state(self) -> TrackerState:
        """Estimate, path and filter after the newest chunk."""
        return TrackerState(
            estimate=self._estimate,
            last_segment=self._segment,
            pending_segments=self.front_end.pending_segments,
            waits_for_start=self.start is None and self._check_in is None,
            check_ins=self._check_ins,
            bad_check_ins=self._bad_check_ins,
            particle_count=0 if self.filter is None else len(self.filter.cloud.x_m),
            plan_explained=math.nan if self.filter is None else self.filter.explained,
            beacon_numbers=tuple(self.gateway.numbers),
            beacon_heard_s=None if self.filter is None else self.filter.beacon_map.heard_s,
        )

    @property
    def streams(self) -> StreamState:
        """Counts of the input streams and reports of the board after the newest chunk."""
        front_end, reports = self.front_end, self.front_end.reports
        return StreamState(
            board=front_end.board.counts,
            mtx=front_end.mtx.counts,
            gateway=replace(self.gateway.counts),
            front_end=front_end.counts,
            pings=front_end.pings,
            synchronised=front_end.timeline.synchronised,
            board_restarts=front_end.timeline.board_restarts,
            status=front_end.status,
            identity=front_end.identity,
            reports=replace(reports, gyros=dict(reports.gyros)),
        )

    def particles(self, most: int) -> Particles | None:
        """A copy of at most `most` particles, evenly thinned; None before the first segment."""
        if self.filter is None:
            return None
        cloud = self.filter.cloud
        every = slice(None, None, max(1, math.ceil(len(cloud.x_m) / most)))
        return Particles(
            x_m=cloud.map_x_m[every].copy(),
            y_m=cloud.y_m[every].copy(),
            level=cloud.level[every].copy(),
            log_weight=cloud.log_weight[every].copy(),
        )

    def beacon_places(self, t_s: float) -> list[BeaconPlace]:
        """Every beacon with a known place, as the particles believe it at `t_s`."""
        return [] if self.filter is None else self.filter.beacon_map.places(self.filter.cloud, t_s)

    def arrival_ns(self, t_s: float) -> int:
        """Arrival time, on the host's clock, of undelayed bytes about `t_s`; 0 before any bytes have come."""
        return self.front_end.timeline.arrival_ns(t_s)

    def feed(self, chunk: Chunk) -> list[Estimate]:
        """Process one chunk; estimates come at the middle of each stance, and twice a second while standing."""
        return self.take(portion_of([chunk]))

    def take(self, portion: Portion) -> list[Estimate]:
        """Process many chunks; the estimates are those of the chunks one by one."""
        estimates: list[Estimate] = []
        for piece in portion.cut_after(PERSON):
            for part in piece.cut_after(GATEWAY):
                estimates += self._track(part)
            check_in = piece.of(PERSON)
            if len(check_in.row):
                estimates += self._apply_check_in(check_in.received)
        return estimates

    def warm_up(self) -> None:
        """Compile the kernels (seconds, the first time on a machine), so that no chunk waits for it later; leaves the tracker as it was."""
        self.front_end.warm_up()
        segment = PathSegment(0.0, 1.0, 0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0)
        measured = MeasuredSegment(segment, np.array([0.5]), np.array([0]), np.array([1.0]))
        other = self._new_filter(Pose(0.0, 0.0, 0.0), 0.0, np.random.default_rng(0))
        other.update(measured, [BeaconReading(t_s, 0, 0.5, 0.0) for t_s in (0.4, 0.6)])
        other.beacon_map.places(other.cloud, 1.0)
        systematic(np.ones(2), 0.5, 2)

    def _track(self, portion: Portion) -> list[Estimate]:
        """Estimates from a portion of which only the last chunk may be the gateway's: its readings count from the next portion on."""
        estimates: list[Estimate] = []
        # Odometry: chunks -> segments of the trunk's path with their pings, and dropouts.
        for piece in self.front_end.process(portion):
            if isinstance(piece, MeasuredSegment):
                self._segment = piece.segment
                self.filter = self.filter or self._first_filter(piece.segment.heading0_rad)
                if self.filter is None:
                    continue
                # Localization: propagate by the segment, reweight by pings and beacon readings.
                self._estimate = self.filter.update(piece, self._pop_readings(piece.segment.t1_s))
                estimates.append(self._publish(piece, self._estimate))
            elif self._estimate is not None:
                estimates.append(self._publish(None, unobserved(self._estimate, piece.t_s)))
        # Beacons: bytes of the gateway -> readings.
        if received := portion.of(GATEWAY).received:
            self._readings += self.gateway.read(received, self.front_end.newest_s)
        return estimates

    def _pop_readings(self, t_s: float) -> list[BeaconReading]:
        """The waiting beacon readings up to a time."""
        ready = [reading for reading in self._readings if reading.t_s <= t_s]
        self._readings = [reading for reading in self._readings if reading.t_s > t_s][-MAX_READINGS:]
        return ready

    def _publish(self, measured: MeasuredSegment | None, new: Estimate) -> Estimate:
        """Call the watchers with a new estimate."""
        for watch in self.watchers:
            watch(measured, new)
        return new

    def _apply_check_in(self, received: bytes) -> list[Estimate]:
        """Draw a new filter about a check-in; before the first segment it is the start. A check-in that is not valid is counted.

        A missing heading is taken from the last estimate. Segments that are still pending are added on top: a check-in needs a standing wearer.
        """
        check_in = parse_check_in(received)
        if check_in is None or check_in.level >= len(self.plan.levels):
            self._bad_check_ins += 1
            return []
        self._check_ins += 1
        self._check_in = check_in
        segment = self._segment
        if segment is None:
            return []
        self.filter = self._filter_at(check_in, segment.heading1_rad)
        t_s = max(segment.t1_s, self._estimate.t_s) if self._estimate else segment.t1_s
        self._estimate = estimate(self.filter.cloud, t_s, segment.heading1_rad, segment.step)
        return [self._publish(MeasuredSegment(segment, *NO_PINGS), self._estimate)]

    def _first_filter(self, walk_heading_rad: float) -> MapFilter | None:
        """The filter at the first segment; None while neither a start nor a check-in is known."""
        if self._check_in is not None:
            return self._filter_at(self._check_in, walk_heading_rad)
        return None if self.start is None else self._new_filter(self.start, walk_heading_rad, self._rng)

    def _filter_at(self, check_in: CheckIn, walk_heading_rad: float) -> MapFilter:
        """A filter about a check-in; without a known heading its particles are many and point anywhere."""
        heading_rad, sd_rad = check_in.heading_rad, HEADING_SD_RAD
        if heading_rad is None:
            last = self._estimate
            heading_rad, sd_rad = (last.heading_rad, last.heading_sd_rad) if last else (0.0, math.pi)
        turn_sd_deg = math.degrees(min(sd_rad, KNOWN_SD_RAD))
        spread = replace(self.settings.cloud, start_sd_m=check_in.sd_m, start_turn_sd_deg=turn_sd_deg)
        start = Pose(check_in.x_m, check_in.y_m, heading_rad, check_in.level)
        drawn = self._new_filter(start, walk_heading_rad, self._rng, spread)
        if sd_rad > KNOWN_SD_RAD:
            drawn.cloud.scatter(Move(0.0, 0.0, 0.0, sd_rad))
        return drawn

    def _new_filter(
        self, start: Pose, walk_heading_rad: float, rng: np.random.Generator, cloud: CloudSettings | None = None
    ) -> MapFilter:
        s, laid_out = self.settings, self.laid_out
        settings = FilterSettings(cloud or s.cloud, s.echo, s.climb, s.beacons)
        return MapFilter(laid_out.walls, start, walk_heading_rad, rng, settings, laid_out.sheet)
