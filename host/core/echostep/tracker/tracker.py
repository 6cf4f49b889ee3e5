# SPDX-License-Identifier: MIT
"""The tracker: chunks in, estimates out. The only module where the stages meet.

In: chunks in order of arrival. Out: estimates; for views, copies of the state (`TrackerState`, `StreamState`, `ParticleSnapshot`). Owns the
front end, the filter and the random generator. Live, replay and simulation all use `Tracker.take`. No wall clock is read here: equal chunks
give equal estimates, bit for bit, in portions of any size.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from echostep.aiding import (
    AidedFilter,
    BeaconPlace,
    MeetingEffect,
    MeetingQueue,
    TeamBeaconMap,
    TimedMeeting,
    carries_position,
    on_the_way,
    shared_beacons,
    start_at,
)
from echostep.arrays import Floats
from echostep.board.gateway import BeaconReading, Gateway
from echostep.echoes.rangers import echo_of
from echostep.elementary import wrap
from echostep.errors import EchostepError
from echostep.localization import Building, Estimate, FilterSettings, Start, TrackStatus
from echostep.odometry import FrontEnd, WearerWatch
from echostep.path import Dropout, MeasuredSegment, PathSegment
from echostep.plan import NO_PLAN, Plan, Pose
from echostep.ports.chunks import FOOT, GATEWAY, Chunk, Portion, portion_of
from echostep.ports.imu_samples import SampleCounter, check_samples
from echostep.ports.people.check_in import HEADING_SD_RAD, PERSON, Call, CheckIn, Undo, parse_person
from echostep.ports.people.meeting import MEETING
from echostep.ports.people.team_beacons import TEAM_BEACONS, SharedBeacon
from echostep.settings import Settings
from echostep.tracker import kernels
from echostep.tracker.before_check_in import BeforeCheckIn
from echostep.tracker.state import LastPlace, ParticleSnapshot, StreamState, TrackerState
from echostep.walls.level_sheet import lay_out_levels

MAX_READINGS = 4096  # of beacons, waiting for their segment; beyond it the oldest are dropped, assumed
LATE_S = 0.5  # behind a published time: an older estimate is outdated: half a stride, a third of the claimed 1 m
KNOWN_SD_RAD = 0.5  # of a heading that a check-in without one takes over, assumed
KNOWN = 0.9  # probability of the estimate giving this heading: a tap at another place means that the estimate was wrong
NO_PINGS = (np.empty(0), np.empty(0, np.int64), np.empty(0))
Watch = Callable[[MeasuredSegment | None, Estimate], None]  # called with each estimate and its segment; None: a dropout


class Tracker:
    """Call `feed` with every chunk, or `take` with portions of them; both return the estimates that become certain."""

    def __init__(
        self,
        plan: Plan,
        start: Pose | Start | None = None,
        settings: Settings | None = None,
        seed: int = 0,
        *,
        waits: bool = False,
    ) -> None:
        """`start`: where the trunk may be at the beginning; the plan's own start when None. Without either it may be anywhere in the building.

        `waits`: without either, wait for a check-in.
        """
        self.settings = settings or Settings()
        s = self.settings
        self.plan = plan
        self.start = self._start_of(start or plan.start, waits)
        self.front_end = FrontEnd(s.mtx, s.ranger, s.foot, s.gait, s.wearer, s.gyro, s.iron, s.imus)
        self.laid_out = lay_out_levels(plan)
        self._building = Building.of(plan, self.laid_out)
        self.filter: AidedFilter | None = None  # from the first segment on
        self.gateway = Gateway()
        self._imu = SampleCounter(s.mtx.rate_hz)  # for `feed_samples`
        self.watchers: list[Watch] = []  # called in this order
        self._readings: list[BeaconReading] = []  # waiting for their segment
        self._meetings = MeetingQueue()
        self._team_beacons = TeamBeaconMap()
        self._check_ins = self._bad_check_ins = self._undone = 0
        self._before: BeforeCheckIn | None = None  # the newest check-in, while it can be undone
        self._check_in: CheckIn | None = None  # the newest
        self._check_in_s = -math.inf  # its time: the path before it does not move the cloud
        self._ranger_part = 0  # named by the board [protocol/messages.toml, part]
        self._segment: PathSegment | None = None  # the newest
        self._estimate: Estimate | None = None  # the newest
        self._published_s = -math.inf  # time of the newest published estimate
        self._rng = np.random.default_rng(seed)

    @property
    def watch(self) -> WearerWatch:
        """Observes the wearer; may be replaced before the first chunk."""
        return self.front_end.watch

    @watch.setter
    def watch(self, watch: WearerWatch) -> None:
        self.front_end.watch = watch

    @property
    def state(self) -> TrackerState:
        """Estimate, path and filter after the newest chunk."""
        return TrackerState(
            estimate=self._estimate,
            last_segment=self._segment,
            pending_segments=self.front_end.pending_segments,
            waits_for_start=self.start is None and self._check_in is None,
            undoable=self._check_ins if self._before else None,
            check_ins=self._check_ins,
            undone=self._undone,
            bad_check_ins=self._bad_check_ins,
            particle_count=0 if self.filter is None else len(self.filter.cloud.x_m),
            right=math.nan if self.filter is None else self.filter.belief.right,
            searches=self.filter is not None and self.filter.belief.is_searching,
            beacon_numbers=tuple(self.gateway.numbers),
            beacon_heard_s=None if self.filter is None else self.filter.beacon_map.heard_s,
            alarm=self.watch.alarm,
            met=self._meetings.news,
            meetings=dict(self._meetings.counts),
            team_beacons={name: tuple(beacons.values()) for name, beacons in self._team_beacons.reported.items()},
            team_beacon_messages=dict(self._team_beacons.counts),
        )

    @property
    def streams(self) -> StreamState:
        """Counts of the input streams and reports of the board after the newest chunk."""
        front_end, reports = self.front_end, self.front_end.reports
        return StreamState(
            board=front_end.board.counts,
            mtx=front_end.foot_source.counts,
            gateway=replace(self.gateway.counts),
            front_end=front_end.counts,
            pings=front_end.pings,
            synchronised=front_end.timeline.synchronised,
            board_restarts=front_end.timeline.board_restarts,
            reports=replace(reports, gyros=dict(reports.gyros)),
            foot_reports=replace(front_end.foot_source.board.reports) if front_end.foot_source.port == FOOT else None,
        )

    def particles(self, most: int) -> ParticleSnapshot | None:
        """A copy of at most `most` particles, by weight; None before the first segment."""
        return None if self.filter is None else ParticleSnapshot.of(self.filter, most)

    def beacon_places(self, t_s: float) -> list[BeaconPlace]:
        """Every beacon with a known place, as the particles believe it at `t_s`."""
        return [] if self.filter is None else self.filter.beacon_map.places(self.filter.cloud, t_s)

    def own_beacons(self) -> tuple[SharedBeacon, ...] | None:
        """The beacons that this walk has placed, for teammates; None unless the status is `tracking` and echoes have confirmed it.

        With a stated start the status is `tracking` before any echo; teammates would take over its error.
        """
        last, tracked = self._estimate, self.filter
        if last is None or tracked is None or last.status is not TrackStatus.TRACKING or not tracked.plan_supports:
            return None
        return shared_beacons(tracked.beacon_map, tracked.cloud, last.t_s, self.gateway.numbers)

    def last_place(self) -> LastPlace | None:
        """The start of the next run; None unless the status of the newest estimate is `tracking`."""
        return LastPlace.of(self._estimate, None if self.filter is None else self.filter.cloud.air)

    def arrival_ns(self, t_s: float) -> int:
        """Arrival time, on the host's clock, of undelayed bytes about `t_s`; 0 before any bytes have come."""
        return self.front_end.timeline.arrival_ns(t_s)

    def feed(self, chunk: Chunk) -> list[Estimate]:
        """Process one chunk; estimates come at the middle of each stance, and twice a second while standing."""
        return self.take(portion_of([chunk]))

    def feed_samples(self, t_s: Floats, accel: Floats, gyro: Floats) -> list[Estimate]:
        """Process any number of a foot IMU's samples: t_s (n,) s, accel (n, 3) m/s2, gyro (n, 3) rad/s, body frame [`Settings.of_imu`].

        No estimate comes before the foot has stood. Raises EchostepError where the first samples are in other units or not in order, with the
        factor, and for other shapes.
        """
        if self.filter is None:
            check_samples(t_s, accel, gyro)
        estimates = self._published(self.front_end.process_samples(self._imu.of(t_s, accel, gyro)))
        self.watch.advance()
        return estimates

    def take(self, portion: Portion) -> list[Estimate]:
        """Process many chunks; the estimates are the same as for the chunks one by one."""
        estimates: list[Estimate] = []
        for piece in portion.cut_after(GATEWAY, TEAM_BEACONS, MEETING, PERSON):
            # Odometry: chunks -> segments of the trunk's path with their pings, and dropouts.
            estimates += self._published(self.front_end.process(piece))
            # Beacons: bytes of the gateway -> readings, used from the next piece on.
            if received := piece.of(GATEWAY).received:
                self._readings += self.gateway.read(received, self.front_end.newest_s)
            # Team: beacons that teammates have placed, meetings with them, check-ins.
            if len((shared := piece.of(TEAM_BEACONS)).row):
                self._team_beacons.receive(shared.received, len(self.plan.levels))
            self.watch.advance()
            for port, apply in ((MEETING, self._receive_meeting), (PERSON, self._apply_person)):
                message = piece.of(port)
                if len(message.row):
                    estimates += apply(message.received)
        return estimates

    def warm_up(self) -> None:
        """Call each kernel that tracks from this start, so that no chunk waits for its compilation; leaves the tracker as it was."""
        kernels.foot()
        kernels.board_and_clocks()
        self._new_filter(self.start or Start(), 0.0, np.random.default_rng(0)).update(kernels.measured())

    def _published(self, pieces: list[MeasuredSegment | Dropout]) -> list[Estimate]:
        """Estimates of new segments, and after dropouts."""
        estimates: list[Estimate] = []
        for piece in pieces:
            if isinstance(piece, MeasuredSegment):
                estimates += self._follow(piece)
            elif self._estimate is not None:
                estimates.append(self._publish(None, self._estimate.unobserved(piece.t_s)))
        return estimates

    def _follow(self, measured: MeasuredSegment) -> list[Estimate]:
        """The estimate at the end of a new segment. Of a segment before a check-in only the heading is used."""
        segment = measured.segment
        last, self._segment = self._segment, segment
        tracked = self._filter_from(measured)
        if tracked is None:
            return []
        readings = [reading for reading in self._readings if reading.t_s <= segment.t1_s]
        self._readings = [reading for reading in self._readings if reading.t_s > segment.t1_s][-MAX_READINGS:]
        meetings = self._meetings.pop(segment.t1_s)
        meetings += self._team_beacons.ranges(readings, self.gateway.numbers)
        if self._before and not self._before.add(measured, readings, meetings):
            self._before = None
        if segment.t0_s < self._check_in_s:
            last_rad = segment.heading0_rad if last is None else last.heading1_rad
            until_s = min(self._check_in_s, segment.t1_s)
            tracked.turn_walk_frame(wrap(last_rad - segment.heading_rad(until_s)))
            if segment.t1_s <= self._check_in_s:
                return []
            measured = measured.after(self._check_in_s)
        self._estimate, effects = self._step(tracked, measured, readings, meetings)
        for (_, meeting), effect in zip(meetings, effects, strict=True):
            self._meetings.note(meeting, effect)
        return [self._publish(measured, self._estimate)]

    def _filter_from(self, measured: MeasuredSegment) -> AidedFilter | None:
        """The filter that a segment moves; None while neither a start nor a check-in is known."""
        self._ranger_part = measured.ranger_part or self._ranger_part
        if self.filter is None:
            heading_rad = measured.segment.heading0_rad
            if self._check_in is not None:
                self.filter = self._filter_at(self._check_in, heading_rad)
            elif self.start is not None:
                self.filter = self._new_filter(self.start, heading_rad, self._rng)
        return self.filter

    def _step(
        self,
        tracked: AidedFilter,
        measured: MeasuredSegment,
        readings: list[BeaconReading],
        meetings: list[TimedMeeting],
    ) -> tuple[Estimate, list[MeetingEffect]]:
        """Localization: reweight by meetings, propagate by the segment, reweight by its pings and beacon readings.

        Returns the estimate at its end, and the effect of each meeting.
        """
        tracked.set_ranger_model(echo_of(self._ranger_part, self.settings.echo))
        effects = [tracked.meet(on_the_way(meeting, measured.segment, t_s)) for t_s, meeting in meetings]
        return tracked.update(measured, readings), effects

    def _publish(self, measured: MeasuredSegment | None, new: Estimate) -> Estimate:
        """Call the watchers with a new estimate; its time is never before an earlier estimate's.

        Bytes that arrive after a dropout give a past position: such an estimate is extrapolated to the time of the dropout.
        """
        self._published_s = max(self._published_s, new.t_s)
        if new.t_s < self._published_s - LATE_S:
            new = new.unobserved(self._published_s)
        new = new if new.t_s == self._published_s else replace(new, t_s=self._published_s)
        for watch in self.watchers:
            watch(measured, new)
        return new

    def _receive_meeting(self, received: bytes) -> list[Estimate]:
        """Queue a meeting for the segment in which it happened; without a start yet, the meeting is the start. A tap is a sign of life."""
        now_s = self.front_end.newest_s
        meeting = self._meetings.receive(received, len(self.plan.levels))
        if meeting is None:
            return []
        if meeting.range_m is None:
            self.watch.answer(now_s, ends_help=False)
        if self.start is not None or self._check_in is not None or not carries_position(meeting):
            self._meetings.add(meeting, now_s)
            return []
        self._meetings.note(meeting, MeetingEffect.MOVED)
        return self._apply_check_in(start_at(meeting))

    def _apply_person(self, received: bytes) -> list[Estimate]:
        """Apply a check-in, its undoing or a call; other bytes are counted. A tap is a sign of life."""
        message, now_s = parse_person(received), self.front_end.newest_s
        if message is not None and message != Call(help=True):
            self.watch.answer(now_s, ends_help=isinstance(message, Call))
        match message:
            case Call(wanted):
                if wanted:
                    self.watch.call_for_help(now_s)
                return []
            case CheckIn() as check_in if check_in.level < len(self.plan.levels):
                return self._apply_check_in(check_in)
            case Undo(number) if self._before and number == self._check_ins:
                return self._undo(self._before)
        self._bad_check_ins += 1
        return []

    def _apply_check_in(self, check_in: CheckIn) -> list[Estimate]:
        """Draw a new filter about a check-in; before the first segment it is the start.

        The place holds at the moment of the check-in: of the pending segments only the part after it moves the cloud.
        """
        state = self._rng.bit_generator.state
        self._before = BeforeCheckIn(self.filter, self._check_in, self._estimate, state)
        self._check_ins += 1
        self._check_in = check_in
        segment = self._segment
        if segment is None:
            return []
        self.filter = self._filter_at(check_in, segment.heading1_rad)
        self._check_in_s = self.front_end.newest_s
        t_s = max(segment.t1_s, self._estimate.t_s) if self._estimate else segment.t1_s
        self._estimate = self.filter.stated(t_s, segment.heading1_rad, segment.step)
        return [self._publish(MeasuredSegment(segment, *NO_PINGS), self._estimate)]

    def _undo(self, before: BeforeCheckIn) -> list[Estimate]:
        """Go back to the state before the newest check-in, and process the segments since then again."""
        self._before = None
        self._undone += 1
        self.filter, self._check_in, self._estimate = before.filter, before.check_in, before.estimate
        self._check_in_s = -math.inf
        self._rng.bit_generator.state = before.random_state
        waiting: list[BeaconReading] = []
        for measured, readings, meetings in before.since:
            tracked = self._filter_from(measured)
            if tracked is None:
                waiting += readings
            else:
                self._estimate, _ = self._step(tracked, measured, readings, meetings)
        self._readings = (waiting + self._readings)[-MAX_READINGS:]
        if self._segment is None or self._estimate is None:
            return []
        return [self._publish(MeasuredSegment(self._segment, *NO_PINGS), self._estimate)]

    def _filter_at(self, check_in: CheckIn, walk_heading_rad: float) -> AidedFilter:
        """A filter about a check-in; a check-in without a heading takes the last estimate's heading if it is known, else any."""
        heading_rad, sd_rad = check_in.heading_rad, HEADING_SD_RAD
        if heading_rad is None:
            last = self._estimate
            known = last is not None and last.right > KNOWN and last.heading_sd_rad < KNOWN_SD_RAD
            heading_rad, sd_rad = (last.heading_rad, last.heading_sd_rad) if last and known else (0.0, math.pi)
        pose = Pose(check_in.x_m, check_in.y_m, heading_rad, check_in.level)
        return self._new_filter(Start(pose, check_in.sd_m, sd_rad), walk_heading_rad, self._rng)

    def _start_of(self, start: Pose | Start | None, waits: bool) -> Start | None:
        """The start as a distribution; raises EchostepError for a level that the plan does not have."""
        if not self.plan.is_drawn and not (isinstance(start, Start) and start.pose):
            return Start(start if isinstance(start, Pose) else NO_PLAN.start, 0.0, 0.0)  # the origin of the map
        if isinstance(start, Pose):
            cloud = self.settings.cloud
            start = Start(start, cloud.start_sd_m, math.radians(cloud.start_turn_sd_deg))
        if start is None:
            return None if waits else Start()
        level = start.level if start.pose is None else start.pose.level
        if level >= len(self.plan.levels):
            raise EchostepError(f"the start is on level {level}, the plan has {len(self.plan.levels)}, counted from 0")
        return start

    def _new_filter(self, start: Start, walk_heading_rad: float, rng: np.random.Generator) -> AidedFilter:
        """A filter about a start."""
        s = self.settings
        echo = echo_of(self._ranger_part, s.echo)
        settings = FilterSettings(s.cloud, echo, s.climb, self.plan.uncertainty_m or 0.0)
        return AidedFilter(self._building, start, walk_heading_rad, rng, settings, s.beacons)
