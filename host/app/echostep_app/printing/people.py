# SPDX-License-Identifier: MIT
"""Standard output and standard error of a command, from its first line to its exit status.

In: `to_people` around a command; whether its output is its result, or a view of a run. Out: the faults of both streams, an exit status. Owns
`sys.stdout` and `sys.stderr` meanwhile.

A run (`live`, `record`, `replay`, `demo`, `command`, `export`) calls `outlast_output`: no stream ends, delays or fails it; a fault is told on the
other stream, on the page and in the recording. Any other command whose output is lost ends with status 2, as a compiler does on a full disk; a reader
that had enough (`| head`) is no fault.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from echostep_app.printing.stream import PeopleStream

STREAMS = {"stdout": "standard output", "stderr": "standard error"}
SHOWN_S = 30.0  # a new fault on the page; assumed
GOES_ON = "; the run goes on without it"
_open: list[PeopleStream] = []  # of the command that runs
_outlasting: list[bool] = []  # not empty: a run has begun
_faults: list[str] = []  # of that run, in the order of their time


@contextmanager
def to_people() -> Iterator[None]:
    """Write to people through both streams while the block runs."""
    _fill_closed_files()
    before = {name: getattr(sys, name) for name in STREAMS}
    for stream in filter(None, before.values()):
        if not stream.closed:
            stream.flush()
    streams = [PeopleStream(before[name], words) for name, words in STREAMS.items()]
    _open[:], _outlasting[:], _faults[:] = streams, [], []
    for name, stream in zip(STREAMS, streams, strict=True):
        setattr(sys, name, stream)
    try:
        yield
    finally:
        for stream in streams:
            stream.drain()
        _open.clear()
        for name, old in before.items():
            setattr(sys, name, old)


def outlast_output() -> None:
    """A run begins: no output ends it, delays it, or changes its exit status."""
    _outlasting.append(True)
    for stream, other in zip(_open, reversed(_open), strict=True):
        stream.on_fault = lambda fault, other=other: _tell(other, fault)
        if stream.fault:
            stream.on_fault(stream.fault)
        stream.outlast()


def _tell(other: PeopleStream, fault: str) -> None:
    """Keep a fault, and tell of it on the other stream."""
    _faults.append(fault)
    other.write(f"echostep: {fault}{GOES_ON}\n")
    other.flush()


def output_faults() -> list[str]:
    """Why a stream has taken nothing any more since the run began, in the order of the time."""
    return list(_faults)


class FaultNews:
    """The faults for a view of the run, for a while after each."""

    def __init__(self) -> None:
        self._count, self._end_s = 0, 0.0

    def words(self) -> str:
        """The faults in a sentence; empty when there is nothing new."""
        if len(_faults) > self._count:
            self._count, self._end_s = len(_faults), time.monotonic() + SHOWN_S
        return ". ".join(_faults) if time.monotonic() < self._end_s else ""


def is_unread() -> bool:
    """Whether the reader of standard output has gone: a command that only prints may end."""
    return bool(_open) and _open[0].is_gone


def lost_result() -> str:
    """Why the output of a command is lost, where that is its result; empty where it is not lost, or its reader has gone."""
    if not _open or _outlasting:
        return ""
    _open[0].flush()
    return _open[0].fault if _open[0].has_lost and not _open[0].is_gone else ""


def _fill_closed_files() -> None:
    """Open each closed one of the files 0, 1, 2 on the null device: else the next file that is opened, as a recording, would be standard output."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            while os.open(os.devnull, os.O_RDWR) < number:
                pass
