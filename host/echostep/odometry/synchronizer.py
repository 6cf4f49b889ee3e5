"""Legs and pings that wait for each other.

In: legs and pings as they become known, and how far either port has come after each message. Out: each leg with its pings, once no older ping can
come any more, and seconds of a silent foot. Owns what waits.
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.jit import kernel
from echostep.path import Dropout, MeasuredSegment, PathSegment

PING_AGE_S = 0.1  # a ping is reported this long after its trigger at most
SILENCE_S = 0.5  # a port that is this far behind the other one is not waited for
BLIND_S = 1.0
HEIGHT = 2  # among the rangers: a height by pressure
MAX_WAITING = 4096  # pings; beyond it the oldest are given up and counted


class _State(Protocol):
    pings: int  # that wait
    late: int
    dropped: int
    gone: int  # legs
    gone_s: float  # end of the last leg that has gone
    told_s: float  # of the last silence


_NUMPY = {"float": "f8", "int": "i8"}
_STATE = np.dtype([(name, _NUMPY[kind]) for name, kind in _State.__annotations__.items()])


class Synchronizer:
    """`hear` and `go` take what a portion brought, with the place of the message that brought it; `release` gives what is certain."""

    def __init__(self) -> None:
        self._state = np.zeros(1, _STATE)
        self._state["told_s"] = -math.inf
        self._pings = np.empty((MAX_WAITING + 1, 3))  # t_s, ranger, range_m; oldest first
        self._legs: list[PathSegment] = []
        self._leg_at: list[int] = []
        self._new_at, self._new = np.empty(0, np.int64), np.empty((0, 3))

    @property
    def late(self) -> int:
        """Pings of legs that had gone."""
        return int(self._state["late"][0])

    @property
    def dropped(self) -> int:
        """Pings given up because no leg came."""
        return int(self._state["dropped"][0])

    @property
    def legs(self) -> tuple[PathSegment, ...]:
        """Legs that wait for their pings, in order."""
        return tuple(self._legs)

    def hear(self, at: Ints, pings: Floats) -> None:
        """Pings (n, 3) of t_s, ranger, range_m, or HEIGHT and a height, and the place of each message (n,)."""
        self._new_at, self._new = at, pings

    def go(self, at: int, legs: list[PathSegment]) -> None:
        """Legs that the message at this place made known."""
        self._legs += legs
        self._leg_at += [at] * len(legs)

    def release(
        self, board_newest_s: Floats, mtx_newest_s: Floats, watched_s: Floats
    ) -> list[MeasuredSegment | Dropout]:
        """What is certain after these messages (n,), by how far either port has come with each of them; NaN: it has not spoken yet.

        `watched_s`: up to when foot or legs watched him.
        """
        legs, most = self._legs, len(self._legs) + len(board_newest_s)
        heard = np.empty((3, int(self._state["pings"][0]) + len(self._new)))
        leg, t_s, upto = np.empty(most, np.int64), np.empty(most), np.empty(most, np.int64)
        found = _release(
            self._state[0], self._pings, self._new_at, self._new, np.array(self._leg_at, np.int64),
            np.array([leg.t1_s for leg in legs], np.float64), board_newest_s, mtx_newest_s, watched_s, heard, leg, t_s, upto,
        )  # fmt: skip
        ping_s, ranger, range_m = heard[0], heard[1, : upto[found - 1] if found else 0].astype(np.int64), heard[2]
        pieces: list[MeasuredSegment | Dropout] = []
        begin = gone = 0
        for k, silent_s, end in zip(leg[:found].tolist(), t_s[:found].tolist(), upto[:found].tolist(), strict=True):
            if k < 0:
                pieces.append(Dropout(silent_s))
                continue
            pieces.append(_passage(legs[k], ping_s[begin:end], ranger[begin:end], range_m[begin:end]))
            begin, gone = end, k + 1
        self._new_at, self._new = np.empty(0, np.int64), np.empty((0, 3))
        self._legs, self._leg_at = legs[gone:], [-1] * (len(legs) - gone)
        return pieces


def _passage(leg: PathSegment, t_s: Floats, ranger: Ints, value_m: Floats) -> MeasuredSegment:
    high = ranger == HEIGHT
    if not high.any():
        return MeasuredSegment(leg, t_s, ranger, value_m)
    return MeasuredSegment(leg, t_s[~high], ranger[~high], value_m[~high], value_m[high])


@kernel
def _release(
    s: _State, waiting: Floats, ping_at: Ints, pings: Floats, leg_at: Ints, leg_s: Floats, board_newest_s: Floats, mtx_newest_s: Floats,
    watched_s: Floats, heard: Floats, leg: Ints, t_s: Floats, upto: Ints,
) -> int:  # fmt: skip
    """Message by message: take in its ping, send off every leg that is complete, tell a silence.

    Fills the columns of pings that have gone with their legs, and for each leg (its index) or silence (-1) its time and how many of them
    have gone; returns how many legs and silences there were.
    """
    found = next_ping = next_leg = out = 0
    for at in range(len(board_newest_s)):
        while next_ping < len(ping_at) and ping_at[next_ping] == at:
            _push(s, waiting, pings[next_ping])
            next_ping += 1
        board, mtx = board_newest_s[at], mtx_newest_s[at]
        complete_s = -np.inf if np.isnan(board) else board - PING_AGE_S
        complete_s = complete_s if np.isnan(mtx) else max(complete_s, mtx - SILENCE_S)
        while next_leg < len(leg_s) and leg_at[next_leg] <= at and leg_s[next_leg] <= complete_s:
            out = _pop(s, waiting, leg_s[next_leg], heard, out)
            s.gone += 1
            s.gone_s = max(s.gone_s, leg_s[next_leg])
            leg[found], t_s[found], upto[found] = next_leg, leg_s[next_leg], out
            next_leg += 1
            found += 1
        if s.gone and board - max(watched_s[at], s.told_s) >= BLIND_S:
            s.told_s = board
            leg[found], t_s[found], upto[found] = -1, board, out
            found += 1
    return found


@kernel
def _push(s: _State, waiting: Floats, ping: Floats) -> None:
    """A ping joins those that wait, behind all that are not younger; too late, or one too many, and one is given up."""
    if ping[0] < s.gone_s:
        s.late += 1
        return
    k = s.pings
    while k > 0 and waiting[k - 1, 0] > ping[0]:
        waiting[k] = waiting[k - 1]
        k -= 1
    waiting[k] = ping
    s.pings += 1
    if s.pings > MAX_WAITING:
        waiting[:-1] = waiting[1:].copy()
        s.pings -= 1
        s.dropped += 1


@kernel
def _pop(s: _State, waiting: Floats, until_s: float, heard: Floats, out: int) -> int:
    """Pings up to a time go."""
    n = 0
    while n < s.pings and waiting[n, 0] <= until_s:
        heard[:, out + n] = waiting[n]
        n += 1
    for k in range(n, s.pings):
        waiting[k - n] = waiting[k]
    s.pings -= n
    return out + n
