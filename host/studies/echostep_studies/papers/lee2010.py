# SPDX-License-Identifier: MIT
"""The ambulatory system of Lee and Lee 2010 as printed: distance from thigh and calf gyros, heading by compass and belt gyro, floor by pressure.

In: angles and rates of thigh and calf (forward positive), compass and belt gyro, pressure. Out: travel, velocity, heading, place, floor. Owns the
state of `Walker`: the leg's angles, heading and place. Equation numbers are those of [Lee 2010]; the covariance of the travel (eqs. 6 to 11), which
the paper's method does not use, is left out. What the paper leaves open is decided here: angles are wrapped before they are fused, and a period of
the leg ends where the thigh turns round behind the body.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import wrap

THIGH_M, CALF_M = 0.48, 0.56  # L1, L2 [Lee 2010, section 2]
RATE_HZ = 10.0  # of eqs. 19 and 20 [Lee 2010, section 3]
LONGEST_GAP_S = 0.25  # without samples; over a longer gap nothing is integrated
ISO_PRESSURE_PA, ISO_EXPONENT, ISO_LAPSE_1_M = 101_325.0, 5.25588, 2.25577e-5  # [ISO 2533]


@dataclass(frozen=True, slots=True)
class Lee2010Legs:
    """The parameters of the user's leg: `thigh_m` is L1, `calf_m` is L2."""

    thigh_m: float = THIGH_M
    calf_m: float = CALF_M


@dataclass(frozen=True, slots=True)
class Fused:
    """An angle and its variance."""

    angle_rad: float
    variance: float


def knee_travel(thigh_plus: float, thigh_minus: float, legs: Lee2010Legs) -> float:
    """d, travel of the knee (m), from the sizes of the thigh's angle in front and behind (rad) [Lee 2010, eq. 1]."""
    return legs.thigh_m * math.sin(thigh_plus) + legs.thigh_m * math.sin(thigh_minus)


def hip_travel(thigh_plus: float, thigh_minus: float, calf_plus: float, calf_minus: float, legs: Lee2010Legs) -> float:
    """D, travel of the hip (m) [Lee 2010, eq. 2]."""
    return (
        knee_travel(thigh_plus, thigh_minus, legs)
        + legs.calf_m * math.sin(calf_plus)
        + legs.calf_m * math.sin(calf_minus)
    )


def velocity(
    thigh_plus: float, thigh_minus: float, calf_plus: float, calf_minus: float, thigh_rate: float, calf_rate: float,
    legs: Lee2010Legs,
) -> float:  # fmt: skip
    """V, the forward velocity of the hip, from the rates omega_1 and omega_2 [Lee 2010, eq. 3]."""
    return legs.thigh_m * thigh_rate * (math.cos(thigh_plus) + math.cos(thigh_minus)) + legs.calf_m * calf_rate * (
        math.cos(calf_plus) + math.cos(calf_minus)
    )


def nominal(plus: float, minus: float) -> float:
    """The nominal value of an angle [Lee 2010, eqs. 4 and 5]."""
    return 0.5 * (plus + minus)


def fuse(compass_rad: float, compass_variance: float, gyro_rad: float, gyro_variance: float) -> Fused:
    """The weighted least squares of compass and gyro angle, in [-pi, pi) [Lee 2010, eqs. 12 to 18].

    Eq. 17 for the gyro's angle and the compass's on its own side of the circle, which the paper leaves out.
    """
    off = wrap(compass_rad - gyro_rad)
    total = compass_variance + gyro_variance
    weight = gyro_variance / total if total > 0.0 else 0.5
    return Fused(wrap(gyro_rad + weight * off), compass_variance * weight)


def advance(x_m: float, y_m: float, v_m_s: float, heading_rad: float, dt_s: float) -> tuple[float, float]:
    """One step of the integrals [Lee 2010, eqs. 19 and 20]."""
    return x_m + v_m_s * math.cos(heading_rad) * dt_s, y_m + v_m_s * math.sin(heading_rad) * dt_s


def floor_of(pressure_pa: float, heights_m: Sequence[float], reference_pa: float, reference_floor: int) -> int:
    """The floor whose height is nearest by pressure: `reference_pa` was read on `reference_floor` [Lee 2010, section 3].

    Its height is what is put out, not the pressure's. The paper does not say how pressure becomes height: here by the standard atmosphere [ISO 2533].
    """
    height = heights_m[reference_floor] + iso_height_m(pressure_pa) - iso_height_m(reference_pa)
    return min(range(len(heights_m)), key=lambda k: abs(heights_m[k] - height))


def iso_height_m(pressure_pa: float) -> float:
    """Height in the standard atmosphere [ISO 2533]."""
    return float((1.0 - (pressure_pa / ISO_PRESSURE_PA) ** (1.0 / ISO_EXPONENT)) / ISO_LAPSE_1_M)


@dataclass(frozen=True, slots=True)
class LeeSettings:
    """`compass_sd_rad` and `gyro_sd_rad_s` weigh eq. 17: the compass's error, and how fast the integrated belt gyro goes wrong (per root second).

    The paper prints none: the compass's is that of a CMPS03 worn indoors, the gyro's that of an ADIS16100.
    `least_swing_rad`: of the thigh, to be a period.
    """

    legs: Lee2010Legs = Lee2010Legs()
    compass_sd_rad: float = math.radians(8.0)
    gyro_sd_rad_s: float = math.radians(0.5)
    least_swing_rad: float = math.radians(10.0)


