# SPDX-License-Identifier: MIT
"""The methods that the study compares: that of [Lee 2010], the default by dead reckoning and on the plan; floors by pressure [Lee 2010].

In: `MeasuredWalk`, the start. Out: `MethodTrack`s, floors. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import StrideSettings
from echostep.legs.trunk_path import WearerSettings
from echostep.plan import Plan, Pose
from echostep.ports.chunks import Chunk, portion_of
from echostep.settings import Settings
from echostep.tracker import Tracker
from echostep_app.offline.leg_track import track_default
from echostep_simulation.people.walker import walk
from echostep_studies.lee2010.walks import STOREY_M, STOREYS, MeasuredWalk, chunks_of, measure, person_of, storeys
from echostep_studies.papers import lee2010

CALIBRATION_M = 10.0
PORTION = 1000
KNOWN_S = 2.0  # of standing on the floor where the walk begins: its pressure is the reference


@dataclass(frozen=True, slots=True)
class MethodTrack:
    """A method's track (n, 3) t_s, x, y from the true start on, and the distance walked that it reports."""

    track: Floats
    distance_m: float


def by_lee(measured: MeasuredWalk, start: tuple[float, float, float]) -> MethodTrack:
    """The paper's method: its equations at 10 Hz."""
    s = measured.samples
    settings = lee2010.LeeSettings(legs=lee2010.Lee2010Legs(measured.segments.thigh_m, measured.segments.shank_m))
    walker = lee2010.Walker(settings)
    walker.heading = lee2010.Fused(start[2], 0.0)
    rows = walker.feed(s.t_s, s.thigh, s.shank, s.belt, s.compass)
    return MethodTrack(np.column_stack([rows[:, 0], rows[:, 4] + start[0], rows[:, 5] + start[1]]), float(rows[-1, 1]))


def by_default(measured: MeasuredWalk, start: tuple[float, float, float]) -> MethodTrack:
    """The default method: strides and fused heading by dead reckoning."""
    rows = track_default(measured.samples, StrideSettings(measured.segments), start[2]).rows[::20]
    return MethodTrack(np.column_stack([rows[:, 0], rows[:, 4] + start[0], rows[:, 5] + start[1]]), float(rows[-1, 1]))


def scale_of(segments: LegLengths, seed: int) -> float:
    """What `echostep calibrate` finds of this person on 10 m straight on."""
    walked = walk(((0.0, 0.0), (CALIBRATION_M, 0.0)), person_of(seed), np.random.default_rng([seed, 36]))
    measured = measure(chunks_of(walked, storeys()[:1], seed), seed)
    return CALIBRATION_M / float(track_default(measured.samples, StrideSettings(segments), 0.0).rows[-1, 1])


def with_plan(
    plan: Plan, chunks: Sequence[Chunk], measured: MeasuredWalk, start: tuple[float, float, float], seed: int
) -> MethodTrack:
    """The default method on the plan: the tracker on the board's bytes, with legs and pings, without foot."""
    scale = scale_of(measured.segments, seed)
    wearer = WearerSettings(measured.segments.thigh_m, measured.segments.shank_m, scale)
    tracker = Tracker(plan, Pose(*start), Settings(wearer=wearer), seed)
    portions = (portion_of(chunks[k : k + PORTION]) for k in range(0, len(chunks), PORTION))
    track = np.array([(e.t_s, e.x_m, e.y_m) for portion in portions for e in tracker.take(portion)])
    return MethodTrack(track, float(np.hypot(*np.diff(track[:, 1:], axis=0).T).sum()))


METHODS = {"lee2010": by_lee, "default": by_default}


def floors_of(pressure: Floats) -> Floats:
    """(n, 2) t_s and number of the floor from 0, by the paper's rule, when the first reading's floor is known: the highest."""
    heights = [k * STOREY_M for k in range(STOREYS)]
    reference = float(np.median(pressure[pressure[:, 0] < pressure[0, 0] + KNOWN_S, 1]))
    floors = [lee2010.floor_of(p, heights, reference, STOREYS - 1) for p in pressure[:, 1].tolist()]
    return np.column_stack([pressure[:, 0], floors])
