# SPDX-License-Identifier: MIT
"""`echostep calibrate accelerometers`: every six-axis part of both boards lies on each of its six sides.

In: the boards' ports. Out: `ImuSettings` by place, and a line for each. Owns the instructions, and the poses so far.
Gravity is the value of the foot's navigation, 9.81 m/s2: so a resting foot is at rest there, at any latitude.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from rich.console import Console

from echostep.arrays import Bools, Floats
from echostep.board.calibration import GYROS, ImuSettings, foot_axes, six_axes
from echostep.board.messages import FOOT_HEALTH_TEMPERATURE_INVALID, ROWS, Foot, Gyro, Motion
from echostep.errors import EchostepError
from echostep.foot.ins import GRAVITY_M_S2
from echostep.timing.timeline import TICKS_PER_S
from echostep_app.board.faults.device_faults import foot_celsius, gyro_celsius
from echostep_app.commissioning.imu_errors import POSES, RestPose, check_unlike, fit_errors, pose_of
from echostep_app.commissioning.probe import SETTLED_S, ProbeResult
from echostep_app.printing.lines import faults_of

TRIES = 3  # of each pose; assumed
FOOT_PLACE = "foot"
REQUEST = "Pose {number} of {count}: lay {parts} on another side, each on a side on which it has not lain, and let go."
EVERYTHING = "the boxes of belt, thigh, calf and foot"

Listen = Callable[[str], list[ProbeResult]]  # results of each board, while this text is shown


class Lying(NamedTuple):
    """Measurements of one part at rest: forces (n, 3) m/s2, rates (n, 3) rad/s, and its temperature."""

    forces: Floats
    rates: Floats
    celsius: float


def parts_of(probed: ProbeResult) -> dict[str, Lying]:
    """The six-axis parts that gave values, by place."""
    parts = {}
    if motions := [message for message in probed.axes if isinstance(message, Motion)]:
        rows = np.array(motions, ROWS[motions[0].id])
        for place in GYROS:
            rates, forces = six_axes(rows, place)
            valid = np.isfinite(forces).all(axis=1) & np.isfinite(rates).all(axis=1) & _settled(probed, Motion)
            gyro = probed.reports.gyros.get(Gyro[place.upper()])
            if valid.any():
                parts[place] = Lying(forces[valid], rates[valid], 0.0 if gyro is None else gyro_celsius(gyro))
    if probed.foot:
        rows = np.array(probed.foot, ROWS[probed.foot[0].id])
        rates, forces = foot_axes(rows)
        late = _settled(probed, Foot)
        health = probed.reports.foot
        counts = FOOT_HEALTH_TEMPERATURE_INVALID if health is None else health.temperature
        celsius = 0.0 if counts == FOOT_HEALTH_TEMPERATURE_INVALID else foot_celsius(counts)
        parts[FOOT_PLACE] = Lying(forces[late], rates[late], celsius)
    return parts


def _settled(probed: ProbeResult, kind: type[Motion | Foot]) -> Bools:
    """Which messages (n,) of a kind came after SETTLED_S; those before may have been measured before the part lay."""
    return np.array(probed.ticks[kind.__name__]) > SETTLED_S * TICKS_PER_S


def measure_poses(listen: Listen, console: Console) -> dict[str, ImuSettings]:
    """Errors of each part, by place; raises EchostepError with the remedy."""
    poses: dict[str, list[RestPose]] = {}
    celsius: dict[str, list[float]] = {}
    for number in range(1, POSES + 1):
        parts = _listed(list(poses)) if poses else EVERYTHING
        console.print(REQUEST.format(number=number, count=POSES, parts=parts))
        for place, (pose, warm) in _one_pose(listen, poses, f"Pose {number} of {POSES}", console).items():
            poses.setdefault(place, []).append(pose)
            celsius.setdefault(place, []).append(warm)
    settings = {}
    for place, lay in poses.items():
        with faults_of(place):
            settings[place] = fit_errors(lay, GRAVITY_M_S2, float(np.mean(celsius[place])))
    return settings


def _one_pose(
    listen: Listen, earlier: dict[str, list[RestPose]], text: str, console: Console
) -> dict[str, tuple[RestPose, float]]:
    """The pose and temperature of each part, asked for again while one of them moved or lies as before."""
    for tries_left in reversed(range(TRIES)):
        measured = {place: lying for probed in listen(text) for place, lying in parts_of(probed).items()}
        if not measured:
            raise EchostepError(
                "no part with an accelerometer answers: an LSM6DSO, or an ICM-20649 on a foot board (--foot); run echostep doctor"
            )
        try:
            return _checked(measured, earlier)
        except ValueError as error:
            if not tries_left:
                raise EchostepError(str(error)) from error
            console.print(f"{error}.")
    raise AssertionError


def _checked(measured: dict[str, Lying], earlier: dict[str, list[RestPose]]) -> dict[str, tuple[RestPose, float]]:
    """Poses and temperatures by place; raises ValueError that names the part."""
    poses = {}
    for place in earlier or measured:
        if place not in measured:
            raise ValueError(f"{place}: gives no values: check its plug")
        try:
            pose = pose_of(measured[place].forces, measured[place].rates)
            check_unlike(pose, earlier.get(place, []))
        except ValueError as error:
            raise ValueError(f"{place}: {error}") from error
        poses[place] = pose, measured[place].celsius
    return poses


def described(place: str, errors: ImuSettings) -> str:
    """Result of one part as text."""
    x, y, z = errors.offset.tolist()
    bias = ", ".join(f"{value:+.2f}" for value in np.degrees(errors.bias).tolist())
    scale = ", ".join(f"{100.0 * (value - 1.0):+.2f}" for value in errors.scale.tolist())
    return (
        f"{place}: offset {x:+.3f}, {y:+.3f}, {z:+.3f} m/s2, scale {scale} %, "
        f"gyro bias {bias} degrees/s at {errors.celsius:.0f} degC"
    )


def _listed(places: list[str]) -> str:
    """`the box of a`, or `the boxes of a, b and c`."""
    if len(places) == 1:
        return f"the box of the {places[0]}"
    return f"the boxes of {', '.join(places[:-1])} and {places[-1]}"
