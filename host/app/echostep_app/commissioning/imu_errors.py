# SPDX-License-Identifier: MIT
"""Errors of an accelerometer and of its gyros from a part that lay still in several poses.

In: forces and rates of each pose, in the part's axes. Out: `ImuSettings`; ValueError with the remedy. Owns nothing.

At rest the true force has one size in every pose: with the right offset and scale of each axis the measured means lie on a sphere of that
radius, by least squares [Lotters et al. 1998, Procedure for in-use calibration of triaxial accelerometers]. No pose has to be level or known.
Errors between the axes are not estimated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from echostep.arrays import Floats
from echostep.board.calibration import AXES, ImuSettings

POSES = 6  # as many equations as unknowns; one for each side of a box
LEAST_SAMPLES = 100  # of a pose
STILL_M_S2 = 0.15  # largest sd of a force at rest; noise of the ICM-20649 is 0.033, of the LSM6DSO 0.02 [data sheets]
STILL_RAD_S = math.radians(1.5)  # the same of a rate; noise of the ICM-20649 is 0.22 deg/s
LEAST_M_S2 = 5.0  # at rest, half of gravity; assumed
DRIFT_M_S2 = 0.05  # between the means of both halves of a pose: three degrees of turn are more
ALIKE_RAD = math.radians(35.0)  # sides of a box are 90 degrees apart
POSE_ERROR_M_S2 = 0.02  # of a pose's mean: noise, and the 0.1 to 0.2 % by which parts are not linear; assumed
OFFSET_SD_M_S2 = 0.06  # largest sd that the poses may leave, three times the sd from six sides; assumed
TURNS = 8  # of Gauss and Newton; errors of 5 % need three


class RestPose(NamedTuple):
    """Means of a part at rest: `force` (3,) m/s2, `rate` (3,) rad/s."""

    force: Floats
    rate: Floats


def pose_of(forces: Floats, rates: Floats) -> RestPose:
    """Means of samples (n, 3); raises ValueError when there are few, or when the part moved."""
    if len(forces) < LEAST_SAMPLES:
        raise ValueError("gives too few values: run echostep doctor")
    half = len(forces) // 2
    drift = np.abs(forces[:half].mean(axis=0) - forces[half:].mean(axis=0))
    if (forces.std(axis=0) > STILL_M_S2).any() or (rates.std(axis=0) > STILL_RAD_S).any() or (drift > DRIFT_M_S2).any():
        raise ValueError("moved: let go of it, and do it again")
    pose = RestPose(forces.mean(axis=0), rates.mean(axis=0))
    if (size := float(np.linalg.norm(pose.force))) < LEAST_M_S2:
        raise ValueError(f"measures {size:.1f} m/s2 at rest: it is damaged; run echostep doctor")
    return pose


def angle_rad(a: RestPose, b: RestPose) -> float:
    """Angle between the measured forces of two poses."""
    cosine = a.force @ b.force / (np.linalg.norm(a.force) * np.linalg.norm(b.force))
    return math.acos(float(np.clip(cosine, -1.0, 1.0)))


def check_unlike(pose: RestPose, earlier: Sequence[RestPose]) -> None:
    """Raise ValueError when the part lies as in an earlier pose."""
    for k, other in enumerate(earlier):
        if (angle := angle_rad(pose, other)) < ALIKE_RAD:
            raise ValueError(
                f"lies as in pose {k + 1}, {math.degrees(angle):.0f} degrees from it: lay it on a side on which it has not lain"
            )


def fit_errors(poses: Sequence[RestPose], gravity_m_s2: float, celsius: float) -> ImuSettings:
    """Offset and scale of each axis, and the gyros' biases; raises ValueError when the poses do not determine them, or for a damaged part."""
    if len(poses) < POSES:
        raise ValueError(f"{len(poses)} poses are too few: {POSES} are needed")
    force = np.array([pose.force for pose in poses])
    offset, scale = np.zeros(3), np.ones(3)
    _check_geometry(_linearised(force, scale, gravity_m_s2)[0])
    for _ in range(TURNS):
        slope, residual = _linearised(force - offset, scale, gravity_m_s2)
        change = np.linalg.lstsq(slope, residual, rcond=None)[0]
        offset, scale = offset + change[:3], scale + change[3:] / gravity_m_s2
    bias = np.array([pose.rate for pose in poses]).mean(axis=0)
    values = np.concatenate([offset.round(4), scale.round(5), bias.round(6), [round(celsius, 1)]])
    return ImuSettings(*values.tolist())


def _check_geometry(slope: Floats) -> None:
    """Raise ValueError when poses with these slopes (n, 6) leave offsets or scales uncertain."""
    again = "lay it on each of its six sides, and do it again"
    if np.linalg.matrix_rank(slope) < slope.shape[1]:
        raise ValueError(f"its poses are too alike: {again}")
    sd = POSE_ERROR_M_S2 * np.sqrt(np.diag(np.linalg.inv(slope.T @ slope)))
    if sd.max() > OFFSET_SD_M_S2:
        axis = AXES[int(sd.argmax()) % 3]
        raise ValueError(f"its poses leave the error of its {axis} axis uncertain by {sd.max():.1f} m/s2: {again}")


def _linearised(force: Floats, scale: Floats, gravity_m_s2: float) -> tuple[Floats, Floats]:
    """Slopes (n, 6) of the true force's size by offset (m/s2) and by scale times gravity (m/s2), and gravity less that size (n,)."""
    true = force * scale
    size = np.linalg.norm(true, axis=1)
    along = true / size[:, None]
    return np.hstack([-along * scale, along * force / gravity_m_s2]), gravity_m_s2 - size
