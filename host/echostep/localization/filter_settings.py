# SPDX-License-Identifier: MIT
"""The settings of the map filter's parts, and the echo models that follow from them.

In: nothing. Out: `FilterSettings`, `EchoModel`s. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from echostep.localization.beacon_model import BeaconSettings
from echostep.localization.echo_likelihood import EchoModel, EchoSettings, echo_model
from echostep.localization.level_changes import ClimbSettings
from echostep.localization.particles import CloudSettings


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """Settings of the filter's parts."""

    cloud: CloudSettings = field(default_factory=CloudSettings)
    echo: EchoSettings = field(default_factory=EchoSettings)
    climb: ClimbSettings = field(default_factory=ClimbSettings)
    beacons: BeaconSettings = field(default_factory=BeaconSettings)
    plan_sd_m: float = 0.0  # of the walls' positions, per axis


def echo_models(s: FilterSettings) -> tuple[EchoModel, EchoModel]:
    """The echo model with the plan's error, and the one for scattered clouds."""
    echo = with_plan_error(s)
    return echo_model(echo), echo_model(replace(echo, sd_m=math.hypot(echo.sd_m, s.cloud.rough_m)))


def with_plan_error(s: FilterSettings) -> EchoSettings:
    """The settings of the echoes, with the error of the plan's walls in that of the ranges."""
    return replace(s.echo, sd_m=math.hypot(s.echo.sd_m, s.plan_sd_m))
