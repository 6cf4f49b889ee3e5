# SPDX-License-Identifier: MIT
"""Stages between a source of chunks and the tracker: pacing, check-ins, recording, grouping into portions.

In: chunks in order of arrival; None where a live port delivered nothing for a while. Out: the same chunks with check-ins among them, and portions.
Owns nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from typing import TYPE_CHECKING

from echostep.interruption import sleep
from echostep.ports.chunks import Chunk, Portion, portion_of
from echostep.ports.people.check_in import PERSON
from echostep.ports.people.meeting import MEETING
from echostep.ports.people.team_beacons import TEAM_BEACONS
from echostep.ports.people.teammate import TEAM
from echostep.recording.recorder import Recorder
from echostep.session.console import print_notices

if TYPE_CHECKING:
    from echostep.page.live import LivePage
    from echostep.session.team.team_feed import TeamFeed
    from echostep.session.team.teammate_feed import TeammateFeed

LEAST_SLEEP_S = 0.02  # shorter waits are not worth a system call per chunk


def paced(chunks: Iterable[Chunk], speed: float) -> Iterator[Chunk]:
    """Delay chunks so that they come at most `speed` times as fast as they arrived."""
    start_s, first_ns = time.monotonic(), None
    for chunk in chunks:
        first_ns = chunk.t_arrival_ns if first_ns is None else first_ns
        early_s = (chunk.t_arrival_ns - first_ns) * 1e-9 / speed - (time.monotonic() - start_s)
        if early_s > LEAST_SLEEP_S:
            sleep(early_s)
        yield chunk


ArrivalNs = Callable[[Chunk | None], int]  # arrival time of what comes after a chunk


def with_check_ins(
    chunks: Iterable[Chunk | None], page: LivePage | None, arrival_ns: ArrivalNs
) -> Iterator[Chunk | None]:
    """Insert each check-in of the page."""
    return _with(chunks, PERSON, page.pop_check_ins if page else tuple, arrival_ns)


def with_team(chunks: Iterable[Chunk | None], feed: TeamFeed | None, arrival_ns: ArrivalNs) -> Iterator[Chunk | None]:
    """Insert the newest place of another wearer."""
    return _with(chunks, TEAM, feed.pop if feed else tuple, arrival_ns)


def with_teammates(
    chunks: Iterable[Chunk | None], page: LivePage | None, feed: TeammateFeed | None, arrival_ns: ArrivalNs
) -> Iterator[Chunk | None]:
    """Insert each meeting entered on a page, with the teammate's newest report, and the beacons shared by teammates."""

    def told() -> Iterator[bytes]:
        for name in page.pop_meetings() if page and feed else ():
            if feed and (payload := feed.meeting(name)):
                yield payload

    met = _with(chunks, MEETING, told, arrival_ns)
    return _with(met, TEAM_BEACONS, feed.beacons if feed else tuple, arrival_ns)


def _with(
    chunks: Iterable[Chunk | None], port: str, pop: Callable[[], Iterable[bytes]], arrival_ns: ArrivalNs
) -> Iterator[Chunk | None]:
    """Insert payloads that arrived since the previous chunk, as chunks of a port after that chunk."""
    for chunk in chunks:
        yield chunk
        for payload in pop():
            yield Chunk(port, arrival_ns(chunk), payload)


def recorded(
    chunks: Iterable[Chunk | None], recorder: Recorder, *, wait_for_disk: bool = False
) -> Iterator[Chunk | None]:
    """Write each chunk before it is passed on. `wait_for_disk`: for sources that can be slowed down."""
    for chunk in chunks:
        if chunk is not None:
            recorder.write(chunk)
            if wait_for_disk:
                recorder.wait_for_disk(chunk)
        print_notices(recorder.notices)
        yield chunk


def portions_of(chunks: Iterable[Chunk | None], size: int) -> Iterator[Portion]:
    """Portions of `size` chunks; with 1, no chunk waits for the next. A None gives no row, so a portion may be empty."""
    remaining = iter(chunks)
    while batch := list(islice(remaining, size)):
        yield portion_of([chunk for chunk in batch if chunk is not None])
