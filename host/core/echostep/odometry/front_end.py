# SPDX-License-Identifier: MIT
"""Front end: chunks -> segments of the trunk's path, each with the pings that were triggered on it.

In: portions of chunks in order of arrival. Out: `MeasuredSegment`s and `Dropout`s in order of time, as they become certain. Owns the readers, the
timeline, the foot and leg odometry, and the synchronizer.

The output depends on the chunks alone: on their bytes and arrival times, not on how many of them come in one portion, nor on where bytes that arrived
together were cut. Every decision is taken message by message, at the message that makes it possible.

Indices: `frame_row` counts the board's frames of a portion, `sample_index` the foot's samples, `message_index` both together in order of arrival.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Bools, Floats, Ints
from echostep.board import messages
from echostep.board.air import Air
from echostep.board.calibration import GyroSettings, Imus, RangerSettings, heights, ranges, six_axes
from echostep.board.frames import BoardReader, Frames
from echostep.board.reports import BoardReports
from echostep.foot.alignment import Alignment
from echostep.foot.steps import Foot, FootEvents, FootSettings, Step
from echostep.foot.trunk_path import GaitSettings, TrunkPath
from echostep.legs.heading import CompassErrors
from echostep.legs.trunk_path import GyroBlock, WearerSettings
from echostep.odometry.barometer_start import BarometerStart
from echostep.odometry.foot_legs_handover import FootLegsHandover
from echostep.odometry.foot_source import ICM20649_NOISE, FootSamples, FootSource
from echostep.odometry.gyro_blocks import GyroBlocks
from echostep.odometry.heading_fusion import HeadingFusion
from echostep.odometry.synchronizer import BAROMETER, MEASUREMENT, Synchronizer
from echostep.odometry.wearer import WearerWatch
from echostep.path import Dropout, MeasuredSegment, PathSegment
from echostep.ports.chunks import BOARD, FOOT, GATEWAY, LINES, MTX, TEAM, Portion
from echostep.ports.imu_samples import ImuSamples
from echostep.ports.people.check_in import PERSON
from echostep.ports.people.meeting import MEETING
from echostep.ports.people.team_beacons import TEAM_BEACONS
from echostep.timing.timeline import FIRST_MESSAGE, PLAIN, SILENT, Arrivals, MtxTiming, Timeline, Times

_REPORTS = (
    messages.Identity,
    messages.Configuration,
    messages.Status,
    messages.GyroHealth,
    messages.BoardHealth,
    messages.Parts,
)
NOT_WORN = "the foot's sensor lies still while the leg swings: is it strapped to the shoe?"


@dataclass(slots=True)
class FrontEndCounts:
    """Counts of input that became neither a segment nor a ping, by cause, and doubts about the foot's."""

    unknown_ports: int = 0
    late_pings: int = 0
    dropped_pings: int = 0
    bad_times: int = 0
    bad_arrivals: int = 0  # messages whose arrival time contradicts their counter; most keep their time by the counter
    clock_steps: int = 0  # of the host's clock
    barometer_jumps: int = 0  # right after its start: the heights before them are not used
    stray_edges: int = 0  # on the board's SyncOut input, not from the MTx
    foot_doubts: tuple[str, ...] = ()  # faults of the foot's sensor or its mounting, a sentence each


