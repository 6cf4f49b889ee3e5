# SPDX-License-Identifier: MIT
"""An Xsens MTx on the foot: its motion -> the bytes that it would send.

In: a walk, a seeded generator. Out: samples at its own rate: when taken, and the MTData frames. Owns the sensor's constant errors.
The versions for 18 g and 1200 deg/s, which a foot needs [Xsens MT0100P, 4.1 and 4.4].
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.arrays import Floats
from echostep.xsens import MTDATA, MtSample, encode_frame, pack_mtdata
from echostep_simulation.devices.onboard_filter import OnBoardFilter, orientations
from echostep_simulation.devices.serial_delivery import deliver
from echostep_simulation.people.attitude import quaternions, rotations, turns
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_simulation.world.magnetic_field import EARTH, MagneticField

GRAVITY_M_S2 = 9.81
ACCEL_LIMIT_M_S2, GYRO_LIMIT_RAD_S = 180.0, math.radians(1200.0)
FIRST_S = 0.05  # when the first sample's interval begins
COMPUTING_S = 0.002  # from the sample to the first byte
FOLLOW_S, LEAN_S = 5.0, 10.0  # how slowly the orientation filter follows the field, and forgets its tilt error


@dataclass(frozen=True, slots=True)
class MtxModel:
    """Errors after the MTx manual (noise densities; biases as left by its calibration), its crystal, its mounting and its cable.

    `drift_ppm`: its period against the board's clock. `mounting_rpy_rad`: sensor -> foot. `timer_s`: latency timer of the USB adapter.
    `yaw_walk_rad`: random walk of its yaw per square root of a metre of the foot's path, found on feet but in no data sheet; the field turns
    with it, so that no compass takes it out.
    `filter`: its on-board filter, fed with its measurements; None: a well-behaved one that only follows the field and leans a little.
    """

    rate_hz: float = 100.0
    gyro_noise: float = math.radians(0.1)
    gyro_bias_rad_s: float = math.radians(0.2)
    accel_noise: float = 0.004
    accel_bias_m_s2: float = 0.02
    mag_noise: float = 0.005
    lean_rad: float = math.radians(0.5)
    drift_ppm: float = 30.0
    mounting_rpy_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    jitter_s: float = 0.0003
    timer_s: float = 0.001
    first_counter: int = 65_000  # so that it wraps within a short walk
    yaw_walk_rad: float = 0.0
    filter: OnBoardFilter | None = None

    @property
    def baud(self) -> int:
        """The baud rate that the frames need."""
        return 115_200 if self.rate_hz <= 120.0 else 460_800


@dataclass(frozen=True, slots=True)
class MtxSamples:
    """Measurements of an MTx: `t_s` (n,); `accel` m/s2, `gyro` rad/s, `mag` earth fields (n, 3) in its axes; `orientation` (n, 3, 3) -> MT world."""

    t_s: Floats
    accel: Floats
    gyro: Floats
    mag: Floats
    orientation: Floats


@dataclass(frozen=True, slots=True)
class MtxStream:
    """`t_s` (n,): the sample instants, when SyncOut rises; `frames` (n) and `arrival_s` (n,): when the host has each; `portions` with the
    times `portion_s`: the same bytes as the serial driver hands them over.
    """

    t_s: Floats
    arrival_s: Floats
    frames: list[bytes]
    portion_s: Floats
    portions: list[bytes]


def specific_force_and_rate(walk: Walk, mounting: Floats | None = None) -> tuple[Floats, Floats]:
    """Specific force (m/s2) and angular rate (rad/s) (n, 3) at 1 kHz, without error, in the sensor's frame; `mounting` (3, 3) sensor -> foot."""
    r = rotations(walk.foot_rpy_rad) if mounting is None else rotations(walk.foot_rpy_rad) @ mounting
    accel = np.zeros_like(walk.foot_m)
    accel[1:-1] = (walk.foot_m[2:] - 2.0 * walk.foot_m[1:-1] + walk.foot_m[:-2]) * RATE_HZ**2
    accel[:, 2] += GRAVITY_M_S2
    rate = np.zeros_like(accel)
    rate[:-1] = turns(r) * RATE_HZ
    return np.einsum("nji,nj->ni", r, accel), rate


def stream(walk: Walk, model: MtxModel, rng: np.random.Generator, magnetism: MagneticField | None = None) -> MtxStream:
    """All samples of a walk, each the mean over its interval, as an MTx gives them."""
    imu = measure(walk, model, rng, magnetism)
    t, q = imu.t_s, quaternions(imu.orientation)
    counters = ((model.first_counter + np.arange(len(t))) & 0xFFFF).tolist()
    rows = zip(counters, imu.accel.tolist(), imu.gyro.tolist(), imu.mag.tolist(), q.tolist(), strict=True)
    frames = [encode_frame(MTDATA, pack_mtdata(MtSample(*row))) for row in rows]
    begin_s = t + COMPUTING_S + model.jitter_s * rng.exponential(size=len(t))
    portion_s, portions, arrival_s = deliver(frames, begin_s, model.baud, model.timer_s, rng)
    return MtxStream(t, arrival_s, frames, portion_s, portions)


