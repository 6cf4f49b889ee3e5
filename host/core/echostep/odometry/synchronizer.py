# SPDX-License-Identifier: MIT
"""Synchronizer: joins each path segment with the pings that were triggered on it.

In: segments and pings in order of their messages, and the newest time of either port after each message. Out: each segment with its pings, once no
older ping can arrive; a `Dropout` for each second without any observation. Owns the pings and segments that wait.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from echostep.arrays import Floats, Ints, Records, record_dtype
from echostep.jit import kernel, part
from echostep.path import Dropout, MeasuredSegment, PathSegment

PING_AGE_S = 0.1  # longest time from the trigger of a ping to its report: a cycle of both rangers takes 71 ms [faults/health.py, PINGS_HZ]
SILENCE_S = 0.5  # a port that lags the other one by more is not waited for, assumed
BLIND_S = 1.0  # time without any observation that makes a dropout: twice a standing segment [path.STANDING_PIECE_S]
# Pings and heights that wait; beyond it the oldest are dropped and counted: nearly two minutes of both
MAX_WAITING = 4096
BAROMETER = 2  # as the source of a measurement
DROPOUT = -1  # in the segment column of the output: a dropout, no segment


class _Measurement(Protocol):
    t_s: float
    value_m: float  # range of a ping, NaN without an echo, or height by pressure
    source: int  # ranger of a ping (0 looks left, 1 right), or BAROMETER
    ranger_part: int  # of a ping: kind of its ranger; 0: not named
    barometer_starts: int  # of a height: how often the heights have begun again before it


MEASUREMENT = record_dtype(_Measurement)


class _State(Protocol):
    pings: int  # that wait
    late: int
    dropped: int
    popped: int  # segments since the start
    popped_s: float  # end of the last segment that was popped
    dropout_s: float  # time of the last dropout


_STATE = record_dtype(_State)


class _NewPings(NamedTuple):
    """Pings and heights (k,), and the index (k,) of the message that brought each."""

    message_index: Ints
    measurement: Records


NO_PINGS = _NewPings(np.empty(0, np.int64), np.empty(0, MEASUREMENT))


class _WaitingSegments(NamedTuple):
    """End (m,) of each segment that waits, and the index (m,) of the message that completed it; -1: of an earlier portion."""

    message_index: Ints
    end_s: Floats


class _Progress(NamedTuple):
    """For each message (n,): newest time of the board and of the MTx, and the time up to which foot or legs have been observed."""

    board_s: Floats
    mtx_s: Floats
    observed_s: Floats


class _Popped(NamedTuple):
    """Output: `measurement` (k,), all popped pings; columns by segment or dropout: `segment`, `t_s`, `ping_end` (pings popped by then)."""

    measurement: Records
    segment: Ints
    t_s: Floats
    ping_end: Ints


class Synchronizer:
    """For each portion call `add_pings` and `add_segments`, then `pop_ready`. Messages are counted from the start of the portion."""

    def __init__(self, ahead_rad: float = 0.0) -> None:
        """`ahead_rad`: how far both rangers look ahead of abeam."""
        self._ahead_rad = ahead_rad
        self._state = np.zeros(1, _STATE)
        self._state["dropout_s"] = -math.inf
        self._waiting = np.empty(MAX_WAITING + 1, MEASUREMENT)  # oldest first
        self._segments: list[PathSegment] = []
        self._completed_by: list[int] = []  # message index of each segment
        self._new = NO_PINGS

    @property
    def late(self) -> int:
        """Pings older than the last segment that was popped."""
        return int(self._state["late"][0])

    @property
    def dropped(self) -> int:
        """Pings dropped because no segment came."""
        return int(self._state["dropped"][0])

    @property
    def segments(self) -> tuple[PathSegment, ...]:
        """Segments that wait for their pings, in order of time."""
        return tuple(self._segments)

    def add_pings(self, message_index: Ints, pings: Records) -> None:
        """Pings and heights (n,), MEASUREMENT, with the index (n,) of the message of each."""
        self._new = _NewPings(message_index, pings)

    def add_segments(self, message_index: int, segments: list[PathSegment]) -> None:
        """Segments that one message completed."""
        self._segments += segments
        self._completed_by += [message_index] * len(segments)

    def pop_ready(
        self, board_newest_s: Floats, mtx_newest_s: Floats, observed_s: Floats
    ) -> list[MeasuredSegment | Dropout]:
        """Segments and dropouts that are certain after these messages (n,), by the newest time of each port after each; NaN: no message yet.

        `observed_s` (n,): time up to which foot or legs have been observed.
        """
        segments, most = self._segments, len(self._segments) + len(board_newest_s)
        popped = _Popped(
            np.empty(int(self._state["pings"][0]) + len(self._new.measurement), MEASUREMENT),
            np.empty(most, np.int64),
            np.empty(most),
            np.empty(most, np.int64),
        )
        waiting = _WaitingSegments(
            np.array(self._completed_by, np.int64), np.array([segment.t1_s for segment in segments], np.float64)
        )
        progress = _Progress(board_newest_s, mtx_newest_s, observed_s)
        count = _pop_ready(self._state[0], self._waiting, self._new, waiting, progress, popped)
        done = int(np.sum(popped.segment[:count] != DROPOUT))
        self._segments, self._completed_by = segments[done:], [-1] * (len(segments) - done)
        self._new = NO_PINGS
        return _pieces(segments, popped, count, self._ahead_rad)


def _pieces(
    segments: list[PathSegment], popped: _Popped, count: int, ahead_rad: float
) -> list[MeasuredSegment | Dropout]:
    """The first `count` rows of the output columns as objects."""
    pieces: list[MeasuredSegment | Dropout] = []
    begin = 0
    columns = (popped.segment[:count].tolist(), popped.t_s[:count].tolist(), popped.ping_end[:count].tolist())
    for segment, dropout_s, end in zip(*columns, strict=True):
        if segment == DROPOUT:
            pieces.append(Dropout(dropout_s))
        else:
            pieces.append(_measured(segments[segment], popped.measurement[begin:end], ahead_rad))
            begin = end
    return pieces


def _measured(segment: PathSegment, measurements: Records, ahead_rad: float) -> MeasuredSegment:
    """A segment with its pings, and separately the heights since their newest beginning."""
    is_ping = measurements["source"] != BAROMETER
    ranger_part, heights = measurements["ranger_part"][is_ping], measurements[~is_ping]
    starts = int(heights["barometer_starts"][-1]) if len(heights) else 0
    return MeasuredSegment(
        segment,
        measurements["t_s"][is_ping],
        measurements["source"][is_ping],
        measurements["value_m"][is_ping],
        heights["value_m"][heights["barometer_starts"] == starts],
        int(ranger_part[-1]) if len(ranger_part) else 0,
        starts,
        ahead_rad,
    )


@kernel
def _pop_ready(
    s: _State, waiting: Records, new: _NewPings, segments: _WaitingSegments, progress: _Progress, popped: _Popped
) -> int:
    """Message by message: add its pings, pop every segment that is complete, report a dropout.

    Fills `popped`; returns the number of segments and dropouts in it.
    """
    count = next_ping = next_segment = pings = 0
    for message_index in range(len(progress.board_s)):
        while next_ping < len(new.message_index) and new.message_index[next_ping] == message_index:
            _push(s, waiting, new.measurement[next_ping])
            next_ping += 1
        board, mtx = progress.board_s[message_index], progress.mtx_s[message_index]
        complete_s = -np.inf if np.isnan(board) else board - PING_AGE_S
        complete_s = complete_s if np.isnan(mtx) else max(complete_s, mtx - SILENCE_S)
        while (
            next_segment < len(segments.end_s)
            and segments.message_index[next_segment] <= message_index
            and segments.end_s[next_segment] <= complete_s
        ):
            end_s = segments.end_s[next_segment]
            pings = _pop(s, waiting, end_s, popped.measurement, pings)
            s.popped += 1
            s.popped_s = max(s.popped_s, end_s)
            popped.segment[count], popped.t_s[count], popped.ping_end[count] = next_segment, end_s, pings
            next_segment += 1
            count += 1
        if s.popped and board - max(progress.observed_s[message_index], s.dropout_s) >= BLIND_S:
            s.dropout_s = board
            popped.segment[count], popped.t_s[count], popped.ping_end[count] = DROPOUT, board, pings
            count += 1
    return count


@part
def _push(s: _State, waiting: Records, ping: _Measurement) -> None:
    """Insert a ping by time, after equal ones. A ping older than the last popped segment is late; beyond MAX_WAITING the oldest is dropped."""
    if ping.t_s < s.popped_s:
        s.late += 1
        return
    k = s.pings
    while k > 0 and waiting[k - 1].t_s > ping.t_s:
        waiting[k] = waiting[k - 1]
        k -= 1
    waiting[k] = ping
    s.pings += 1
    if s.pings > MAX_WAITING:
        s.pings -= 1
        for k in range(s.pings):
            waiting[k] = waiting[k + 1]
        s.dropped += 1


@part
def _pop(s: _State, waiting: Records, until_s: float, popped: Records, count: int) -> int:
    """Move the pings up to a time to `popped` (n,) from `count` on; returns the new count."""
    n = 0
    while n < s.pings and waiting[n].t_s <= until_s:
        popped[count + n] = waiting[n]
        n += 1
    for k in range(n, s.pings):
        waiting[k - n] = waiting[k]
    s.pings -= n
    return count + n
