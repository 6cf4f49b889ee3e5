"""What is found of a wearer from a few seconds of the board's samples: biases, which way round a gyro is worn, iron, the scale of his legs.

In: `ProbeResult`. Out: values for the settings, and a line for him; EchostepError says what he has to do again. Owns nothing.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.arrays import Floats
from echostep.board.calibration import ADIS16100_RAD_S, GYROS, GyroSettings
from echostep.board.messages import GYROS_INVALID
from echostep.commissioning.probe import TICKS_PER_S, ProbeResult
from echostep.errors import EchostepError
from echostep.legs.heading import compass_heading, fit_compass_errors
from echostep.legs.kinematics import LegLengths
from echostep.legs.strides import StrideEstimator, StrideSettings
from echostep.offline.leg_csv import calibrated_scale

Values = dict[str, float | bool]
Found = tuple[dict[str, Values], str]

PIECE_S = 1.0
STILL_SD_RAD_S = math.radians(2.0)  # noise of an ADIS16100 is 0.6 degrees/s in 40 Hz; who sways does more
STILL_SPREAD_RAD_S = math.radians(1.0)  # between the means of still pieces
BIAS_MAX_RAD_S = math.radians(30.0)
LEAST_STILL = 0.6  # share of the pieces
FULL_TURN_RAD = math.radians(300.0)
SWAPPED = 1.15  # a walking shank turns faster than the thigh
LEAST_READINGS = 100


def gyro_rates(heard: ProbeResult, settings: GyroSettings | None = None) -> tuple[Floats, Floats]:
    """Times (n,) s and rates (n, 3) rad/s of thigh, calf and belt without their biases; NaN where a gyro gave none."""
    known = settings or GyroSettings()
    t_s = np.array(heard.ticks.get("Gyros", []), float) / TICKS_PER_S
    counts = np.array([g[1:] for g in heard.gyros], float).reshape(-1, len(GYROS))
    counts[counts == GYROS_INVALID] = np.nan
    return t_s, ADIS16100_RAD_S * counts - np.array(
        [known.thigh_bias_rad_s, known.calf_bias_rad_s, known.belt_bias_rad_s]
    )


def bearings(heard: ProbeResult) -> tuple[Floats, Floats]:
    """Times (n,) s and compass bearings (n,) rad, clockwise; invalid ones left out."""
    t_s = np.array(heard.ticks.get("Compass", []), float) / TICKS_PER_S
    bearing = np.array([c.bearing for c in heard.compass], float)
    good = bearing < 3600
    return t_s[good], np.radians(0.1 * bearing[good])


def still_bias(t_s: Floats, rate: Floats) -> tuple[float, float]:
    """Bias and noise (rad/s) of a gyro that stood still for most of the time; raises ValueError that says what was wrong."""
    there = np.isfinite(rate)
    if there.sum() < LEAST_READINGS:
        raise ValueError("it gave no values: run echostep doctor")
    piece = ((t_s[there] - t_s[there][0]) / PIECE_S).astype(int)
    pieces = [rate[there][piece == k] for k in range(piece[-1] + 1) if (piece == k).sum() >= 20]
    quiet = [values for values in pieces if values.std() <= STILL_SD_RAD_S]
    means = np.array([values.mean() for values in quiet])
    kept = [v for v, mean in zip(quiet, means, strict=True) if abs(mean - np.median(means)) <= STILL_SPREAD_RAD_S]
    if len(kept) < LEAST_STILL * len(pieces):
        raise ValueError("it moved: stand still, or lay the board down, and do it again")
    still = np.concatenate(kept)
    if abs(still.mean()) > BIAS_MAX_RAD_S:
        raise ValueError(
            f"{math.degrees(still.mean()):.0f} degrees/s at rest: it turned evenly, or the gyro is damaged"
        )
    return float(still.mean()), float(still.std())


def find_gyros(heard: ProbeResult) -> Found:
    """Biases of the gyros that answer."""
    t_s, rate = gyro_rates(heard)
    values: Values = {}
    said = []
    for k, name in enumerate(GYROS):
        if not np.isfinite(rate[:, k]).any():
            said.append(f"{name} none (it does not answer)")
            continue
        try:
            bias, noise = still_bias(t_s, rate[:, k])
        except ValueError as error:
            raise EchostepError(f"{name} gyro: {error}") from error
        values[f"{name}_bias_rad_s"] = round(bias, 6)
        said.append(f"{name} {math.degrees(bias):+.2f} degrees/s (noise {math.degrees(noise):.2f})")
    if not values:
        raise EchostepError("no gyro gives values: run echostep doctor")
    return {"gyro": values}, "Bias: " + ", ".join(said)


def _turn(heard: ProbeResult, settings: GyroSettings) -> tuple[Floats, Floats, Floats, Floats]:
    """Times and rates of the belt gyro, times and bearings of the compass, of somebody who turned; raises EchostepError."""
    t_s, rate = gyro_rates(heard, settings)
    belt = rate[:, GYROS.index("belt")]
    there = np.isfinite(belt)
    at_s, bearing = bearings(heard)
    if there.sum() < LEAST_READINGS or len(bearing) < 20:
        raise EchostepError("belt gyro or compass gives no values: run echostep doctor")
    return t_s[there], belt[there], at_s, bearing


def find_mounting(heard: ProbeResult, settings: GyroSettings) -> Found:
    """Which way round the belt's gyro is worn: the compass tells in a turn on the spot."""
    t_s, belt, at_s, bearing = _turn(heard, settings)
    turned = np.concatenate([[0.0], np.cumsum(np.diff(t_s) * 0.5 * (belt[1:] + belt[:-1]))])
    by_gyro = np.interp(at_s, t_s, turned)
    by_compass = -np.unwrap(bearing)  # counter-clockwise
    if np.ptp(by_compass) < FULL_TURN_RAD or np.ptp(by_gyro) < 0.5 * FULL_TURN_RAD:
        seen = f"{math.degrees(np.ptp(by_compass)):.0f} by the compass, {math.degrees(np.ptp(by_gyro)):.0f} by the belt gyro"
        raise EchostepError(
            f"the turn covers {seen} degrees: turn once round on the spot, slowly and evenly, and do it again"
        )
    upside_down = bool(np.corrcoef(by_gyro, by_compass)[0, 1] < 0.0)
    return {
        "gyro": {"belt_reversed": upside_down}
    }, f"The belt gyro is worn {'upside down' if upside_down else 'upright'}."