def measure(
    walk: Walk, model: MtxModel, rng: np.random.Generator, magnetism: MagneticField | None = None
) -> MtxSamples:
    """All samples of a walk, each the mean over its interval, with their errors, before they become bytes."""
    period = (1.0 + model.drift_ppm * 1e-6) / model.rate_hz
    count = int((walk.t_s[-1] - 2.0 * FIRST_S) / period)
    t: Floats = FIRST_S + period * np.arange(1, count, dtype=np.float64)
    mounting = rotations(np.array([model.mounting_rpy_rad]))[0]
    force, rate = (means(v, t, period) for v in specific_force_and_rate(walk, mounting))
    root = math.sqrt(model.rate_hz)
    accel = _with_errors(force, model.accel_bias_m_s2, model.accel_noise * root, rng)
    gyro = _with_errors(rate, model.gyro_bias_rad_s, model.gyro_noise * root, rng)
    at = np.minimum((t * RATE_HZ).astype(int), len(walk.t_s) - 1)
    r = rotations(walk.foot_rpy_rad[at]) @ mounting
    field = magnetism.field(walk.foot_m[at, :2]) if magnetism else np.tile(EARTH, (len(t), 1))
    if model.yaw_walk_rad > 0.0:
        walked_m = np.hypot(*np.diff(walk.foot_m[at, :2], axis=0, prepend=walk.foot_m[at[:1], :2]).T)
        turn = model.yaw_walk_rad * np.sqrt(walked_m) * rng.spawn(1)[0].standard_normal(len(t))
        gyro += r[:, 2] * turn[:, None] / period
        field = np.einsum("nji,nj->ni", rotations(np.cumsum(turn)[:, None] * [0.0, 0.0, 1.0]), field)
    mag = np.einsum("nji,nj->ni", r, field) + model.mag_noise * rng.standard_normal(r.shape[:2])
    accel = np.clip(accel, -ACCEL_LIMIT_M_S2, ACCEL_LIMIT_M_S2)
    gyro = np.clip(gyro, -GYRO_LIMIT_RAD_S, GYRO_LIMIT_RAD_S)
    if model.filter is None:
        return MtxSamples(t, accel, gyro, mag, _mt_world(_believed(r, field, model, period, rng)))
    return MtxSamples(t, accel, gyro, mag, orientations(t, accel, gyro, mag, model.filter))


def _with_errors(true: Floats, bias: float, noise: float, rng: np.random.Generator) -> Floats:
    """Measurements (n, 3) with a constant error and with noise, given as standard deviations."""
    return true + bias * rng.standard_normal(3) + noise * rng.standard_normal(true.shape)


def _believed(r: Floats, field: Floats, model: MtxModel, period: float, rng: np.random.Generator) -> Floats:
    """The attitude that the sensor reports: its heading follows the disturbed field, its tilt wanders [MT0100P: 0.5 deg]."""
    error = np.zeros((len(r), 3))
    decay = math.exp(-period / LEAN_S)
    lean = model.lean_rad * math.sqrt(1.0 - decay * decay) * rng.standard_normal((len(r), 2))
    error[:, :2] = np.column_stack([_followed(lean[:, k] / (1.0 - decay), decay, 0.0) for k in (0, 1)])
    north = np.arctan2(field[:, 0], field[:, 1])
    error[:, 2] = _followed(north, math.exp(-period / FOLLOW_S), float(north[0]))
    return rotations(error) @ r


def _followed(wanted: Floats, decay: float, value: float) -> Floats:
    """A series after a filter of first order, beginning with a value."""
    values = np.empty(len(wanted))
    for k, aim in enumerate(wanted.tolist()):
        value = aim + decay * (value - aim)
        values[k] = value
    return values


def means(values: Floats, t: NDArray[Any], period: float) -> Floats:
    """Mean of 1 kHz values (n, 3) over the interval that ends at each t, exactly by the running integral."""
    integral = np.vstack([np.zeros(3), np.cumsum(values, axis=0)]) / RATE_HZ
    grid = np.arange(len(integral)) / RATE_HZ - 0.5 / RATE_HZ
    end, start = (np.column_stack([np.interp(x, grid, integral[:, k]) for k in range(3)]) for x in (t, t - period))
    return (end - start) / period


def _mt_world(r: Floats) -> Floats:
    """Sensor -> map (x east, y north) into sensor -> MT world (x north, y west)."""
    return np.stack([r[:, 1], -r[:, 0], r[:, 2]], axis=1)
