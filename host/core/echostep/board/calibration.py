# SPDX-License-Identifier: MIT
"""Raw counts of the board's sensors -> SI units.

In: rows of messages, by the dtypes of the schema. Out: ranges, rates, headings and heights. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.board.messages import GYROS_INVALID, MOTION_INVALID, PING_TIME_OF_FLIGHT_US_INVALID, Outcome
from echostep.elementary import exp, log

SPEED_OF_SOUND_M_S = 343.2  # dry air, 20 degC
ADIS16100_RAD_S = math.radians(0.2439)  # rad/s per count [ADIS16100 datasheet, sensitivity]
LSM6DSO_RAD_S = math.radians(0.035)  # rad/s per count at 1000 deg/s [LSM6DSO data sheet, table 2]
LSM6DSO_M_S2 = 0.244e-3 * 9.80665  # m/s2 per count at 8 g [LSM6DSO data sheet, table 2]
ICM20649_RAD_S = math.radians(1.0 / 8.2)  # rad/s per count at 4000 deg/s [ICM-20649 data sheet DS-000192, table 1]
ICM20649_M_S2 = 9.80665 / 1024.0  # m/s2 per count at 30 g [DS-000192, table 2]
BEARINGS = 3600  # counts of 0.1 degrees in a turn of the compass
PRESSURE_PA = 0.25  # Pa per count of the barometer
STANDARD_PA = 101_325.0  # pressure at height 0 [ISO 2533]
HEIGHT_SCALE_M, HEIGHT_EXPONENT = 44_330.77, 0.190263  # height from pressure in the troposphere [ISO 2533]
GYROS = ("thigh", "calf", "belt")  # fields of a gyro sample, columns of `gyro_rates`
BELT = GYROS.index("belt")
# Of an accelerometer: 65 mg when new and the effect of soldering [ICM-20649 data sheet DS-000192, table 2], doubled; assumed
OFFSET_MAX_M_S2 = 1.5
SCALE_ERROR_MAX = 0.05  # three times the 1.5 % of a new part [table 2]; assumed
BIAS_MAX_RAD_S = math.radians(30.0)  # of a gyro; assumed
AXES = ("x", "y", "z")
MOST_BIAS_M = 0.3  # of a ranger: six times the bias of real ones [real sweeps of 40 kHz rangers: -0.3 to 5 cm]; assumed
MOST_AHEAD_DEG = 60.0  # of the rangers off abeam: beyond it they look along the way
LEAST_RANGE_M = 0.01  # least range after the bias is subtracted: 0 would mean no echo


@dataclass(frozen=True, slots=True)
class RangerSettings:
    """`speed_of_sound_m_s`; 0: by the temperature that the board measures. `delay_s` from the time stamp of the trigger to the ultrasonic burst;
    `ahead_deg`: how far both rangers look ahead of abeam, as worn on the belt; `left_bias_m`, `right_bias_m`: how much too far each measures.
    """

    speed_of_sound_m_s: float = 0.0
    delay_s: float = 0.0
    ahead_deg: float = 0.0
    left_bias_m: float = 0.0
    right_bias_m: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for rangers that do not look sideways, or with values that no ranger has."""
        for name in ("left_bias_m", "right_bias_m"):
            if abs(getattr(self, name)) > MOST_BIAS_M:
                raise ValueError(f"{name}: a ranger errs by at most {MOST_BIAS_M:g} m")
        if abs(self.ahead_deg) > MOST_AHEAD_DEG:
            raise ValueError(f"ahead_deg: rangers look aside, at most {MOST_AHEAD_DEG:.0f} degrees off it")


@dataclass(frozen=True, slots=True)
class GyroSettings:
    """Biases of the board's gyros, and whether the belt gyro is mounted upside down; measured by `echostep calibrate`."""

    thigh_bias_rad_s: float = 0.0
    calf_bias_rad_s: float = 0.0
    belt_bias_rad_s: float = 0.0
    belt_reversed: bool = False