def find_compass(heard: ProbeResult, settings: GyroSettings) -> Found:
    """Hard and soft iron of the wearer, from a turn on the spot."""
    t_s, belt, at_s, bearing = _turn(heard, settings)
    shown = np.full(len(t_s), np.nan)
    shown[np.clip(np.searchsorted(t_s, at_s), 0, len(t_s) - 1)] = compass_heading(bearing)
    try:
        iron = fit_compass_errors(t_s, belt, shown)
    except ValueError as error:
        raise EchostepError(f"compass: {error}, and do it again") from error
    names = ("sin1", "cos1", "sin2", "cos2", "rms_rad")
    values: Values = {name: round(float(getattr(iron, name)), 5) for name in names}
    hard, soft = math.hypot(iron.sin1, iron.cos1), math.hypot(iron.sin2, iron.cos2)
    return {"compass": values}, (
        f"Iron turns the compass by up to {math.degrees(hard):.1f} degrees once and {math.degrees(soft):.1f} degrees twice a turn; "
        f"{math.degrees(iron.rms_rad):.1f} degrees are left"
    )


def find_legs(heard: ProbeResult, settings: GyroSettings, segments: LegLengths, walked_m: float) -> Found:
    """The scale of the wearer's legs, from a straight walk of known length."""
    t_s, rate = gyro_rates(heard, settings)
    there = np.isfinite(rate[:, :2]).all(axis=1)
    if there.sum() < LEAST_READINGS:
        raise EchostepError("thigh or calf gyro gives no values: run echostep doctor")
    thigh, calf = rate[there, 0], rate[there, 1]
    if thigh.std() > SWAPPED * calf.std() > 0.0:
        raise EchostepError(
            "the thigh turns faster than the calf: are the two gyros swapped? swap them, and do it again"
        )
    legs = StrideEstimator(StrideSettings(segments))
    strides = (*legs.feed(t_s[there], thigh, calf), *legs.finish())
    distance_m = sum(stride.length_m for stride in strides)
    if distance_m < 0.3 * walked_m or distance_m > 3.0 * walked_m:
        seen = f"{distance_m:.1f} m in {len(strides)} strides were seen"
        raise EchostepError(f"{seen}: walk {walked_m:g} m straight on, stand still before and after, and do it again")
    scale = calibrated_scale(distance_m, walked_m)
    values: Values = {"thigh_m": segments.thigh_m, "shank_m": segments.shank_m, "leg_scale": round(scale, 4)}
    line = f"The walk of {walked_m:g} m was seen as {distance_m:.2f} m in {len(strides)} strides: scale {scale:.3f}"
    return {"wearer": values}, line
