# SPDX-License-Identifier: MIT
"""The papers' methods on recorded feet and legs: `echostep foot --profile fischer2008`, `echostep legs --profile lee2010`.

In: a recorded foot IMU, samples of one leg. Out: their tracks. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.foot.steps import Track
from echostep.legs import swing_detection as leg_swings
from echostep.legs.stride import StrideSettings
from echostep.offline.imu_csv import Imu
from echostep_app.offline.leg_csv import LegSamples
from echostep_app.offline.leg_track import LegTrack, belt_sign, source_of
from echostep_app.printing.console import console
from echostep_simulation.devices.onboard_filter import orientations
from echostep_studies.papers import fischer2008, lee2010


def track_fischer2008(imu: Imu, name: str) -> Track:
    """The paper's method. It needs the MTx's rotation matrices, which no CSV holds: they come from a model of the MTx's filter."""
    if imu.mag is None:
        console.print(f"{name}: no columns mx,my,mz: the MTx's filter is modelled without its magnetometer.")
    good = fischer2008.usable(imu.t_s, imu.accel, imu.gyro)[0]
    matrices = np.full((len(imu.t_s), 3, 3), np.nan)
    mag = None if imu.mag is None else imu.mag[good]
    matrices[good] = orientations(imu.t_s[good], imu.accel[good], imu.gyro[good], mag)
    return fischer2008.walk_track(imu.t_s, imu.accel, imu.gyro, matrices)


def track_lee2010(samples: LegSamples, settings: StrideSettings) -> LegTrack:
    """The method of Lee and Lee 2010 at 10 Hz; the sign of each gyro is found by `Swings`."""
    rates = np.column_stack([samples.thigh, samples.shank])
    swings = leg_swings.Swings()
    watched_s = np.cumsum(np.minimum(np.diff(samples.t_s, prepend=samples.t_s[0]), lee2010.LONGEST_GAP_S))
    grid = np.arange(0.0, watched_s[-1], 1.0 / leg_swings.GRID_HZ)
    even = np.column_stack([np.interp(grid, watched_s, column) for column in rates.T])
    thigh, shank = swings.sign if swings.decide(even, final=True) else (1.0, 1.0)
    sign, sign_notes = belt_sign(samples)
    lee = lee2010.LeeSettings(legs=lee2010.Lee2010Legs(settings.segments.thigh_m, settings.segments.shank_m))
    walker = lee2010.Walker(lee)
    if np.isnan(samples.compass).all():
        walker.heading = lee2010.Fused(0.0, 0.0)
    belt = np.where(np.isnan(samples.belt), 0.0, sign * samples.belt)
    rows = walker.feed(samples.t_s, thigh * samples.thigh, shank * samples.shank, belt, samples.compass)
    return LegTrack(rows, (), None, source_of(samples), math.sqrt(walker.heading.variance), sign_notes)
