# SPDX-License-Identifier: MIT
"""Calibration values from a few seconds of the board's samples: gyro biases, mounting of the belt gyro, compass errors, leg scale.

In: `ProbeResult`. Out: settings by section and a line for the wearer; EchostepError says which measurement to repeat, and how. Owns nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.board import calibration
from echostep.board.calibration import GYROS, GyroSettings, ImuSettings
from echostep.board.frames import BoardReader, encode
from echostep.board.messages import ROWS, Compass, Gyros
from echostep.board.tilt_compass import TiltCompass
from echostep.errors import EchostepError
from echostep.legs.heading import CompassErrors, harmonics
from echostep.legs.kinematics import LegLengths
from echostep.legs.stride import StrideSettings
from echostep.legs.strides import StrideEstimator
from echostep.settings import Settings
from echostep.timing.timeline import TICKS_PER_S
from echostep_app.commissioning.probe import ProbeResult
from echostep_app.offline.leg_track import calibrated_scale
from echostep_app.printing.lines import faults_of

Values = dict[str, float | bool]
Fit = tuple[dict[str, Values], str]

PIECE_S = 1.0  # a recording is divided into pieces of this length to find those at rest
LEAST_PIECE_SAMPLES = 20
# Of a piece at rest; noise of an ADIS16100 is 0.6 degrees/s in 40 Hz, a swaying wearer gives more
STILL_SD_RAD_S = math.radians(2.0)
STILL_SPREAD_RAD_S = math.radians(1.0)  # largest distance of a piece's mean from the median of the means
BIAS_MAX_RAD_S = math.radians(30.0)
USUAL_BIAS_DEG_S = 5.0  # five standard deviations of parts at room temperature (1 degree/s, as simulated; assumed)
USUAL_SCALE = (0.7, 1.4)  # of strides by legs whose lengths are known to a few centimetres; assumed
LEAST_STILL = 0.6  # share of pieces at rest
FULL_TURN_RAD = math.radians(300.0)  # a turn of 360 degrees, not quite finished
SWAPPED_RATIO = 1.15  # of the rates' sd, thigh to calf; in walking the shank turns faster than the thigh
LEAST_READINGS = 100  # of a gyro
LEAST_HEADINGS = 20


def gyro_rates(probed: ProbeResult, settings: GyroSettings | None = None) -> tuple[Floats, Floats]:
    """Times (n,) s and rates (n, 3) rad/s of thigh, calf and belt as it is worn, without their biases; NaN where a gyro gave none."""
    t_s = np.array(probed.ticks.get("Gyros", []), float) / TICKS_PER_S
    rows = np.array(probed.gyros, ROWS[Gyros(0, 0, 0, 0).id])
    return t_s, calibration.gyro_rates(rows, replace(settings or GyroSettings(), belt_reversed=False))


def headings(probed: ProbeResult, belt: ImuSettings | None = None) -> tuple[Floats, Floats]:
    """Times (n,) s and headings (n,) rad of a compass, or of a magnetometer, compensated for tilt as during tracking; invalid ones left out.

    `belt`: errors of the belt's accelerometer.
    """
    if by_field := not probed.compass and "Magnetic" in probed.ticks:
        sent = b"".join(encode(message, 0) for message in probed.axes)
        _, heading = TiltCompass(belt).headings(BoardReader().frames(sent))
    else:
        heading = calibration.compass_headings(np.array(probed.compass, ROWS[Compass(0, 0).id]))
    t_s = np.array(probed.ticks.get("Magnetic" if by_field else "Compass", []), float) / TICKS_PER_S
    good = np.isfinite(heading)
    return t_s[good], heading[good]


def still_bias(t_s: Floats, rate: Floats) -> tuple[float, float]:
    """Bias and noise (sd), rad/s, of a gyro that was at rest for most of the time; raises ValueError with the remedy."""
    valid = np.isfinite(rate)
    if valid.sum() < LEAST_READINGS:
        raise ValueError("it gave no values: run echostep doctor")
    piece = ((t_s[valid] - t_s[valid][0]) / PIECE_S).astype(int)
    pieces = [rate[valid][piece == k] for k in range(piece[-1] + 1) if (piece == k).sum() >= LEAST_PIECE_SAMPLES]
    quiet = [values for values in pieces if values.std() <= STILL_SD_RAD_S]
    means = np.array([values.mean() for values in quiet])
    calm = [v for v, mean in zip(quiet, means, strict=True) if abs(mean - np.median(means)) <= STILL_SPREAD_RAD_S]
    if len(calm) < LEAST_STILL * len(pieces):
        raise ValueError("it moved: stand still, or lay the board down, and do it again")
    still = np.concatenate(calm)
    if abs(still.mean()) > BIAS_MAX_RAD_S:
        raise ValueError(
            f"{math.degrees(still.mean()):.0f} degrees/s at rest: it turned evenly, or the gyro is damaged"
        )
    return float(still.mean()), float(still.std())


def fit_gyros(probed: ProbeResult) -> Fit:
    """Biases of the gyros that deliver samples."""
    t_s, rate = gyro_rates(probed)
    values: Values = {}
    parts = []
    for k, name in enumerate(GYROS):
        if not np.isfinite(rate[:, k]).any():
            parts.append(f"{name} none (it does not answer)")
            continue
        with faults_of(f"{name} gyro"):
            bias, noise = still_bias(t_s, rate[:, k])
        values[f"{name}_bias_rad_s"] = round(bias, 6)
        parts.append(f"{name} {math.degrees(bias):+.2f} degrees/s (noise {math.degrees(noise):.2f})")
    if not values:
        raise EchostepError("no gyro gives values: run echostep doctor")
    return {"gyro": values}, "Bias: " + ", ".join(parts)


def doubt(values: dict[str, Values]) -> str:
    """Why fitted values are implausible for a part or a person, and the remedy; empty if they are plausible."""
    for name in GYROS:
        bias = math.degrees(values.get("gyro", {}).get(f"{name}_bias_rad_s", 0.0))
        if abs(bias) > USUAL_BIAS_DEG_S:
            why = (
                f"a bias of {bias:+.1f} degrees/s is more than a sound gyro has; a turn at an even pace looks like that"
            )
            return f"{name} gyro: {why}: stand still, or lay everything on a table, and do it again"
    scale = values.get("wearer", {}).get("leg_scale", 1.0)
    if not USUAL_SCALE[0] <= scale <= USUAL_SCALE[1]:
        why = f"strides {scale:.2f} times as long as the legs' lengths give are nobody's"
        return f"legs: {why}: check --walked, --thigh and --shank, walk straight on, and do it again"
    return ""


def _turn(probed: ProbeResult, settings: Settings) -> tuple[Floats, Floats, Floats, Floats]:
    """Times (n,) s and rates (n,) rad/s of the belt gyro, times (k,) s and headings (k,) rad of the compass; raises EchostepError."""
    t_s, rate = gyro_rates(probed, settings.gyro)
    belt = rate[:, GYROS.index("belt")]
    valid = np.isfinite(belt)
    read_s, heading = headings(probed, settings.belt_imu)
    if valid.sum() < LEAST_READINGS or len(heading) < LEAST_HEADINGS:
        raise EchostepError("belt gyro or compass gives no values: run echostep doctor")
    return t_s[valid], belt[valid], read_s, heading


def fit_mounting(probed: ProbeResult, settings: Settings) -> Fit:
    """Whether the belt gyro is worn upside down: the sign of its correlation with the compass in a turn on the spot."""
    t_s, belt, read_s, heading = _turn(probed, settings)
    turned = np.concatenate([[0.0], np.cumsum(np.diff(t_s) * 0.5 * (belt[1:] + belt[:-1]))])
    by_gyro, by_compass = np.interp(read_s, t_s, turned), np.unwrap(heading)
    if np.ptp(by_compass) < FULL_TURN_RAD or np.ptp(by_gyro) < 0.5 * FULL_TURN_RAD:
        seen = f"{math.degrees(np.ptp(by_compass)):.0f} by the compass, {math.degrees(np.ptp(by_gyro)):.0f} by the belt gyro"
        raise EchostepError(
            f"the turn covers {seen} degrees: turn once round on the spot, slowly and evenly, and do it again"
        )
    upside_down = bool(np.corrcoef(by_gyro, by_compass)[0, 1] < 0.0)
    return {
        "gyro": {"belt_reversed": upside_down}
    }, f"The belt gyro is worn {'upside down' if upside_down else 'upright'}."


def fit_compass(probed: ProbeResult, settings: Settings) -> Fit:
    """Hard- and soft-iron errors of the compass, from a turn on the spot."""
    t_s, belt, read_s, heading = _turn(probed, settings)
    read = np.full(len(t_s), np.nan)
    read[np.clip(np.searchsorted(t_s, read_s), 0, len(t_s) - 1)] = heading
    with faults_of("compass", ", and do it again"):
        iron = fit_compass_errors(t_s, belt, read)
    names = ("sin1", "cos1", "sin2", "cos2", "rms_rad")
    values: Values = {name: round(float(getattr(iron, name)), 5) for name in names}
    hard, soft = math.hypot(iron.sin1, iron.cos1), math.hypot(iron.sin2, iron.cos2)
    return {"compass": values}, (
        f"Iron disturbs the compass by up to {math.degrees(hard):.1f} degrees once a turn (hard iron) "
        f"and {math.degrees(soft):.1f} degrees twice a turn (soft iron); "
        f"{math.degrees(iron.rms_rad):.1f} degrees are left"
    )


def fit_legs(probed: ProbeResult, settings: GyroSettings, segments: LegLengths, walked_m: float) -> Fit:
    """Scale between computed and true stride lengths, from a straight walk of known length."""
    t_s, rate = gyro_rates(probed, settings)
    valid = np.isfinite(rate[:, :2]).all(axis=1)
    if valid.sum() < LEAST_READINGS:
        raise EchostepError("thigh or calf gyro gives no values: run echostep doctor")
    thigh, calf = rate[valid, 0], rate[valid, 1]
    if thigh.std() > SWAPPED_RATIO * calf.std() > 0.0:
        raise EchostepError(
            "the thigh turns faster than the calf: the two gyros may be swapped: swap them, and do it again"
        )
    legs = StrideEstimator(StrideSettings(segments))
    strides = (*legs.feed(t_s[valid], thigh, calf), *legs.finish())
    distance_m = sum(stride.length_m for stride in strides)
    if distance_m < 0.3 * walked_m or distance_m > 3.0 * walked_m:
        seen = f"{distance_m:.1f} m in {len(strides)} strides were measured"
        raise EchostepError(f"{seen}: walk {walked_m:g} m straight on, stand still before and after, and do it again")
    scale = calibrated_scale(distance_m, walked_m)
    values: Values = {"thigh_m": segments.thigh_m, "shank_m": segments.shank_m, "leg_scale": round(scale, 4)}
    line = f"The walk of {walked_m:g} m was measured as {distance_m:.2f} m in {len(strides)} strides: scale {scale:.3f}"
    return {"wearer": values}, line


FEWEST_READINGS = 20  # three for each of the six unknowns, and more
LINEARIZATIONS = 6  # of the fit, each at the newest headings
LARGEST_IRON_RAD = math.radians(60.0)  # about an iron field as strong as the earth's
COMPASS_TURN_RAD = math.radians(330.0)  # to be turned: second harmonics bridge the rest
REWEIGHTINGS = 3  # of the readings in each, for outliers
MAD_TO_SD = 1.4826  # of a normal distribution
SMALLEST_SPREAD_RAD = math.radians(0.2)  # of the residuals: twice the compass's resolution


def fit_compass_errors(t_s: Floats, rate_rad_s: Floats, compass_rad: Floats) -> CompassErrors:
    """Compass errors by the wearer's iron, from samples (n,) of a full turn on the spot; raises ValueError that names the fault of the turn.

    Compass less gyro is an offset, a bias times time, and the iron. All six parameters are fitted by least squares, relinearized at the new headings.
    """
    turned = np.concatenate([[0.0], np.cumsum(np.diff(t_s) * 0.5 * (rate_rad_s[1:] + rate_rad_s[:-1]))])
    read = np.isfinite(compass_rad)
    if read.sum() < FEWEST_READINGS:
        raise ValueError("fewer than 20 readings of the compass: is it connected?")
    time, turn, compass = t_s[read] - t_s[0], turned[read], np.unwrap(compass_rad[read])
    _check_turn(turn, compass)
    if (compass[-1] - compass[0]) * (turn[-1] - turn[0]) < 0.0:
        turn = -turn
    offset, drift, iron = float(np.mean(compass - turn)), 0.0, np.zeros(4)
    for _ in range(LINEARIZATIONS):
        h = turn + offset + drift * time
        columns = np.column_stack([np.ones_like(h), time - time.mean(), *harmonics(h)])
        solution, residuals = _robust_least_squares(columns, compass - h)
        offset += float(solution[0]) - float(solution[1]) * float(time.mean())
        drift += float(solution[1])
        iron = solution[2:]
    if float(np.hypot(iron[0], iron[1])) > LARGEST_IRON_RAD:
        raise ValueError(
            "the iron beside the compass is stronger than the earth's field: move the compass away from it"
        )
    b, c, d, e = iron.tolist()
    return CompassErrors(b, c, d, e, float(np.sqrt(np.mean(residuals**2))))


def _check_turn(turn: Floats, compass: Floats) -> None:
    """Raise ValueError unless both the gyro's angle (n,) and the compass (n,), not wrapped, show the turn."""
    if float(np.ptp(turn)) < COMPASS_TURN_RAD:
        raise ValueError(
            f"the turn covers {math.degrees(float(np.ptp(turn))):.0f} degrees: turn once round on the spot, slowly"
        )
    if float(np.ptp(compass)) < 0.5 * COMPASS_TURN_RAD:
        raise ValueError("the compass does not follow the turn: is it stuck, or is there a magnet beside it?")


def _robust_least_squares(columns: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Solution (k,) for columns (n, k) and values (n,), and the residuals (n,); outliers get less weight in each of the REWEIGHTINGS."""
    weight = np.ones_like(values)
    for _ in range(REWEIGHTINGS):
        solution = np.asarray(np.linalg.lstsq(columns * weight[:, None], values * weight, rcond=None)[0], np.float64)
        residuals = values - columns @ solution
        spread = max(MAD_TO_SD * float(np.median(np.abs(residuals))), SMALLEST_SPREAD_RAD)
        weight = np.minimum(1.0, 2.0 * spread / np.maximum(np.abs(residuals), 1e-9)) ** 0.5
    return solution, residuals
