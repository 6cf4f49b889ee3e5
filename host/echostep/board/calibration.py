"""Counts -> SI, in the body frame.

In: messages and MTx samples with their time. Out: samples in SI units. Owns nothing but the mounting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.board.messages import GYROS_INVALID, PING_TIME_OF_FLIGHT_US_INVALID, Outcome

SPEED_OF_SOUND_M_S = 343.2  # dry air, 20 degC
ADIS16100_RAD_S = math.radians(0.2439)  # per count [ADIS16100 datasheet, sensitivity]


class Echo(NamedTuple):
    """One ping in SI units: `ranger` 0 looks left, 1 right; `range_m` is None when nothing was heard."""

    t_s: float
    ranger: int
    range_m: float | None


@dataclass(frozen=True, slots=True)
class RangerSettings:
    """What is known of the rangers: `speed_of_sound_m_s`, and `delay_s` between trigger stamp and burst."""

    speed_of_sound_m_s: float = SPEED_OF_SOUND_M_S
    delay_s: float = 0.0


GYROS = ("thigh", "calf", "belt")


@dataclass(frozen=True, slots=True)
class GyroSettings:
    """Biases of the board's gyros, and whether the belt's is worn upside down; found by `echostep calibrate`."""

    thigh_bias_rad_s: float = 0.0
    calf_bias_rad_s: float = 0.0
    belt_bias_rad_s: float = 0.0
    belt_reversed: bool = False


def ranges(pings: NDArray[np.void], settings: RangerSettings) -> Floats:
    """Ranges (n,) of pings (n,) by the schema's dtype: half the way of the sound; NaN when nothing was heard."""
    range_m = 0.5e-6 * pings["time_of_flight_us"] * settings.speed_of_sound_m_s
    unmeasured = pings["time_of_flight_us"] == PING_TIME_OF_FLIGHT_US_INVALID
    range_m[(pings["outcome"] != Outcome.ECHO) | unmeasured] = np.nan
    return range_m


def gyro_rates(samples: NDArray[np.void], settings: GyroSettings) -> Floats:
    """Rates (n, 3) of thigh, calf and belt in rad/s of gyro samples (n,) by the schema's dtype; NaN where a gyro is absent or tests itself."""
    counts = np.column_stack([samples[name] for name in GYROS]).astype(np.float64)
    counts[counts == GYROS_INVALID] = np.nan
    found: Floats = counts * ADIS16100_RAD_S - [
        settings.thigh_bias_rad_s, settings.calf_bias_rad_s, settings.belt_bias_rad_s
    ]  # fmt: skip
    found[:, 2] *= -1.0 if settings.belt_reversed else 1.0
    return found


def compass_headings(samples: NDArray[np.void]) -> Floats:
    """Headings (n,) in radians, counter-clockwise from east, of compass samples (n,) by the schema's dtype; NaN when nothing was read."""
    bearing = np.where(samples["bearing"] < 3600, samples["bearing"], np.nan)
    found: Floats = 0.5 * math.pi - np.radians(0.1 * bearing)
    return found


STANDARD_PA = 101_325.0


def heights(samples: NDArray[np.void]) -> Floats:
    """Heights (n,) in the standard atmosphere [ISO 2533] of barometer samples (n,) by the schema's dtype; NaN when nothing was measured.

    Differences count, over a building; the weather moves all of them.
    """
    pressure_pa = np.where(samples["pressure"] == 0, np.nan, 0.25 * samples["pressure"])
    found: Floats = 44_330.77 * (1.0 - (pressure_pa / STANDARD_PA) ** 0.190263)
    return found
