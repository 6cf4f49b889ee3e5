# SPDX-License-Identifier: MIT
"""Copies of a tracker's state for views, and where a run ended.

In: the newest estimate; the cloud. Out: `TrackerState`, `StreamState`, `ParticleSnapshot`, `LastPlace`. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.aiding import MeetingNews
from echostep.arrays import Floats, Ints
from echostep.board.frames import FrameCounts
from echostep.board.gateway import GatewayCounts
from echostep.board.messages import Identity, Status
from echostep.board.reports import BoardReports
from echostep.height.levels import Air
from echostep.localization import Estimate, MapFilter, TrackStatus
from echostep.odometry import Alarm, FrontEndCounts
from echostep.particles.kernels import systematic
from echostep.path import PathSegment
from echostep.ports.people.team_beacons import SharedBeacon
from echostep.xsens.reader import MtxCounts


@dataclass(frozen=True, slots=True)
class TrackerState:
    """The tracker after the newest chunk.

    `last_segment` belongs to `estimate`; `pending_segments` follow it and wait for their pings. `right`: probability that the wearer is where the
    cloud is, NaN before the first segment; `searches`: the whole building is searched. `beacon_numbers`: by slot. `beacon_heard_s`: time of the
    newest reading that the filter used. `waits_for_start`: neither a start nor a check-in is known yet.
    `undoable`: number of the check-in that can be undone. `alarm`: the wearer's, None while all is well. `met`: the newest meeting with a teammate;
    `meetings`: their number by name of the effect. `team_beacons`: beacons placed by each teammate; `team_beacon_messages`: number of
    messages believed, and bad.
    """

    estimate: Estimate | None
    last_segment: PathSegment | None
    pending_segments: tuple[PathSegment, ...]
    waits_for_start: bool
    undoable: int | None
    check_ins: int
    undone: int
    bad_check_ins: int
    particle_count: int
    right: float
    searches: bool
    beacon_numbers: tuple[int, ...]
    beacon_heard_s: float | None
    alarm: Alarm | None
    met: MeetingNews | None
    meetings: dict[str, int]
    team_beacons: dict[str, tuple[SharedBeacon, ...]]
    team_beacon_messages: dict[str, int]


@dataclass(frozen=True, slots=True)
class StreamState:
    """Counts of each input stream since the start, and the newest reports of the board.

    `status`, `identity`: the newest with a plausible time. `synchronised`: SyncOut edges time the MTx samples. `mtx`: also of a foot board's samples;
    `foot_reports`: a foot board's reports about itself, None if an MTx is worn.
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
    foot_reports: BoardReports | None

    @property
    def foot_name(self) -> str:
        """Name of the device worn on the foot."""
        return "MTx" if self.foot_reports is None else "foot board"


@dataclass(frozen=True, slots=True)
class ParticleSnapshot:
    """n particles: `x_m`, `y_m` (n,) in the map, `level` (n,) index in the plan, `log_weight` (n,), 0 for the heaviest of all particles."""

    x_m: Floats
    y_m: Floats
    level: Ints
    log_weight: Floats

    @classmethod
    def of(cls, tracked: MapFilter, most: int) -> ParticleSnapshot:
        """A copy of the particles of the tracked cloud; `most` by weight, if there are more."""
        cloud, log_weight = tracked.cloud, tracked.cloud.log_weight.copy()
        if len(log_weight) <= most:
            return cls(cloud.map_x_m.copy(), cloud.y_m.copy(), cloud.level.copy(), log_weight)
        chosen = systematic(cloud.weight, 0.5, most)
        return cls(cloud.map_x_m[chosen], cloud.y_m[chosen], cloud.level[chosen], np.zeros(most))


@dataclass(frozen=True, slots=True)
class LastPlace:
    """A place (m) on a level that the tracker was sure of, `sd_m` its standard deviation per axis; `air`: of the barometer that was worn."""

    x_m: float
    y_m: float
    sd_m: float
    level: int
    air: Air | None = None


def last_place(estimate: Estimate | None, air: Air | None) -> LastPlace | None:
    """The place of an estimate; None unless its status is `tracking`."""
    if estimate is None or estimate.status is not TrackStatus.TRACKING:
        return None
    sd_m = math.sqrt(0.5 * (estimate.xx_m2 + estimate.yy_m2))
    return LastPlace(estimate.x_m, estimate.y_m, sd_m, estimate.level, air)
