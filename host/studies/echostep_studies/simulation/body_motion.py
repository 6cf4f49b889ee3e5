# SPDX-License-Identifier: MIT
"""The motion of one place of a body, composed of turns, moves, drops and stops, and what a sensor there measures.

In: movements with their times. Out: `MotionSamples`. Owns acceleration and attitude at 1 kHz, which give the specific force. A drop is a free fall
by a share of gravity, stopped over a floor's, a knee's or a pad's time. World: x ahead, y left, z up.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep_simulation.people.attitude import rotations, turns
from echostep_simulation.people.rolling_foot import glide

RATE_HZ = 1000
G0_M_S2 = 9.80665  # standard gravity
DEGREE = math.radians(1.0)


class SensorPart(NamedTuple):
    """A sensor: samples a second, full scales (m/s2, rad/s), noise (sd), bias (sd)."""

    rate_hz: float
    force_m_s2: float
    rate_rad_s: float
    noise: tuple[float, float]
    bias: tuple[float, float]


# [data sheet, table 2]
LSM6DSO = SensorPart(200.0, 8.0 * G0_M_S2, math.radians(1000.0), (0.02, 0.0006), (0.2, 0.017))
# [manual]
MTX = SensorPart(100.0, 50.0, math.radians(1200.0), (0.04, 0.017), (0.02, 0.005))
# [DS-000192]
ICM20649 = SensorPart(225.0, 30.0 * G0_M_S2, math.radians(4000.0), (0.05, 0.003), (0.3, 0.05))


class MotionSamples(NamedTuple):
    """Of one sensor: t_s (n,), force (n, 3) m/s2, rate (n, 3) rad/s, in axes that are mounted at random."""

    t_s: Floats
    force: Floats
    rate: Floats


class BodyMotion:
    """Accelerations (n, 3) and angles (n, 3: roll, pitch, 0) of one place at 1 kHz; the methods add movements.

    The pitch comes first, then the roll about the world's x: the axis along which a leg lies.
    """

    def __init__(self, seconds: float) -> None:
        self.t_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
        self.accel = np.zeros((len(self.t_s), 3))
        self.rpy = np.zeros((len(self.t_s), 3))

    def turn(self, begin_s: float, seconds: float, pitch_deg: float, roll_deg: float = 0.0) -> None:
        """Turn smoothly by these angles and stay so."""
        share = glide((self.t_s - begin_s) / seconds)
        self.rpy[:, 0] += roll_deg * DEGREE * share
        self.rpy[:, 1] += pitch_deg * DEGREE * share

    def move(self, begin_s: float, seconds: float, rise_m: float, ahead_m: float = 0.0) -> None:
        """Move smoothly by these distances."""
        u = np.clip((self.t_s - begin_s) / seconds, 0.0, 1.0)
        wave = (60.0 * u - 180.0 * u**2 + 120.0 * u**3) / seconds**2  # of minimum jerk [Flash and Hogan 1985]
        self.accel[:, 2] += rise_m * wave
        self.accel[:, 0] += ahead_m * wave

    def drop(self, begin_s: float, fall_m: float, share: float, stop_s: float) -> float:
        """Fall with a share of gravity and be stopped within `stop_s`; returns when the floor was met."""
        fall_s = math.sqrt(2.0 * fall_m / (share * G0_M_S2))
        met_s = begin_s + fall_s
        self.accel[(self.t_s >= begin_s) & (self.t_s < met_s), 2] -= share * G0_M_S2
        self.stop(met_s, share * G0_M_S2 * fall_s, stop_s)
        return met_s

    def stop(self, begin_s: float, speed_m_s: float, seconds: float, axis: int = 2) -> None:
        """Lose a downward (forward for axis 0) speed in half a sine."""
        u = (self.t_s - begin_s) / seconds
        wave = np.where((u > 0.0) & (u < 1.0), np.sin(math.pi * np.clip(u, 0.0, 1.0)), 0.0)
        self.accel[:, axis] += (1.0 if axis == 2 else -1.0) * speed_m_s * 0.5 * math.pi / seconds * wave

    def samples(self, part: SensorPart, rng: np.random.Generator) -> MotionSamples:
        """What a part measures, mounted at random."""
        mounting = rotations(rng.uniform(-math.pi, math.pi, (1, 3)) * [1.0, 0.5, 1.0])[0]
        pitched, rolled = (rotations(self.rpy * axis) for axis in ([0.0, 1.0, 0.0], [1.0, 0.0, 0.0]))
        attitude = rolled @ pitched @ mounting
        force = np.einsum("nji,nj->ni", attitude, self.accel + [0.0, 0.0, G0_M_S2])
        rate = np.zeros_like(force)
        rate[1:] = turns(attitude) * RATE_HZ
        width = round(RATE_HZ / part.rate_hz)  # the part's filter
        ends = np.floor(np.arange(1.0, len(self.t_s) * part.rate_hz / RATE_HZ) * RATE_HZ / part.rate_hz).astype(int)
        measured = []
        for true, noise, bias, most in zip((force, rate), part.noise, part.bias, part[1:3], strict=True):
            sums = np.concatenate([np.zeros((1, 3)), np.cumsum(true, axis=0)])
            mean = (sums[ends] - sums[ends - width]) / width
            noisy = mean + bias * rng.standard_normal(3) + noise * rng.standard_normal(mean.shape)
            measured.append(np.clip(noisy, -most, most))
        return MotionSamples(self.t_s[ends - 1], measured[0], measured[1])
