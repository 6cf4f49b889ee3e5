# SPDX-License-Identifier: MIT
"""The settings of the map filter's parts, and the echo models that follow from them.

In: nothing. Out: `FilterSettings`, `EchoModel`s. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

from echostep.echoes.likelihood import EchoModel, EchoSettings, echo_model
from echostep.echoes.range_table import TABLE_SD_M
from echostep.height.levels import ClimbSettings

UNPLANNED_DOOR = -6.0  # log-probability (1 in 400) that a path crosses a wall of the plan


@dataclass(frozen=True, slots=True)
class CloudSettings:
    """Size of the cloud, spread of a start whose errors are not stated, and noise that the path's own covariance leaves out.

    `step_sd`: of a move's length, per square root of a metre, twice a foot's; `turn_sd_deg`, `scale_sd`: drift of the walk frame's rotation
    and of the lengths, likewise. `start_scale_sd`, `scale_sd`: of nine walks with surveyed or captured feet. `resample_below`: effective share of
    the cloud at which it is resampled (systematic). The size follows the spread [Fox 2003, KLD-sampling]: enough particles that the distribution
    over cells of `cell_m`, `cell_m`, `cell_deg` is met within `kld`, at least `size`, at most `largest`. A scattered cloud is roughened by
    `rough_m` and `rough_deg` until it has contracted.
    `wall_cost`: log-weight that crossing a wall costs. `rescue_sd_m`: widening of a cloud that crossed a wall as a whole.
    """

    size: int = 660
    largest: int = 20_000
    kld: float = 0.15
    cell_m: float = 0.1
    cell_deg: float = 5.0
    start_sd_m: float = 0.15
    start_turn_sd_deg: float = 5.0
    start_scale_sd: float = 0.01
    step_sd: float = 0.02
    turn_sd_deg: float = 0.3
    scale_sd: float = 0.001
    resample_below: float = 0.5
    wall_cost: float = -UNPLANNED_DOOR
    rescue_sd_m: float = 0.5
    rough_m: float = 0.1
    rough_deg: float = 2.0

    def __post_init__(self) -> None:
        """Raise ValueError for a cloud without particles."""
        if not 1 <= self.size <= 10_000_000:
            raise ValueError(f"size: {self.size} particles make no cloud")
        for name in ("kld", "cell_m", "cell_deg"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"{name}: must be greater than 0")


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """Settings of the filter's parts."""

    cloud: CloudSettings = field(default_factory=CloudSettings)
    echo: EchoSettings = field(default_factory=EchoSettings)
    climb: ClimbSettings = field(default_factory=ClimbSettings)
    plan_sd_m: float = 0.0  # of the walls' positions, per axis


def echo_models(s: FilterSettings) -> tuple[EchoModel, EchoModel]:
    """The echo model with the plan's error, and the one for scattered clouds."""
    echo = with_plan_error(s)
    return echo_model(echo), echo_model(replace(echo, sd_m=math.hypot(echo.sd_m, s.cloud.rough_m)))


def with_plan_error(s: FilterSettings) -> EchoSettings:
    """The settings of the echoes, with the error of the plan's walls in the error of the ranges."""
    return replace(s.echo, sd_m=math.hypot(s.echo.sd_m, s.plan_sd_m))


def inexact(s: FilterSettings) -> EchoSettings:
    """The settings of the echoes with the error of a table of ranges."""
    return replace(s.echo, sd_m=math.hypot(s.echo.sd_m, s.plan_sd_m, TABLE_SD_M))