@dataclass(frozen=True, slots=True)
class ImuSettings:
    """Errors of a six-axis part, in its axes: true force = scale (measured - offset), true rate = measured - bias.

    Measured by `echostep calibrate accelerometers`. `celsius`: the part's temperature at that time.
    """

    offset_x_m_s2: float = 0.0
    offset_y_m_s2: float = 0.0
    offset_z_m_s2: float = 0.0
    scale_x: float = 1.0
    scale_y: float = 1.0
    scale_z: float = 1.0
    bias_x_rad_s: float = 0.0
    bias_y_rad_s: float = 0.0
    bias_z_rad_s: float = 0.0
    celsius: float = 0.0

    def __post_init__(self) -> None:
        """Raise ValueError for errors that no part has."""
        for name in AXES:
            for field, value, limit in (
                (f"scale_{name}", getattr(self, f"scale_{name}") - 1.0, SCALE_ERROR_MAX),
                (f"offset_{name}_m_s2", getattr(self, f"offset_{name}_m_s2"), OFFSET_MAX_M_S2),
                (f"bias_{name}_rad_s", getattr(self, f"bias_{name}_rad_s"), BIAS_MAX_RAD_S),
            ):
                if not abs(value) <= limit:
                    raise ValueError(f"{field}: {getattr(self, field):g} is beyond the errors of any part")

    @property
    def offset(self) -> Floats:
        """Offsets (3,) in m/s2."""
        return np.array([getattr(self, f"offset_{name}_m_s2") for name in AXES])

    @property
    def scale(self) -> Floats:
        """Scales (3,)."""
        return np.array([getattr(self, f"scale_{name}") for name in AXES])

    @property
    def bias(self) -> Floats:
        """Biases (3,) of the rates in rad/s."""
        return np.array([getattr(self, f"bias_{name}_rad_s") for name in AXES])

    def true_forces(self, measured: Floats) -> Floats:
        """Specific forces (n, 3) in m/s2 without the part's errors."""
        return (measured - self.offset) * self.scale

    def true_rates(self, measured: Floats) -> Floats:
        """Rates (n, 3) in rad/s without the part's errors."""
        return measured - self.bias


class Imus(NamedTuple):
    """Errors of the two parts whose forces the tracker uses."""

    foot: ImuSettings = ImuSettings()
    belt: ImuSettings = ImuSettings()


def ranges(pings: NDArray[np.void], settings: RangerSettings, speed_m_s: Floats | float = SPEED_OF_SOUND_M_S) -> Floats:
    """Ranges (n,) in m of pings (n,): half the path of the sound at these speeds (n,), less the ranger's bias; NaN without an echo."""
    bias_m = np.where(pings["ranger"] == 0, settings.left_bias_m, settings.right_bias_m)
    measured_m = 0.5e-6 * pings["time_of_flight_us"] * (settings.speed_of_sound_m_s or speed_m_s)
    range_m = np.maximum(measured_m - bias_m, np.minimum(measured_m, LEAST_RANGE_M))
    unmeasured = pings["time_of_flight_us"] == PING_TIME_OF_FLIGHT_US_INVALID
    range_m[(pings["outcome"] != Outcome.ECHO) | unmeasured] = np.nan
    return range_m


def gyro_rates(samples: NDArray[np.void], settings: GyroSettings) -> Floats:
    """Rates (n, 3) in rad/s of thigh, calf and belt, of gyro samples (n,); NaN where a gyro is absent or in its self-test."""
    counts = np.column_stack([samples[name] for name in GYROS]).astype(np.float64)
    counts[counts == GYROS_INVALID] = np.nan
    biases = settings.thigh_bias_rad_s, settings.calf_bias_rad_s, settings.belt_bias_rad_s
    rates = counts * ADIS16100_RAD_S - biases
    rates[:, BELT] *= -1.0 if settings.belt_reversed else 1.0
    return rates


def six_axes(samples: NDArray[np.void], place: str) -> tuple[Floats, Floats]:
    """Rates (n, 3) in rad/s and specific forces (n, 3) in m/s2 of one place of motion samples (n,), in the part's axes; NaN where not measured."""
    rates, forces = (
        np.column_stack([samples[f"{place}_{kind}_{axis}"] for axis in AXES]).astype(np.float64)
        for kind in ("rate", "acceleration")
    )
    for counts in (rates, forces):
        counts[counts == MOTION_INVALID] = np.nan
    return rates * LSM6DSO_RAD_S, forces * LSM6DSO_M_S2


def foot_axes(samples: NDArray[np.void]) -> tuple[Floats, Floats]:
    """Rates (n, 3) in rad/s and specific forces (n, 3) in m/s2 of samples (n,) of a foot board, in the part's axes."""
    rates, forces = (np.column_stack([samples[f"{kind}_{axis}"] for axis in AXES]) for kind in ("rate", "acceleration"))
    return ICM20649_RAD_S * rates, ICM20649_M_S2 * forces


def compass_headings(samples: NDArray[np.void]) -> Floats:
    """Headings (n,) in radians, counter-clockwise from east, of compass samples (n,); NaN for an invalid bearing."""
    bearing = np.where(samples["bearing"] < BEARINGS, samples["bearing"], np.nan)
    return 0.5 * math.pi - np.radians(0.1 * bearing)


def heights(samples: NDArray[np.void]) -> Floats:
    """Heights (n,) in m in the standard atmosphere [ISO 2533] of barometer samples (n,); NaN for an invalid pressure.

    Only differences over a short time are meaningful, as the weather shifts all heights.
    """
    pressure_pa = np.where(samples["pressure"] == 0, np.nan, PRESSURE_PA * samples["pressure"])
    return HEIGHT_SCALE_M * (1.0 - exp(HEIGHT_EXPONENT * log(pressure_pa / STANDARD_PA)))
