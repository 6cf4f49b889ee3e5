"""An Xsens MTx on the foot: what it feels, as the bytes that it would send.

In: a walk, a seeded generator. Out: samples at its own rate: when taken, and the MTData frame. Owns the sensor's constant errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from echostep.simulation.walker import RATE_HZ, Walk
from echostep.xsens import MTDATA, MtSample, encode_frame, pack_mtdata

Floats = NDArray[np.float64]

GRAVITY_M_S2 = 9.81
FIELD = np.array([0.4, 0.0, -0.9])  # earth's field in north, west, up: unit length, inclination 66 degrees


@dataclass(frozen=True, slots=True)
class MtxModel:
    """Errors after the MTx data sheet (noise densities; bias as left by its calibration), its crystal, and its cable.

    `drift_ppm`: its clock against the board's. `latency_s`: from sample to the last byte at 115200 Bd. `poll_s`: the USB adapter hands
    over what it has this often.
    """

    rate_hz: float = 100.0
    gyro_noise: float = math.radians(0.05)
    gyro_bias_rad_s: float = math.radians(0.2)
    accel_noise: float = 0.002
    accel_bias_m_s2: float = 0.02
    mag_noise: float = 0.005
    drift_ppm: float = 30.0
    latency_s: float = 0.0071
    jitter_s: float = 0.0003
    poll_s: float = 0.001
    first_counter: int = 65_000  # so that it wraps within a short walk


@dataclass(frozen=True, slots=True)
class MtxStream:
    """`t_s` (n,): the sample instants, when SyncOut rises; `arrival_s` (n,): when the host gets the bytes; `frames` (n)."""

    t_s: Floats
    arrival_s: Floats
    frames: list[bytes]


def rotations(rpy: Floats) -> Floats:
    """Rotation matrices (n, 3, 3) foot -> map of roll, pitch, yaw (n, 3): yaw about z, then pitch about y, then roll about x."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy).T, np.sin(rpy).T
    return np.stack(
        [
            np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], -1),
            np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], -1),
            np.stack([-sp, cp * sr, cp * cr], -1),
        ],
        axis=1,
    )


def feelings(walk: Walk) -> tuple[Floats, Floats]:
    """Specific force (m/s2) and angular rate (rad/s) of the foot in its own frame at 1 kHz, without error."""
    r = rotations(walk.foot_rpy_rad)
    dt = 1.0 / RATE_HZ
    accel = np.zeros_like(walk.foot_m)
    accel[1:-1] = (walk.foot_m[2:] - 2.0 * walk.foot_m[1:-1] + walk.foot_m[:-2]) / dt**2
    accel[:, 2] += GRAVITY_M_S2
    force = np.einsum("nji,nj->ni", r, accel)
    turn = np.einsum("nji,njk->nik", r[:-1], r[1:])
    rate = np.zeros_like(force)
    rate[:-1] = 0.5 * np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1
    )
    return force, rate / dt


def stream(walk: Walk, model: MtxModel, rng: np.random.Generator) -> MtxStream:
    """All samples of a walk, each the mean over its interval, as an MTx gives them."""
    period = (1.0 + model.drift_ppm * 1e-6) / model.rate_hz
    count = int((walk.t_s[-1] - 0.1) / period)
    t: Floats = 0.05 + period * np.arange(1, count, dtype=np.float64)
    force, rate = (_means(v, t, period) for v in feelings(walk))
    root = math.sqrt(model.rate_hz)
    accel = (
        force
        + model.accel_bias_m_s2 * rng.standard_normal(3)
        + model.accel_noise * root * rng.standard_normal(force.shape)
    )
    gyro = (
        rate
        + model.gyro_bias_rad_s * rng.standard_normal(3)
        + model.gyro_noise * root * rng.standard_normal(rate.shape)
    )
    at = np.minimum((t * RATE_HZ).astype(int), len(walk.t_s) - 1)
    r = _mt_world(rotations(walk.foot_rpy_rad[at]))
    mag = np.einsum("nji,j->ni", r, FIELD) + model.mag_noise * rng.standard_normal(accel.shape)
    q = quaternions(r)
    frames = [
        encode_frame(
            MTDATA, pack_mtdata(MtSample((model.first_counter + n) & 0xFFFF, tuple(a), tuple(g), tuple(m), tuple(o)))
        )
        for n, (a, g, m, o) in enumerate(zip(accel.tolist(), gyro.tolist(), mag.tolist(), q.tolist(), strict=True))
    ]
    late = t + model.latency_s + model.jitter_s * rng.exponential(size=len(t))
    arrival: Floats = np.maximum.accumulate(np.ceil(late / model.poll_s) * model.poll_s)
    return MtxStream(t, arrival, frames)


def _means(values: Floats, t: NDArray[Any], period: float) -> Floats:
    """Mean of 1 kHz values (n, 3) over the interval that ends at each t, exactly by the running integral."""
    integral = np.vstack([np.zeros(3), np.cumsum(values, axis=0)]) / RATE_HZ
    grid = np.arange(len(integral)) / RATE_HZ - 0.5 / RATE_HZ
    end, start = (np.column_stack([np.interp(x, grid, integral[:, k]) for k in range(3)]) for x in (t, t - period))
    return (end - start) / period


def _mt_world(r: Floats) -> Floats:
    """Foot -> map (x east, y north) into foot -> MT world (x north, y west)."""
    return np.stack([r[:, 1], -r[:, 0], r[:, 2]], axis=1)


def quaternions(r: Floats) -> Floats:
    """Unit quaternions (n, 4), w x y z, of rotation matrices (n, 3, 3) [Shepperd 1978]."""
    trace = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    squares = np.stack([trace, *(2.0 * r[:, i, i] - trace for i in range(3))], axis=1)
    best = squares.argmax(1)
    columns = np.stack(
        [
            np.stack([1 + trace, r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], -1),
            np.stack(
                [r[:, 2, 1] - r[:, 1, 2], 1 + squares[:, 1], r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0]], -1
            ),
            np.stack(
                [r[:, 0, 2] - r[:, 2, 0], r[:, 0, 1] + r[:, 1, 0], 1 + squares[:, 2], r[:, 1, 2] + r[:, 2, 1]], -1
            ),
            np.stack(
                [r[:, 1, 0] - r[:, 0, 1], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1], 1 + squares[:, 3]], -1
            ),
        ],
        axis=1,
    )
    q = columns[np.arange(len(r)), best]
    return q / np.linalg.norm(q, axis=1, keepdims=True)
