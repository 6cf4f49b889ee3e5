# SPDX-License-Identifier: MIT
"""The feet of both kits: the way of Girard's 52 steps by the foot alone, with an MTx and with a foot board; the foot board was not built yet.

In: a seed. Out: rows: error of the foot's position at the end of each step, from its true place at the start. Everything is simulated: noise, bias
and limits of the data sheets, steps smoother than real ones; the firmware has no part in it (`make demo KIT=2026` has).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echostep.arrays import Floats
from echostep.board.calibration import ICM20649_M_S2, ICM20649_RAD_S
from echostep.foot.ins import GRAVITY_M_S2, Noise
from echostep.foot.steps import walk_track
from echostep.odometry import ICM20649_NOISE
from echostep_app.commissioning.imu_errors import fit_errors, pose_of
from echostep_simulation.devices.foot_board import MODEL
from echostep_simulation.devices.mtx import MtxModel, means, measure, specific_force_and_rate
from echostep_simulation.people.walker import RATE_HZ, Person, Walk, walk
from echostep_studies.bench.recordings.foot_metrics import from_true_start
from echostep_studies.girard2011.study import MethodRun
from echostep_studies.simulation.sites import otb

PACES = {"walking": Person(), "hurried": Person(stride_m=1.9, stride_s=0.8)}  # 1.2 and 2.4 m/s; assumed
SMALL_MTX_M_S2 = 50.0  # full scale of the MTx version of 5 g [Xsens MT0100P, 4.1]
LEAN_RAD = 0.05  # of each side on which the part lies; assumed
SIDES_RPY_RAD = np.pi / 2.0 * np.array([(0, 0, 0), (2, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
POSE_MS = 2500  # as in `echostep calibrate accelerometers`
PROFILE = "kits"  # of all rows
Samples = tuple[Floats, Floats, Floats]  # t_s (n,), accel, gyro (n, 3)


def rows(seed: int) -> list[MethodRun]:
    """Each device at each pace, on the same steps."""
    runs: list[MethodRun] = []
    waypoints = tuple((float(x), float(y)) for x, y in otb().route)
    for pace, person in PACES.items():
        walked = walk(waypoints, person, np.random.default_rng([seed, 11]))
        for name, (samples, noise) in devices(walked, seed).items():
            errors, label = errors_m(walked, samples, noise), f"foot alone, {pace}, {name}"
            runs.append(MethodRun(name=label, profile=PROFILE, seed=seed, errors_m=errors, inside95=[]))
    return runs


def measure_foot(walk: Walk, rng: np.random.Generator) -> Samples:
    """Samples of a foot board on a whole walk: t_s (n,), accel (n, 3) m/s2, gyro (n, 3) rad/s. Equal generators draw equal biases."""
    m = MODEL
    biases = [m.accel_bias_m_s2 * rng.standard_normal(3), m.gyro_bias_rad_s * rng.standard_normal(3)]
    t_s: Floats = np.arange(10.0 * m.period_s, walk.t_s[-1] - 0.05, m.period_s)
    force, rate = (means(v, t_s, m.period_s) for v in specific_force_and_rate(walk, np.eye(3)))
    measured = []
    for true, bias, noise, unit, limit in (
        (force, biases[0], m.accel_noise_m_s2, ICM20649_M_S2, m.force_limit_counts),
        (rate, biases[1], m.gyro_noise_rad_s, ICM20649_RAD_S, m.rate_limit_counts),
    ):
        noisy = true + bias + noise * rng.standard_normal(true.shape)
        measured.append(unit * np.clip(np.rint(noisy / unit), -limit, limit))
    return t_s, measured[0], measured[1]


def devices(walked: Walk, seed: int) -> dict[str, tuple[Samples, Noise]]:
    """What each device measures on this walk, and the error model by which it is navigated."""
    mtx = measure(walked, MtxModel(), np.random.default_rng([seed, 12]))
    small = np.clip(mtx.accel, -SMALL_MTX_M_S2, SMALL_MTX_M_S2)
    board = measure_foot(walked, np.random.default_rng([seed, 13]))
    return {
        "MTx 18 g": ((mtx.t_s, mtx.accel, mtx.gyro), Noise()),
        "MTx 5 g": ((mtx.t_s, small, mtx.gyro), Noise()),
        "foot board": (board, ICM20649_NOISE),
        "foot board, calibrated": (calibrated(board, walked, seed), ICM20649_NOISE),
    }


def calibrated(samples: Samples, walked: Walk, seed: int) -> Samples:
    """The same samples less the errors estimated from six poses of the same part; its temperature is that of the walk."""
    poses = []
    for side in SIDES_RPY_RAD:
        lying = replace(
            walked,
            t_s=walked.t_s[:POSE_MS],
            foot_m=np.zeros((POSE_MS, 3)),
            foot_rpy_rad=np.tile(side + LEAN_RAD, (POSE_MS, 1)),
        )
        poses.append(pose_of(*measure_foot(lying, np.random.default_rng([seed, 13]))[1:]))
    errors = fit_errors(poses, GRAVITY_M_S2, 0.0)
    t_s, accel, gyro = samples
    return t_s, errors.true_forces(accel), errors.true_rates(gyro)


def errors_m(walked: Walk, samples: Samples, noise: Noise) -> list[float]:
    """Distance of the foot from its true place at the end of each step; position and yaw are right at the start."""
    track = walk_track(*samples, noise=noise)
    ends = np.array([step.t_end_s for step in track.steps])
    at = np.searchsorted(track.t_s, ends).clip(max=len(track.t_s) - 1)
    estimated = from_true_start(track, walked, at)
    true = walked.foot_m[(ends * RATE_HZ).astype(int).clip(max=len(walked.foot_m) - 1), :2]
    errors: list[float] = np.hypot(*(estimated - true).T).tolist()
    return errors
