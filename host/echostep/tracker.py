"""The tracker: bytes in, estimates out. The one place where the stages meet.

In: chunks in order of arrival. Out: estimates. Owns the intake, the cloud and the random generator. Live, replay and simulation all come through
`Tracker.take`; nothing in here looks at a wall clock, so equal chunks give equal estimates, bit for bit, in whatever portions they come.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echostep.board.gateway import BeaconReading, Gateway
from echostep.errors import EchostepError
from echostep.legs.heading import CompassErrors
from echostep.localization.beacon_map import BeaconPlace
from echostep.localization.estimate import Estimate, estimate, unobserved
from echostep.localization.map_filter import FilterSettings, MapFilter
from echostep.localization.particle_kernels import Move, systematic
from echostep.localization.particles import CloudSettings
from echostep.odometry.front_end import FrontEnd
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Plan, Pose
from echostep.ports.check_in import HEADING_SD_RAD, PERSON, CheckIn, parse_check_in
from echostep.ports.chunks import GATEWAY, Chunk, Portion, portion_of
from echostep.settings import Settings
from echostep.tracker_state import Particles, StreamState, TrackerState
from echostep.walls.level_sheet import lay_out_levels

MOST_WORDS = 4096  # of beacons that wait for the foot; older ones are forgotten
KNOWN_SD_RAD = 0.5  # of a heading; beyond it the cloud must look everywhere
NO_PINGS = (np.empty(0), np.empty(0, np.int64), np.empty(0))
Watch = Callable[
    [MeasuredSegment | None, Estimate], None
]  # is told of each estimate and of what it came from; None: of a silent foot


class Tracker:
    """Feed it every chunk; it returns the estimates that the chunk completes."""

    def __init__(
        self,
        plan: Plan,
        start: Pose | None = None,
        settings: Settings | None = None,
        seed: int = 0,
        *,
        waits: bool = False,
    ) -> None:
        """`start`: where the trunk stands and looks at the beginning; the plan's own start when None.

        `waits`: for a check-in, when there is neither.
        """
        pose = start or plan.start
        if pose is None and not waits:
            raise EchostepError("the plan has no start: give one with --start X,Y,DEG")
        if pose is not None and pose.level >= len(plan.levels):
            raise EchostepError(f"the start is on level {pose.level}, the plan has {len(plan.levels)}, counted from 0")
        self.settings = settings or Settings()
        self.plan = plan
        self.start = pose
        s = self.settings
        self.intake = FrontEnd(
            s.mtx, s.ranger, s.foot, s.gait, s.wearer, s.gyro, None if s.compass == CompassErrors() else s.compass
        )
        self.laid_out = lay_out_levels(plan)
        self.filter: MapFilter | None = None  # from the moment when the foot has stood still
        self.gateway = Gateway()
        self._words: list[BeaconReading] = []  # that wait for their leg
        self.watchers: list[Watch] = []  # are told in this order
        self.check_ins = 0
        self.bad_check_ins = 0
        self._rng = np.random.default_rng(seed)
        self._last: Estimate | None = None
        self.leg: PathSegment | None = None  # the last one
        self._said: CheckIn | None = None

    @property
    def lost_at_start(self) -> bool:
        """Whether nobody has said yet where the walk begins."""
        return self.start is None and self._said is None

    @property
    def state(self) -> TrackerState:
        """Estimate, path and filter after the newest chunk."""
        return TrackerState(
            estimate=self._last,
            last_segment=self.leg,
            pending_segments=self.intake.ahead,
            waits_for_start=self.lost_at_start,
            check_ins=self.check_ins,
            bad_check_ins=self.bad_check_ins,
            particle_count=0 if self.filter is None else len(self.filter.cloud.x_m),
            plan_explained=math.nan if self.filter is None else self.filter.explained,
            beacon_numbers=tuple(self.gateway.numbers),
            beacon_heard_s=None if self.filter is None else self.filter.beacon_map.heard_s,
        )

    @property
    def streams(self) -> StreamState:
        """Counts of the input streams and reports of the board after the newest chunk."""
        front_end, reports = self.intake, self.intake.words
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
        return self.intake.timeline.arrival_ns(t_s)

    def feed(self, chunk: Chunk) -> list[Estimate]:
        """Take one chunk; estimates come at the middle of each stance, and twice a second while standing."""
        return self.take(portion_of([chunk]))

    def take(self, portion: Portion) -> list[Estimate]:
        """Take many chunks; the estimates are those that the chunks would have given one by one."""
        if PERSON not in portion.ports:
            return self._cut(portion)
        estimates: list[Estimate] = []
        begin = 0
        for row in np.flatnonzero(portion.port == portion.ports.index(PERSON)).tolist():
            estimates += self._cut(portion.rows(begin, row))
            said = parse_check_in(portion.received[portion.start[row] : portion.end[row]])
            if said is None or said.level >= len(self.plan.levels):
                self.bad_check_ins += 1
            else:
                estimates += self.check_in(said)
            begin = row + 1
        return estimates + self._cut(portion.rows(begin, len(portion.port)))

    def check_in(self, said: CheckIn) -> list[Estimate]:
        """Somebody says where he stands: the cloud is drawn anew about it, with what was known of the heading when he did not say it.

        Before the first leg it is the start. Legs that are still on their way come on top: who checks in should stand.
        """
        self.check_ins += 1
        self._said = said
        if self.leg is None:
            return []
        self.filter = self._drawn(said, self.leg.heading1_rad)
        t_s = max(self.leg.t1_s, self._last.t_s) if self._last else self.leg.t1_s
        self._last = estimate(self.filter.cloud, t_s, self.leg.heading1_rad, self.leg.step)
        self._tell(MeasuredSegment(self.leg, *NO_PINGS), self._last)
        return [self._last]

    def _cut(self, portion: Portion) -> list[Estimate]:
        return [e for piece in portion.cut_after(GATEWAY) for e in self._take(piece)]

    def _take(self, portion: Portion) -> list[Estimate]:
        """Take chunks of which the last alone may be the gateway's: what beacons said is known from then on."""
        estimates: list[Estimate] = []
        for piece in self.intake.take(portion):
            if isinstance(piece, MeasuredSegment):
                self.leg = piece.segment
                self.filter = self.filter or self._first(piece.segment.heading0_rad)
                if self.filter is None:
                    continue
                self._last = self.filter.update(piece, self._words_until(piece.segment.t1_s))
                estimates.append(self._last)
                self._tell(piece, self._last)
            elif self._last is not None:
                estimates.append(unobserved(self._last, piece.t_s))
                self._tell(None, estimates[-1])
        if said := portion.of(GATEWAY).received:
            self._words += self.gateway.take(said, self.intake.newest_s)
        return estimates

    def _words_until(self, t_s: float) -> list[BeaconReading]:
        """What beacons have said up to then and nobody has heard yet."""
        words = [word for word in self._words if word.t_s <= t_s]
        self._words = [word for word in self._words if word.t_s > t_s][-MOST_WORDS:]
        return words

    def _tell(self, passage: MeasuredSegment | None, told: Estimate) -> None:
        for watch in self.watchers:
            watch(passage, told)

    def warm_up(self) -> None:
        """Compile the kernels (seconds, the first time on a machine), so that nothing waits for it later; leaves the tracker as it was."""
        self.intake.warm_up()
        leg = PathSegment(0.0, 1.0, 0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0)
        one = MeasuredSegment(leg, np.array([0.5]), np.array([0]), np.array([1.0]))
        first = self._begin(Pose(0.0, 0.0, 0.0), 0.0, np.random.default_rng(0))
        first.update(one, [BeaconReading(t_s, 0, 0.5, 0.0) for t_s in (0.4, 0.6)])
        first.beacon_map.places(first.cloud, 1.0)
        systematic(np.ones(2), 0.5, 2)

    def _first(self, walk_heading_rad: float) -> MapFilter | None:
        """The filter at the first leg; None while nobody has said where that is."""
        if self._said is not None:
            return self._drawn(self._said, walk_heading_rad)
        return None if self.start is None else self._begin(self.start, walk_heading_rad, self._rng)

    def _drawn(self, said: CheckIn, walk_heading_rad: float) -> MapFilter:
        """A filter about a check-in; with no heading at all its cloud is large and looks everywhere."""
        heading_rad, sd_rad = said.heading_rad, HEADING_SD_RAD
        if heading_rad is None:
            heading_rad, sd_rad = (self._last.heading_rad, self._last.heading_sd_rad) if self._last else (0.0, math.pi)
        turn_sd_deg = math.degrees(min(sd_rad, KNOWN_SD_RAD))
        spread = replace(self.settings.cloud, start_sd_m=said.sd_m, start_turn_sd_deg=turn_sd_deg)
        drawn = self._begin(Pose(said.x_m, said.y_m, heading_rad, said.level), walk_heading_rad, self._rng, spread)
        if sd_rad > KNOWN_SD_RAD:
            drawn.cloud.scatter(Move(0.0, 0.0, 0.0, sd_rad))
        return drawn

    def _begin(
        self, start: Pose, walk_heading_rad: float, rng: np.random.Generator, cloud: CloudSettings | None = None
    ) -> MapFilter:
        s, laid_out = self.settings, self.laid_out
        settings = FilterSettings(cloud or s.cloud, s.echo, s.climb, s.beacons)
        return MapFilter(laid_out.walls, start, walk_heading_rad, rng, settings, laid_out.sheet)
