# SPDX-License-Identifier: MIT
"""The path between scans as the filter gets it: by the log's raw odometry, or by the corrected poses with noise where that does not fit.

In: a log. Out: `Odometry`: pieces of the path between any two scans, with the errors that it states. Owns nothing. Each log's odometry states the
root mean square of its own errors against the corrected poses, as a data sheet would.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from echostep.arrays import Floats
from echostep.elementary import wrap
from echostep_studies.bench.laser.carmen_log import CarmenLog

FITS_RAD = math.radians(10.0)  # error of a turn between two scans above which the odometry's times do not fit the scans
FITTING = 0.95  # least share of turns that fit
LENGTH_NOISE, TURN_NOISE_RAD = 0.03, math.radians(2.0)  # of the corrected increments, where the odometry does not fit
SAME_M = 0.01  # the odometry counts on from a scan's pose when it begins so near to it
PIECE_M, PIECE_RAD = 0.3, math.radians(10.0)  # a piece ends when it is so long or turns so much


@dataclass(frozen=True, slots=True)
class Odometry:
    """`steps[i]` (m, 3): pieces from scan i to the next, in the frame of the piece before: forward, left (m), turn (rad).

    `sd_m` per axis and `turn_sd_rad`: standard deviations over one scan. `source`: for the table.
    """

    steps: tuple[Floats, ...]
    sd_m: float
    turn_sd_rad: float
    source: str


def odometry_of(log: CarmenLog, rng: np.random.Generator) -> Odometry:
    """The raw odometry where it fits, else the corrected increments with noise."""
    true = relative(log.pose[:-1], log.pose[1:])
    steps = tuple(_pieces(chain) for chain in _chains(log))
    error = np.array([_end(s) for s in steps]) - true
    error[:, 2] = wrap(error[:, 2])
    if np.mean(np.abs(error[:, 2]) <= FITS_RAD) >= FITTING:
        sd_m = math.sqrt(0.5 * float(np.mean(error[:, 0] ** 2 + error[:, 1] ** 2)))
        return Odometry(steps, sd_m, math.sqrt(float(np.mean(error[:, 2] ** 2))), "raw odometry")
    noise = rng.standard_normal((2, len(true)))
    noisy = true * (1.0 + LENGTH_NOISE * noise[:1].T)
    noisy[:, 2] = true[:, 2] + TURN_NOISE_RAD * noise[1]
    sd_m = LENGTH_NOISE * float(np.sqrt(np.mean(true[:, 0] ** 2 + true[:, 1] ** 2)))
    return Odometry(tuple(noisy[:, None]), sd_m, TURN_NOISE_RAD, "corrected increments, 3 % and 2 degrees of noise")


def calibrated(odometry: Odometry, log: CarmenLog) -> Odometry:
    """The odometry without the turn on each metre that unequal wheels add: its least-squares fit to the corrected poses, as a robot is calibrated."""
    turn_rad = relative(log.pose[:-1], log.pose[1:])[:, 2]
    error_rad = wrap(np.array([step[:, 2].sum() for step in odometry.steps]) - turn_rad)
    way_m = np.array([float(np.hypot(step[:, 0], step[:, 1]).sum()) for step in odometry.steps])
    bias_rad_m = float(way_m @ error_rad) / max(float(way_m @ way_m), SAME_M)
    steps = tuple(
        np.column_stack([step[:, :2], step[:, 2] - bias_rad_m * np.hypot(step[:, 0], step[:, 1])])
        for step in odometry.steps
    )
    return replace(odometry, steps=steps)


def relative(a: Floats, b: Floats) -> Floats:
    """Poses b (n, 3) in the frames of poses a (n, 3): forward, left (m), turn (rad)."""
    c, s = np.cos(a[:, 2]), np.sin(a[:, 2])
    dx, dy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1]
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, wrap(b[:, 2] - a[:, 2])])


def _chains(log: CarmenLog) -> list[Floats]:
    """Odometry poses (m, 3) from each scan to the next, the one at the scan first."""
    chains, last = [], log.pose[:1]
    for pose, since in zip(log.pose[:-1], log.odometry[:-1], strict=True):
        counts_on = len(since) > 0 and math.hypot(*(since[0, :2] - pose[:2])) < SAME_M
        chains.append(since if counts_on else np.vstack([last, since]))
        last = chains[-1][-1:]
    return chains


def _pieces(chain: Floats) -> Floats:
    """Poses (m, 3) joined into pieces (k, 3) of PIECE_M or PIECE_RAD."""
    pieces, begin = [], chain[:1]
    for k in range(1, len(chain)):
        step = relative(begin, chain[k : k + 1])[0]
        if k == len(chain) - 1 or math.hypot(step[0], step[1]) >= PIECE_M or abs(step[2]) >= PIECE_RAD:
            pieces.append(step)
            begin = chain[k : k + 1]
    return np.array(pieces).reshape(-1, 3)


def _end(steps: Floats) -> Floats:
    """Pose (3,) after steps (k, 3), in the frame of the first."""
    x, y, heading = 0.0, 0.0, 0.0
    for ahead, left, turn in steps.tolist():
        x += math.cos(heading) * ahead - math.sin(heading) * left
        y += math.sin(heading) * ahead + math.cos(heading) * left
        heading += turn
    return np.array([x, y, wrap(heading)])
