"""log p(echo | pose): one function, cited, for the cloud to call.

In: a range and what the plan says would be heard. Out: a log-likelihood. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from numba import njit

from echostep.walls import FAR_M


@dataclass(frozen=True, slots=True)
class EchoSettings:
    """The mixture of what an SRF02 may report; lengths in metres, probabilities of one ping.

    `sd_m`: range error of 3-4 cm [Girard 2011, 2.6] and as much again for the plan and the swaying trunk. `rim_deg`: off-axis angle at which half
    of the echoes are lost, -6 dB [Girard 2011, 2.6.2]; `rim_width_deg` its softness. `maximum_m`, `minimum_m`: the
    sensor's limits. `edge`: chance that a wall end before the wall answers first. `short`: something nearer that is not on the plan.
    `stray`: a second reflection or the other ranger's echo where no wall answers. `outlier`: anything else.
    `correlation_m`: travel over which errors of successive echoes become independent.
    """

    sd_m: float = 0.06
    rim_deg: float = 27.5
    rim_width_deg: float = 2.5
    maximum_m: float = 6.0
    minimum_m: float = 0.15
    fade_m: float = 0.3
    edge: float = 0.15
    short: float = 0.08
    stray: float = 0.5
    outlier: float = 0.05
    correlation_m: float = 0.3

    def __post_init__(self) -> None:
        """Raise ValueError for lengths of zero and for probabilities that are none."""
        for name in ("sd_m", "rim_width_deg", "fade_m", "correlation_m", "outlier"):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"[echo] {name}: must be greater than 0")
        for name in ("edge", "short", "stray", "outlier"):
            if getattr(self, name) >= 1.0:
                raise ValueError(f"[echo] {name}: must be a probability below 1")
        if not 0.0 < self.minimum_m < 0.5 * self.maximum_m:
            raise ValueError("[echo] minimum_m: must be well below maximum_m")


class EchoModel(NamedTuple):
    """`EchoSettings` as the kernels take them."""

    sd_m: float
    rim_rad: float
    rim_width_rad: float
    maximum_m: float
    minimum_m: float
    fade_m: float
    edge: float
    short: float
    stray: float
    outlier: float


def echo_model(settings: EchoSettings) -> EchoModel:
    """The settings in radians."""
    return EchoModel(
        settings.sd_m,
        math.radians(settings.rim_deg),
        math.radians(settings.rim_width_deg),
        settings.maximum_m,
        settings.minimum_m,
        settings.fade_m,
        settings.edge,
        settings.short,
        settings.stray,
        settings.outlier,
    )


@njit(cache=True, error_model="numpy")
def log_echo(range_m: float, wall_m: float, off_axis_rad: float, edge_m: float, model: EchoModel) -> float:
    """Log p(range | the wall at `wall_m`, `off_axis_rad` off the axis, a wall end at `edge_m`); range 0 means no echo.

    A mixture in the manner of the beam model [Thrun, Burgard, Fox 2005, 6.3]: the wall or the end before it,
    something short of it, a stray echo when the wall is not heard, and a uniform rest.
    """
    heard = detection(wall_m, off_axis_rad, model)
    edge = model.edge * detection(edge_m, 0.0, model) if edge_m < wall_m else 0.0
    span = model.maximum_m - model.minimum_m
    if range_m <= 0.0:
        silent = (1.0 - heard) * (1.0 - edge) * (1.0 - model.stray) * (1.0 - model.short)
        return math.log((1.0 - model.outlier) * silent + model.outlier * 0.2)
    hit = edge * normal(range_m, edge_m, 2.0 * model.sd_m) + (1.0 - edge) * heard * normal(range_m, wall_m, model.sd_m)
    reach = min(max(wall_m, 2.0 * model.minimum_m), model.maximum_m)
    short = 1.0 / (reach - model.minimum_m) if range_m < reach else 0.0
    stray = (1.0 - heard) * model.stray / span
    density = (1.0 - model.short) * (hit + stray) + model.short * short
    return math.log((1.0 - model.outlier) * density + model.outlier / span)


@njit(cache=True, error_model="numpy", inline="always")
def detection(distance_m: float, off_axis_rad: float, model: EchoModel) -> float:
    """Probability that a reflector is heard: falls off at the rim of the cone and at the end of the range."""
    if distance_m >= FAR_M or distance_m < model.minimum_m:
        return 0.0
    rim = 1.0 / (1.0 + math.exp((off_axis_rad - model.rim_rad) / model.rim_width_rad))
    fade = 1.0 / (1.0 + math.exp((distance_m - model.maximum_m) / model.fade_m))
    return rim * fade


@njit(cache=True, error_model="numpy", inline="always")
def normal(x: float, mean: float, sd: float) -> float:
    """Normal density."""
    z = (x - mean) / sd
    return math.exp(-0.5 * z * z) / (sd * 2.5066282746310002)