class FrontEnd:
    """Call `process` with every chunk, in order of arrival."""

    def __init__(
        self, mtx: MtxTiming, ranger: RangerSettings, foot: FootSettings, gait: GaitSettings,
        wearer: WearerSettings | None = None, gyro: GyroSettings | None = None, iron: CompassErrors | None = None,
        imus: Imus | None = None,
    ) -> None:  # fmt: skip
        """`iron`: errors of the compass, if calibrated; `imus`: errors of the six-axis parts."""
        errors = imus or Imus()
        self.board = BoardReader()
        self.foot_source = FootSource(errors.foot)
        self.timeline = Timeline(mtx)
        self.foot = Foot(foot)
        self._foot_settings = foot
        self.alignment = Alignment()
        self.heading_fusion = HeadingFusion()
        self.path = TrunkPath(gait)
        self.handover = FootLegsHandover(wearer or WearerSettings(), iron)
        self.reports = BoardReports()
        self.pings = 0
        self.watch = WearerWatch()
        self.newest_s = math.nan  # newest time of either port
        self._ranger = ranger
        self.air = Air(ranger.speed_of_sound_m_s)
        self._ranger_parts = np.zeros((1, 2), np.int64)  # left, right, by the newest report
        self._gyro_blocks = GyroBlocks(gyro or GyroSettings(), errors.belt)
        self._barometer = BarometerStart()
        self._synchronizer = Synchronizer(math.radians(ranger.ahead_deg))
        self._unknown_ports = 0
        self._bad_times = 0

    @property
    def pending_segments(self) -> tuple[PathSegment, ...]:
        """Known segments whose pings have not all arrived."""
        return self._synchronizer.segments

    @property
    def counts(self) -> FrontEndCounts:
        """Counts since the start."""
        synchronizer, timeline = self._synchronizer, self.timeline
        return FrontEndCounts(
            self._unknown_ports,
            synchronizer.late,
            synchronizer.dropped,
            self._bad_times,
            timeline.contradicted,
            timeline.clock_steps,
            self._barometer.jumps,
            timeline.stray_edges,
            tuple(self.path.doubts) if self.handover.is_foot_worn else (NOT_WORN,),
        )

    def process(self, portion: Portion) -> list[MeasuredSegment | Dropout]:
        """Segments and dropouts that a portion completes; raises StaleFirmwareError when the board has another schema."""
        for k, port in enumerate(portion.ports):
            if port not in (BOARD, MTX, FOOT, GATEWAY, PERSON, TEAM, MEETING, TEAM_BEACONS, LINES):
                self._unknown_ports += int((portion.port == k).sum())
        # Decode: bytes of each port -> board frames, the foot's samples.
        from_board = portion.of(BOARD)
        frames, samples = self.board.frames(from_board.received), self._read_foot(portion)
        return self._process(frames, from_board.rows_of(frames.end), samples, portion.t_arrival_ns)

    def process_samples(self, samples: ImuSamples) -> list[MeasuredSegment | Dropout]:
        """The same for the samples of a foot IMU, which need no decoding."""
        foot, no_frames = self.foot_source.take(samples), self.board.frames(b"")
        return self._process(no_frames, no_frames.end, foot, samples.t_arrival_ns)

    def _process(
        self, frames: Frames, frame_chunk: Ints, samples: FootSamples, t_arrival_ns: Ints
    ) -> list[MeasuredSegment | Dropout]:
        """Segments and dropouts from decoded messages; `frame_chunk` (n,): index in `t_arrival_ns` of each frame."""
        if not len(frames.id) and not len(samples.value):
            return []
        # Time: ticks, sample counters and arrival times -> t_s of every message.
        board = _board_arrivals(frames, frame_chunk, t_arrival_ns)
        mtx = Arrivals(samples.value, samples.row, t_arrival_ns[samples.row], np.full(len(samples.row), PLAIN))
        times = self.timeline.times(board, mtx)
        self._bad_times += int((np.isnan(times.board_s) & (board.kind != SILENT)).sum() + np.isnan(times.mtx_s).sum())
        self._advance_clock(times)
        # Board: frames -> reports about itself, pings and heights, blocks of leg gyro samples.
        for report in frames.each(_REPORTS):
            self.reports.add(report)
        self._collect_pings(frames, times)
        leg_blocks = self._gyro_blocks.cut(frames, times)
        for message_index, block in leg_blocks:
            self.watch.add_legs(message_index, block)
        self._watch_belt(frames, times)
        # Foot: its samples -> segments of the trunk's path.
        stands = np.full(len(times.mtx_newest_s), self.foot.in_stance)
        foot_segments = self._track_foot(samples, leg_blocks, times, stands)
        # Handover: segments of foot and legs -> segments of one path.
        observed_s = self._merge_paths(foot_segments, leg_blocks, times, stands)
        self.watch.settle()
        # Synchronize: segments and pings -> segments with their pings.
        return self._synchronizer.pop_ready(times.board_newest_s, times.mtx_newest_s, observed_s)

    def _read_foot(self, portion: Portion) -> FootSamples:
        """The foot's samples. When the first chunk shows that a foot board is worn, its clock and its part's noise are used."""
        unknown = self.foot_source.port is None
        samples = self.foot_source.read(portion)
        if unknown and self.foot_source.port == FOOT:
            self.timeline.expect_foot_board()
            self.foot = Foot(self._foot_settings, ICM20649_NOISE)
        return samples

    def _advance_clock(self, times: Times) -> None:
        """Keep the newest time of either port."""
        newest = np.append(times.board_newest_s[-1:], times.mtx_newest_s[-1:])
        if not np.isnan(newest).all():
            self.newest_s = float(np.nanmax(newest))

    def _collect_pings(self, frames: Frames, times: Times) -> None:
        """Hand pings without a bus error, and heights by pressure, to the synchronizer, in order of their messages."""
        ping_row, reports = frames.rows(messages.Ping)
        self.pings += len(ping_row)
        pings = np.zeros(len(ping_row), MEASUREMENT)
        pings["t_s"] = times.board_s[ping_row] + self._ranger.delay_s
        pings["source"] = reports["ranger"]
        pings["ranger_part"] = self._parts_of(frames, ping_row, reports["ranger"])
        usable = ~np.isnan(pings["t_s"]) & (reports["outcome"] != messages.Outcome.BUS_ERROR)
        height_row, samples = frames.rows(messages.Pressure)
        pings["value_m"] = ranges(reports, self._ranger, self.air.speeds(ping_row, height_row, samples))
        height = np.zeros(len(height_row), MEASUREMENT)
        height["t_s"] = times.board_s[height_row]
        height["value_m"] = heights(samples)
        height["source"] = BAROMETER
        valid = ~np.isnan(height["t_s"]) & ~np.isnan(height["value_m"])
        starts = self._barometer.starts(
            height["t_s"][valid], height["value_m"][valid], times.board_restarts[height_row[valid]]
        )
        height["barometer_starts"][valid] = starts
        frame_row = np.concatenate([ping_row[usable], height_row[valid]])
        order = np.argsort(frame_row, kind="stable")
        measurements = np.concatenate([pings[usable], height[valid]])[order]
        self._synchronizer.add_pings(times.board_message_index[frame_row[order]], measurements)

    def _watch_belt(self, frames: Frames, times: Times) -> None:
        """Hand samples of the belt's six axes, with the thigh's forces, to the watch of the wearer."""
        row, samples = frames.rows(messages.Motion)
        timed = ~np.isnan(times.board_s[row])
        row, samples = row[timed], samples[timed]
        if len(row):
            gyro, accel = six_axes(samples, "belt")
            thigh = six_axes(samples, "thigh")[1]
            self.watch.add_belt(times.board_s[row], gyro, accel, thigh, times.board_message_index[row])

    def _parts_of(self, frames: Frames, ping_row: Ints, ranger: Ints) -> Ints:
        """The part (n,) that the board's newest report before each ping names in its ranger's place; 0 before the first."""
        report_row, reports = frames.rows(messages.Parts)
        named = np.column_stack([reports["part_ranger_left"], reports["part_ranger_right"]]).astype(np.int64)
        known = np.concatenate([self._ranger_parts, named])
        self._ranger_parts = known[-1:]
        part: Ints = known[np.searchsorted(report_row, ping_row), ranger]
        return part

    def _track_foot(
        self, samples: FootSamples, leg_blocks: list[tuple[int, GyroBlock]], times: Times, stands: Bools
    ) -> list[tuple[int, list[PathSegment]]]:
        """Segments from the foot odometry, each group with the index of the message that completed it; the belt's gyro corrects their headings.

        `stands` (n,), by message: whether the foot stands; as before these messages, and made anew.
        """
        completed: list[tuple[int, list[PathSegment]]] = []
        blocks = deque(leg_blocks)
        timed = np.flatnonzero(~np.isnan(times.mtx_s))
        if not len(timed):
            self._add_belt(blocks)
            return completed
        t_s, message_index = times.mtx_s[timed], times.mtx_message_index[timed]
        self.watch.add_foot(t_s, samples.gyro[timed], samples.accel[timed], message_index)
        foot = self.foot.track(t_s, samples.accel[timed], samples.gyro[timed], samples.mag[timed])
        newest = np.searchsorted(message_index, np.arange(len(stands)), side="right")
        stands[:] = np.concatenate([stands[-1:], foot.stance])[newest]
        begin = 0
        for event, sample_index in zip(foot.events, foot.sample_index.tolist(), strict=True):
            completed += self._standing_segments(foot, t_s, message_index, begin, sample_index)
            self._add_belt(blocks, int(message_index[sample_index]))
            for aligned in self.alignment.feed([event], float(t_s[sample_index])):
                fused = self.heading_fusion.corrected(aligned)
                if isinstance(fused, Step):
                    segments = [replace(s, belt=self.heading_fusion.evidence) for s in self.path.add_step(fused)]
                else:
                    segments = self.path.add_stance(fused)
                completed.append((int(message_index[sample_index]), segments))
            begin = sample_index
        self._add_belt(blocks)
        return completed + self._standing_segments(foot, t_s, message_index, begin, len(t_s))

    def _add_belt(self, blocks: deque[tuple[int, GyroBlock]], before: float = math.inf) -> None:
        """Hand the gyro blocks that are filled before a message to the heading fusion."""
        while blocks and blocks[0][0] < before:
            self.heading_fusion.add_belt(blocks.popleft()[1])

    def _standing_segments(
        self, foot: FootEvents, t_s: Floats, message_index: Ints, begin: int, end: int
    ) -> list[tuple[int, list[PathSegment]]]:
        """Segments of a standing trunk from the samples [begin, end) between two events."""
        if self.alignment.waiting:
            return []
        still, aloft = (begin + np.flatnonzero(foot.stance[begin:end] == stands) for stands in (True, False))
        pieces = [(still[k], segment) for k, segment in self.path.add_standing(t_s[still], foot.heading_rad[still])]
        pieces += [(aloft[k], segment) for k, segment in self.path.add_flight(t_s[aloft])]
        return [(int(message_index[k]), [segment]) for k, segment in pieces]

    def _merge_paths(
        self, foot_segments: list[tuple[int, list[PathSegment]]], leg_blocks: list[tuple[int, GyroBlock]], times: Times, stands: Bools
    ) -> Floats:  # fmt: skip
        """Merge foot and legs into one path, message by message, and hand its segments to the synchronizer; the foot's to the watch, too.

        Returns, for each message (n,), the time up to which foot or legs have been observed.
        """
        count, next_segment = len(times.mtx_newest_s), 0
        block_index, legs_s, worn = [0], [self.handover.legs_observed_s], [self.handover.is_foot_worn]
        for message_index, block in [*leg_blocks, (count, None)]:
            while next_segment < len(foot_segments) and (
                foot_segments[next_segment][0] < message_index or block is None
            ):
                foot_index, segments = foot_segments[next_segment]
                segments = self.handover.add_foot_segments(segments)
                self._synchronizer.add_segments(foot_index, segments)
                self.watch.add_segments(foot_index, segments)
                next_segment += 1
            if block is not None:
                segments = self.handover.add_leg_block(
                    block, float(times.mtx_newest_s[message_index]), foot_stands=bool(stands[message_index])
                )
                self._synchronizer.add_segments(message_index, segments)
            block_index.append(message_index)
            legs_s.append(self.handover.legs_observed_s)
            worn.append(self.handover.is_foot_worn)
        lengths = np.diff(block_index)
        foot_s = np.where(np.repeat(worn[:-1], lengths), times.mtx_newest_s, -np.inf)
        return np.fmax(foot_s, np.repeat(legs_s[:-1], lengths))


def _board_arrivals(frames: Frames, chunk_row: Ints, t_arrival_ns: Ints) -> Arrivals:
    """The board's messages for the timeline; `chunk_row` (n,): row of the chunk that completed each."""
    ticks = np.ascontiguousarray(frames.body[:, :4]).view("<u4")[:, 0].astype(np.int64)
    kind = np.where(frames.is_timed, PLAIN, SILENT)
    kind[frames.rows(messages.Identity)[0]] = FIRST_MESSAGE
    sync_row, edges = frames.rows(messages.Sync)
    kind[sync_row] = edges["edge"]
    return Arrivals(ticks, chunk_row, t_arrival_ns[chunk_row], kind)
