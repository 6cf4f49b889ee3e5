# SPDX-License-Identifier: MIT
"""Simulated walks of the trails of [Fischer 2008], the tracks that the methods compute from them, and the errors of these tracks.

In: a trail, a seed, the name of a method. Out: `JudgedTrack`. Owns nothing. The track begins at the true first position and heading of the foot;
nothing else of the truth is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.foot.steps import Track, walk_track
from echostep_app.simulation.devices.mtx import MtxSamples
from echostep_app.simulation.people.walker import RATE_HZ, Walk
from echostep_studies.papers import fischer2008

RATES_HZ = (100, 50)  # of the MTx
METHODS = ("fischer2008", "default")


@dataclass(frozen=True, slots=True)
class JudgedTrack:
    """One method on one walk, judged whenever the foot is about to leave the ground: `places_m` (k, 2) on the map, what is wrong with them."""

    places_m: Floats
    errors_m: Floats
    heading_errors_rad: Floats
    distance_m: float
    true_distance_m: float


def track(samples: MtxSamples, profile: str) -> Track:
    """What a method makes of the samples."""
    if profile == "fischer2008":
        return fischer2008.walk_track(samples.t_s, samples.accel, samples.gyro, samples.orientation)
    return walk_track(samples.t_s, samples.accel, samples.gyro, mag=samples.mag)


def judge(track: Track, walked: Walk) -> JudgedTrack:
    """Compare a track with the walk that it was made of."""
    leaves = np.flatnonzero(walked.flat[:-1] & ~walked.flat[1:])
    leaves = np.append(leaves, int(track.t_s[-1] * RATE_HZ))
    at = np.minimum(np.searchsorted(track.t_s, leaves / RATE_HZ), len(track.t_s) - 1)
    yaw = walked.foot_rpy_rad[:, 2]
    c, s = math.cos(yaw[0]), math.sin(yaw[0])
    places = track.position_m[at, :2] @ np.array([[c, s], [-s, c]]) + walked.foot_m[0, :2]
    true = walked.foot_m[leaves, :2]
    turned = track.heading_rad[at] - (yaw[leaves] - yaw[0])
    return JudgedTrack(
        places,
        np.hypot(*(places - true).T),
        np.abs(np.angle(np.exp(1j * turned))),
        sum(math.hypot(*step.move_m[:2]) for step in track.steps),
        float(np.hypot(*np.diff(true, axis=0).T).sum()),
    )
