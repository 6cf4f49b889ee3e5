"""The intake: chunks -> the trunk's legs, each with the pings that were heard until its end.

In: portions of chunks in order of arrival. Out: `MeasuredSegment`s and `Dropout`s in order of time, as they become certain. Owns the readers, the
timeline, the foot, the path, and the pings and legs that still wait for each other (`waiting`).

What comes out depends on the chunks alone: on their bytes and arrival times, not on how many of them come in one portion, nor on where bytes
that arrived together were cut. Every decision is taken message by message, at the message that makes it possible.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.board.calibration import GyroSettings, RangerSettings, compass_headings, gyro_rates, heights, ranges
from echostep.board.frames import BoardReader, Frames, encode
from echostep.board.health import BoardReports
from echostep.board.messages import (
    BY_ID,
    ROWS,
    Compass,
    Configuration,
    GyroHealth,
    Gyros,
    Identity,
    Outcome,
    Ping,
    Pressure,
    Status,
    Sync,
)
from echostep.foot.alignment import Alignment
from echostep.foot.steps import Foot, FootEvents, FootSettings, Step
from echostep.foot.trunk_path import GaitSettings, TrunkPath
from echostep.legs.heading import CompassErrors
from echostep.legs.trunk_path import GyroBlock, WearerSettings
from echostep.odometry.foot_legs_handover import FootLegsHandover
from echostep.odometry.synchronizer import HEIGHT, Synchronizer
from echostep.path import Dropout, MeasuredSegment, PathSegment
from echostep.ports.chunks import BOARD, GATEWAY, MTX, Chunk, Portion, portion_of
from echostep.timing.timeline import FIRST_WORD, PLAIN, SILENT, Arrivals, MtxTiming, Timeline, Times
from echostep.xsens import MTDATA, MtBatch, MtSample, MtxReader, encode_frame, pack_mtdata

_IDS = {kind: identifier for identifier, kind in BY_ID.items()}
IDENTITY, PING, SYNC, STATUS = (_IDS[kind] for kind in (Identity, Ping, Sync, Status))
PRESSURE, GYROS, COMPASS = (_IDS[kind] for kind in (Pressure, Gyros, Compass))
BLOCK = 20  # gyro samples that go through the legs at a time: a tenth of a second
_WORDS = [_IDS[kind] for kind in (Identity, Configuration, Status, GyroHealth)]
_TIMED = np.array(
    [i in ROWS and (ROWS[i].names or ("",))[0] == "ticks" for i in range(256)]
)  # the body begins with them


@dataclass(slots=True)
class FrontEndCounts:
    """What did not become a leg or a ping, and why."""

    unknown_ports: int = 0
    late_pings: int = 0
    dropped_pings: int = 0
    bad_times: int = 0


class FrontEnd:
    """Feed it every chunk; it returns what the chunks make certain."""

    def __init__(
        self, mtx: MtxTiming, ranger: RangerSettings, foot: FootSettings, gait: GaitSettings,
        wearer: WearerSettings | None = None, gyro: GyroSettings | None = None, iron: CompassErrors | None = None,
    ) -> None:  # fmt: skip
        self.board = BoardReader()
        self.mtx = MtxReader()
        self.timeline = Timeline(mtx)
        self.foot = Foot(foot)
        self.alignment = Alignment()
        self.path = TrunkPath(gait)
        self.status: Status | None = None
        self.identity: Identity | None = None
        self.pings = 0
        self.words = BoardReports()
        self._ranger = ranger
        self.journey = FootLegsHandover(wearer or WearerSettings(), iron)
        self._stride = GyroBlocks(gyro or GyroSettings())
        self._waiting = Synchronizer()
        self._unknown_ports = 0
        self._bad_times = 0
        self.newest_s = math.nan  # how far either port has come

    @property
    def ahead(self) -> tuple[PathSegment, ...]:
        """Legs that the foot has told already, but whose pings are not all in."""
        return self._waiting.legs

    @property
    def counts(self) -> FrontEndCounts:
        """What was not used so far."""
        return FrontEndCounts(self._unknown_ports, self._waiting.late, self._waiting.dropped, self._bad_times)

    def take(self, portion: Portion) -> list[MeasuredSegment | Dropout]:
        """What a portion completes; raises StaleFirmwareError when the board has another schema."""
        self._count_unknown(portion)
        from_board, from_mtx = portion.of(BOARD), portion.of(MTX)
        frames, batch = self.board.frames(from_board.received), self.mtx.feed_batch(from_mtx.received)
        if not len(frames.id) and not len(batch.counter):
            return []
        board = _board_arrivals(frames, from_board.rows_of(frames.end), portion.t_arrival_ns)
        mtx = _mtx_arrivals(batch, from_mtx.rows_of(batch.end), portion.t_arrival_ns)
        times = self.timeline.times(board, mtx)
        self._come(times)
        self._bad_times += int((np.isnan(times.board_s) & (board.kind != SILENT)).sum() + np.isnan(times.mtx_s).sum())
        self._note(frames, times)
        self._hear(frames, times)
        watched_s = self._go(self._follow(batch, times), self._stride.cut(frames, times), times)
        return self._waiting.release(times.board_newest_s, times.mtx_newest_s, watched_s)

    def warm_up(self) -> None:
        """Compile the kernels, so that no chunk waits for it later; leaves the intake as it was."""
        other = FrontEnd(self.timeline.timing, self._ranger, FootSettings(), GaitSettings())
        sample = MtSample(0, (0.0, 0.0, 9.81), (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
        said = Chunk(BOARD, 0, encode(Ping(0, 0, Outcome.ECHO, 5_000), 0))
        other.take(portion_of([said, Chunk(MTX, 0, encode_frame(MTDATA, pack_mtdata(sample)))]))

    def _come(self, times: Times) -> None:
        """How far the time has come."""
        newest = np.append(times.board_newest_s[-1:], times.mtx_newest_s[-1:])
        if not np.isnan(newest).all():
            self.newest_s = float(np.nanmax(newest))

    def _count_unknown(self, portion: Portion) -> None:
        for k, port in enumerate(portion.ports):
            if port not in (BOARD, MTX, GATEWAY):
                self._unknown_ports += int((portion.port == k).sum())

    def _note(self, frames: Frames, times: Times) -> None:
        """Keep the board's last words about itself."""
        for identifier in _WORDS:
            for row in frames.rows(identifier)[1]:
                self.words.take(BY_ID[identifier].unpack(row.tobytes()))
        if (status := _last(frames, times, STATUS)) is not None:
            self.status = Status.unpack(status)
        if (identity := _last(frames, times, IDENTITY)) is not None:
            self.identity = Identity.unpack(identity)

    def _hear(self, frames: Frames, times: Times) -> None:
        """Pings that say something about walls, and heights by pressure, wait for their leg."""
        place, pings = frames.rows(PING)
        self.pings += len(place)
        t_s = times.board_s[place] + self._ranger.delay_s
        kept = ~np.isnan(t_s) & (pings["outcome"] != Outcome.BUS_ERROR)
        rows = np.column_stack([t_s, pings["ranger"], ranges(pings, self._ranger)])[kept]
        aloft, samples = frames.rows(PRESSURE)
        height_m = heights(samples)
        high = ~np.isnan(times.board_s[aloft]) & ~np.isnan(height_m)
        more = np.column_stack([times.board_s[aloft], np.full(len(aloft), HEIGHT), height_m])[high]
        places = np.concatenate([place[kept], aloft[high]])
        order = np.argsort(places, kind="stable")
        self._waiting.hear(times.board_at[places[order]], np.concatenate([rows, more])[order])

    def _go(
        self, by_foot: list[tuple[int, list[PathSegment]]], by_leg: list[tuple[int, GyroBlock]], times: Times
    ) -> Floats:
        """What foot and legs tell goes on one journey, message by message, and waits for its pings.

        Returns up to when somebody watched him, after each message (n,).
        """
        count, foot_at, k = len(times.mtx_newest_s), [at for at, _ in by_foot], 0
        legs_at, legs_s = [0], [self.journey.watched_s]
        for at, block in [*by_leg, (count, None)]:
            while k < len(foot_at) and (foot_at[k] < at or block is None):
                self._waiting.go(foot_at[k], self.journey.foot(by_foot[k][1]))
                k += 1
            if block is not None and (legs := self.journey.legs(block, float(times.mtx_newest_s[at]))):
                self._waiting.go(at, legs)
            legs_at.append(at)
            legs_s.append(self.journey.watched_s)
        return np.fmax(times.mtx_newest_s, np.repeat(legs_s[:-1], np.diff(legs_at)))

    def _follow(self, batch: MtBatch, times: Times) -> list[tuple[int, list[PathSegment]]]:
        """Samples go through the foot to its path: the legs, and the place of the message that tells them."""
        found: list[tuple[int, list[PathSegment]]] = []
        kept = np.flatnonzero(~np.isnan(times.mtx_s))
        if not len(kept):
            return found
        t_s, at = times.mtx_s[kept], times.mtx_at[kept]
        fall = self.foot.track(t_s, batch.accel[kept], batch.gyro[kept], batch.mag[kept])
        begin = 0
        for event, told in zip(fall.events, fall.sample_index.tolist(), strict=True):
            found += self._stand(fall, t_s, at, begin, told)
            for known in self.alignment.feed([event], float(t_s[told])):
                legs = self.path.add_step(known) if isinstance(known, Step) else self.path.add_stance(known)
                found.append((int(at[told]), legs))
            begin = told
        return found + self._stand(fall, t_s, at, begin, len(t_s))

    def _stand(
        self, fall: FootEvents, t_s: Floats, at: Ints, begin: int, end: int
    ) -> list[tuple[int, list[PathSegment]]]:
        """What the samples [begin, end) between two events say of a trunk that stands."""
        if self.alignment.waiting:
            return []
        still = begin + np.flatnonzero(fall.stance[begin:end])
        return [(int(at[still[k]]), [leg]) for k, leg in self.path.add_standing(t_s[still], fall.heading_rad[still])]


