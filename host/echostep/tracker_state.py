"""What a tracker publishes: immutable values that views read instead of the tracker's parts.

In: the parts of a `Tracker`, read by its properties. Out: `TrackerState`, `StreamState`, `Particles`. Owns nothing: all of it is
copied.
"""

from __future__ import annotations

from dataclasses import dataclass

from echostep.arrays import Floats, Ints
from echostep.board.findings import BoardReports
from echostep.board.frames import FrameCounts
from echostep.board.gateway import GatewayCounts
from echostep.board.messages import Identity, Status
from echostep.localization.estimate import Estimate
from echostep.odometry.front_end import FrontEndCounts
from echostep.path import PathSegment
from echostep.xsens.reader import MtxCounts


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
