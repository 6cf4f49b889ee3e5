# SPDX-License-Identifier: MIT
"""The bias that the ranges of both rangers have in common, learnt where the plan supports the place.

In: pings, their places by the mean of a cloud, its covariance, the walls. Out: `MeasuredSegment`s without the bias. Owns its mean and
variance.

Half of the variance of a range's error is taken to stay with the ranger [SRF02: which wavefront crosses the threshold, 3-4 cm; Robot Electronics,
sonar FAQ]. The density without a plan adapts to the biased distance of a continuing wall; the plan states the true one. So an excess of both rangers,
which no place explains, would count against the plan along every wall. An excess of one over the other moves the place by half of the excess, and is
not learnt. A Kalman filter of one state; a ping counts by its power and by the probability that it is the expected echo.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.board.calibration import LEAST_RANGE_M
from echostep.echoes.likelihood import EchoModel, likeliest_source, normal
from echostep.elementary import dot, mean_angle
from echostep.jit import kernel
from echostep.particles.arrays import Move, ParticleArrays, PingBatch
from echostep.path import MeasuredSegment
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.index import WallIndex

# Share of the variance of a range's error that stays with the ranger, assumed; without a bias `hall` of `evaluate anywhere` fails
STAYS = 0.5


class RangeBias:
    """`mean_m`, `var_m2`: of the excess that both rangers measure."""

    def __init__(self, sd_m: float) -> None:
        """`sd_m`: of a range."""
        self.mean_m, self.var_m2 = 0.0, 0.5 * STAYS * sd_m**2  # of the mean of two

    def corrected(self, measured: MeasuredSegment) -> MeasuredSegment:
        """The segment, its ranges without the bias."""
        range_m = measured.range_m
        corrected = np.maximum(range_m - self.mean_m, LEAST_RANGE_M)
        return replace(measured, range_m=np.where(range_m > LEAST_RANGE_M, corrected, range_m))

    def learn(
        self,
        pings: PingBatch,
        place_m: tuple[Floats, Floats, Floats],
        covariance_m2: tuple[float, float, float],
        walls: Walls,
        model: EchoModel,
    ) -> None:
        """Learn from corrected pings (k,), sent from `place_m` (x, y, axis in rad, each (k,)), which is known with `covariance_m2` (xx, xy, yy)."""
        x, y, axis = place_m
        index = walls.near(x, y)
        self.mean_m, self.var_m2 = learn_bias(
            (self.mean_m, self.var_m2), pings, x, y, axis, covariance_m2, index, model
        )

    def learn_behind(
        self, cloud: ParticleArrays, weight: Floats, move: Move, pings: PingBatch, walls: Walls, model: EchoModel
    ) -> None:
        """Learn from corrected pings on a move, at whose end the particles (n,) with these weights are now."""
        rest = 1.0 - pings.share
        x, y, turn = dot(weight, cloud.x_m), dot(weight, cloud.y_m), mean_angle(cloud.turn_rad, weight)
        c, s = math.cos(turn), math.sin(turn)
        place_m = (
            x - rest * (c * move.dx_m - s * move.dy_m),
            y - rest * (s * move.dx_m + c * move.dy_m),
            pings.axis_rad + turn,
        )
        dx, dy = cloud.x_m - x, cloud.y_m - y
        covariance_m2 = dot(weight, dx * dx), dot(weight, dx * dy), dot(weight, dy * dy)
        self.learn(pings, place_m, covariance_m2, walls, model)


@kernel
def learn_bias(
    bias: tuple[float, float], pings: PingBatch, x: Floats, y: Floats, axis: Floats, covariance_m2: tuple[float, float, float],
    walls: WallIndex, model: EchoModel,
) -> tuple[float, float]:  # fmt: skip
    """Mean and variance of the bias after the echoes, whose ranges are without the mean before."""
    block, distance_m, off_axis_rad, kind = one_receiver()
    mean_m, var_m2 = bias
    before_m = mean_m
    for i in range(len(x)):
        if pings.range_m[i] <= 0.0:
            continue
        count = echo_sources(x[i], y[i], axis[i], walls, block)
        first, answers, _ = likeliest_source(count, distance_m, off_axis_rad, kind, model)
        if answers <= 0.0:
            continue
        c, s = math.cos(axis[i]), math.sin(axis[i])
        place_m2 = c * c * covariance_m2[0] + 2.0 * c * s * covariance_m2[1] + s * s * covariance_m2[2]
        error_m2 = (model.sd_m + model.slant_m * off_axis_rad[first]) ** 2 + place_m2
        innovation = pings.range_m[i] + before_m - distance_m[first] - mean_m
        expected = answers * normal(innovation, math.sqrt(error_m2 + var_m2))
        other = (1.0 - answers + model.hidden + model.outlier) / (model.maximum_m - model.minimum_m)
        power = pings.power[i] * expected / (expected + other)
        gain = var_m2 * power / (var_m2 * power + error_m2)
        mean_m += gain * innovation
        var_m2 *= 1.0 - gain
    return mean_m, var_m2
