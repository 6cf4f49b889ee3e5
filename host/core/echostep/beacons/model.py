# SPDX-License-Identifier: MIT
"""Measurement model of a beacon: settings, and their form for kernels.

In: `BeaconSettings`, section [beacons] of the settings. Out: `BeaconModel` in the kernels' units. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True, slots=True)
class BeaconSettings:
    """Errors of a beacon's measurements, and rates of faults.

    `range_sd_m`: a beacon's own error is 5 cm; the rest is the distance from boot to body and the width of the cloud. `bearing_sd_deg`
    [Fischer 2008, 4.1.1]. `range_outliers`, `bearing_outliers`: share of measurements that are uniform over `span_m` and over the circle. `hidden`:
    factor on the share of inliers when a wall is on the line of sight. `drop_sd_m`: standard deviation of a beacon's place about the wearer who
    drops it. `drift_m`: growth of the place's standard deviation per square root of a measurement. `kick_per_m`, `kick_deg`: rate and standard
    deviation of jumps of the heading (a slipping mount; iron near a compass). `tries_per_m`: rate at which particles try such a jump. `step_sd`:
    standard deviation of a move's length on open ground, per square root of a metre. `moved`: prior probability that a beacon was moved.
    """

    range_sd_m: float = 0.4
    bearing_sd_deg: float = 30.0
    range_outliers: float = 0.2
    bearing_outliers: float = 0.05
    hidden: float = 0.1
    span_m: float = 15.0
    drop_sd_m: float = 0.5
    drift_m: float = 0.003
    kick_per_m: float = 0.01
    tries_per_m: float = 0.05
    kick_deg: float = 45.0
    step_sd: float = 0.05
    moved: float = 0.03


class BeaconModel(NamedTuple):
    """The settings as kernels take them: angles in radians, `drop_var_m2` the square of `drop_sd_m`."""

    range_sd_m: float
    bearing_sd_rad: float
    range_outliers: float
    bearing_outliers: float
    hidden: float
    span_m: float
    drop_var_m2: float
    drift_m: float
    kick_per_m: float
    tries_per_m: float
    kick_rad: float
    moved: float


def beacon_model(settings: BeaconSettings) -> BeaconModel:
    """The kernels' form of the settings."""
    return BeaconModel(
        settings.range_sd_m, math.radians(settings.bearing_sd_deg), settings.range_outliers, settings.bearing_outliers,
        settings.hidden, settings.span_m, settings.drop_sd_m**2, settings.drift_m,
        settings.kick_per_m, settings.tries_per_m, math.radians(settings.kick_deg), settings.moved,
    )  # fmt: skip