class Neutral:
    """Angle of thigh or calf: the integrated rate, corrected after each period so that the swing's middle is upright [Lee 2010, Figure 4]."""

    def __init__(self) -> None:
        self.angle_rad = 0.0
        self.front_rad = self.rear_rad = 0.0  # of the period under way

    def turn(self, rate_rad_s: float, dt_s: float) -> None:
        """Integrate a rate over `dt_s`."""
        self.angle_rad += rate_rad_s * dt_s
        self.front_rad = max(self.front_rad, self.angle_rad)
        self.rear_rad = min(self.rear_rad, self.angle_rad)

    def reset(self) -> None:
        """Correct the angle at the end of a period."""
        self.angle_rad -= nominal(self.front_rad, self.rear_rad)
        self.front_rad = self.rear_rad = self.angle_rad


class Walker:
    """The whole system: samples of the gyros and the compass in, (n, 6) t_s, distance_m, speed_m_s, heading_rad, x, y at 10 Hz out.

    Eq. 3 turns front and rear leg by the same rate, so it is the speed between both feet; the hip, midway, goes with half of it, and
    forward whichever way this leg swings, because the other leg does the opposite.
    """

    def __init__(self, settings: LeeSettings | None = None, heading_rad: float = 0.0) -> None:
        self.settings = settings or LeeSettings()
        self.thigh, self.calf = Neutral(), Neutral()
        self.heading = Fused(wrap(heading_rad), 0.0 if heading_rad else math.pi**2)
        self.x_m = self.y_m = self.distance_m = 0.0
        self._extreme = 0.0  # of the thigh since it last turned
        self._forward = True
        self._next_s: float | None = None
        self._t_s: float | None = None
        self._sum = [0.0, 0.0]  # turned by thigh and calf since the last row
        self._since_s = 0.0
        self._bearing = math.nan

    def feed(self, t_s: Floats, thigh: Floats, calf: Floats, belt: Floats, compass: Floats) -> Floats:
        """Samples (n,) each, rates in rad/s, compass as a heading in rad, NaN if missing."""
        rows = [
            self._sample(*sample)
            for sample in zip(*(c.tolist() for c in (t_s, thigh, calf, belt, compass)), strict=True)
        ]
        return np.array([row for row in rows if row is not None]).reshape(-1, 6)

    def _sample(self, t_s: float, thigh: float, calf: float, belt: float, compass: float) -> tuple[float, ...] | None:
        if any(map(math.isnan, (t_s, thigh, calf, belt))):
            return None
        if self._t_s is None or self._next_s is None:
            self._t_s, self._next_s = t_s, t_s + 1.0 / RATE_HZ
            return None
        dt_s, self._t_s = t_s - self._t_s, t_s
        if not 0.0 < dt_s < LONGEST_GAP_S:
            self._next_s, self._sum, self._since_s = t_s + 1.0 / RATE_HZ, [0.0, 0.0], 0.0
            return None
        self.thigh.turn(thigh, dt_s)
        self.calf.turn(calf, dt_s)
        self._sum = [self._sum[0] + thigh * dt_s, self._sum[1] + calf * dt_s]
        self._since_s += dt_s
        self._turn(belt, dt_s)
        self._period()
        if not math.isnan(compass):
            self._bearing = compass
        if t_s < self._next_s - 1e-6:
            return None
        self._next_s = max(self._next_s + 1.0 / RATE_HZ, t_s)
        return self._row(t_s)

    def _turn(self, belt: float, dt_s: float) -> None:
        """Integrate the belt gyro's rate into the heading, and its drift into the variance."""
        variance = self.heading.variance + self.settings.gyro_sd_rad_s**2 * dt_s
        self.heading = Fused(wrap(self.heading.angle_rad + belt * dt_s), variance)

    def _period(self) -> None:
        """Reset the neutral position where the thigh begins to swing forward."""
        angle, far = self.thigh.angle_rad, self.settings.least_swing_rad
        self._extreme = max(self._extreme, angle) if self._forward else min(self._extreme, angle)
        if abs(angle - self._extreme) < far:
            return
        self._forward = not self._forward
        if self._forward:
            self.thigh.reset()
            self.calf.reset()
        self._extreme = self.thigh.angle_rad

    def _row(self, t_s: float) -> tuple[float, ...]:
        s, since_s = self.settings, self._since_s
        thigh, calf = self.thigh.angle_rad, self.calf.angle_rad
        rates = [turned / since_s for turned in self._sum]
        v = 0.5 * abs(velocity(thigh, thigh, calf, calf, rates[0], rates[1], s.legs))
        self._sum, self._since_s = [0.0, 0.0], 0.0
        if not math.isnan(self._bearing):
            self.heading = fuse(self._bearing, s.compass_sd_rad**2, self.heading.angle_rad, self.heading.variance)
            self._bearing = math.nan
        self.x_m, self.y_m = advance(self.x_m, self.y_m, v, self.heading.angle_rad, since_s)
        self.distance_m += v * since_s
        return t_s, self.distance_m, v, self.heading.angle_rad, self.x_m, self.y_m