class GyroBlocks:
    """Cuts the board's gyro samples into blocks of BLOCK, with the compass read since the sample before; counted from the first one."""

    def __init__(self, gyro: GyroSettings) -> None:
        self._gyro = gyro
        self._rows = np.empty((0, 6))  # t_s, thigh, calf, belt, compass; the place of the message
        self._compass = np.nan

    def cut(self, frames: Frames, times: Times) -> list[tuple[int, GyroBlock]]:
        """The blocks that are full, each with the place of the message that fills it."""
        place, samples = frames.rows(GYROS)
        read, bearings = frames.rows(COMPASS)
        compass = np.full(len(place) + 1, np.nan)
        compass[0] = self._compass
        compass[np.searchsorted(place, read)] = compass_headings(bearings)
        self._compass = compass[-1]
        new = np.column_stack(
            [times.board_s[place], gyro_rates(samples, self._gyro), compass[:-1], times.board_at[place]]
        )
        rows = np.concatenate([self._rows, new[~np.isnan(new[:, 0])]])
        count = len(rows) // BLOCK
        self._rows = rows[count * BLOCK :].copy()
        self._rows[:, 5] = -1.0
        *columns, at = rows[: count * BLOCK].reshape(count, BLOCK, 6).transpose(2, 0, 1)
        blocks = (GyroBlock(*block) for block in zip(*columns, strict=True))
        return list(zip(at[:, -1].astype(np.int64).tolist(), blocks, strict=True))


def _board_arrivals(frames: Frames, row: Ints, t_arrival_ns: Ints) -> Arrivals:
    """The board's messages for the timeline."""
    ticks = np.ascontiguousarray(frames.body[:, :4]).view("<u4")[:, 0].astype(np.int64)
    kind = np.where(_TIMED[frames.id], PLAIN, SILENT)
    kind[frames.id == IDENTITY] = FIRST_WORD
    place, edges = frames.rows(SYNC)
    kind[place] = edges["edge"]
    return Arrivals(ticks, row, t_arrival_ns[row], kind)


def _mtx_arrivals(batch: MtBatch, row: Ints, t_arrival_ns: Ints) -> Arrivals:
    return Arrivals(batch.counter, row, t_arrival_ns[row], np.full(len(row), PLAIN))


def _last(frames: Frames, times: Times, identifier: int) -> bytes | None:
    """Body of the last message with this id and a believable time."""
    place, rows = frames.rows(identifier)
    kept = np.flatnonzero(~np.isnan(times.board_s[place]))
    return rows[kept[-1]].tobytes() if len(kept) else None
