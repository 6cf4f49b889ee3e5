# SPDX-License-Identifier: MIT
"""A foot board: the ICM-20649 on the foot, its inputs as rows for a separate board; it is not built yet.

In: a walk, a seeded generator, a board. Out: extended rows whose first place is the foot, in counts of the ICM-20649; the chunks of the board's port.
Owns the part's constant errors, and the board.

Figures of the data sheet DS-000192, tables 1 and 2, as remembered; biases are spread so that its limits are three standard deviations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from echostep.board.calibration import ICM20649_M_S2, ICM20649_RAD_S
from echostep.board.frames import encode
from echostep.board.reports import SUBSCRIBE
from echostep.ports.chunks import FOOT, Chunk
from echostep_simulation.devices.board import Board
from echostep_simulation.devices.mtx import means, specific_force_and_rate
from echostep_simulation.devices.serial_delivery import usb_chunks
from echostep_simulation.people.walker import RATE_HZ, Walk
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC

HEAD_START_MS = 1700  # time for which the foot board has power before the belt board: two boards do not start together
BLOCK_MS = 50
# The twin takes values between two rows, which leaves two thirds of a white noise's variance
INTERPOLATED = math.sqrt(1.5)
CELSIUS = 24.0


@dataclass(frozen=True, slots=True)
class FootBoardModel:
    """Errors of an ICM-20649 behind its 120 Hz filter; it is mounted along the foot's axes."""

    gyro_noise_rad_s: float = math.radians(0.0175 * math.sqrt(154.3))
    gyro_bias_rad_s: float = math.radians(5.0 / 3.0)
    accel_noise_m_s2: float = 285e-6 * 9.80665 * math.sqrt(136.0)
    accel_bias_m_s2: float = 0.065 * 9.80665 / 3.0
    force_limit_counts: int = 30 * 1024
    rate_limit_counts: int = 32_767
    period_s: float = 5.0 / 1125.0


MODEL = FootBoardModel()


class FootBoardSensors:
    """Makes the rows of any stretch of a walk, asked for in order; before its beginning the first posture is held."""

    def __init__(self, walk: Walk, rng: np.random.Generator) -> None:
        self._rng = rng
        t_s = (np.arange(len(walk.t_s)) + 1.0) / RATE_HZ  # a row is reached at the end of its millisecond
        force, rate = (means(v, t_s, MODEL.period_s) for v in specific_force_and_rate(walk, np.eye(3)))
        self._force = force + MODEL.accel_bias_m_s2 * rng.standard_normal(3)
        self._rate = rate + MODEL.gyro_bias_rad_s * rng.standard_normal(3)

    def rows(self, start: int, stop: int) -> NDArray[np.void]:
        """Rows of the milliseconds start..stop-1 of the walk."""
        at = np.clip(np.arange(start, stop), int(1e3 * MODEL.period_s) + 2, len(self._rate) - 3)
        rows = np.zeros(len(at), EXTENDED_ROW)
        rows["row"]["sync_us"], rows["row"]["temperature"] = NO_SYNC, round(20.0 * CELSIUS)
        for name, values, noise, unit, limit in (
            ("rate", self._rate, MODEL.gyro_noise_rad_s, ICM20649_RAD_S, MODEL.rate_limit_counts),
            ("force", self._force, MODEL.accel_noise_m_s2, ICM20649_M_S2, MODEL.force_limit_counts),
        ):
            noisy = values[at] + INTERPOLATED * noise * self._rng.standard_normal((len(at), 3))
            rows["motion"][name][:, 0] = np.clip(np.rint(noisy / unit), -limit, limit)
        return rows


class FootBoardPort:
    """The port of a foot board during a walk, besides the belt's; both are driven block by block."""

    def __init__(self, walk: Walk, rng: np.random.Generator, board: Board) -> None:
        self.sensors = FootBoardSensors(walk, rng)
        self.board = board
        board.fault("kit=foot")
        board.fault("crystal=drift")
        board.send(encode(SUBSCRIBE, 0))
        for start in range(-HEAD_START_MS, 0, BLOCK_MS):
            # The host listens from the beginning of the walk on
            board.advance(self.sensors.rows(start, start + BLOCK_MS))

    def chunks(self, start: int, stop: int, origin_ns: int) -> list[Chunk]:
        """Chunks that the host gets in these milliseconds; `origin_ns`: the host's clock at the walk's beginning."""
        sent = self.board.advance(self.sensors.rows(start, stop))
        return usb_chunks(FOOT, sent, origin_ns - HEAD_START_MS * 1_000_000)


def foot_rng(seed: int) -> np.random.Generator:
    """A separate generator, so that the belt's samples do not depend on the foot board."""
    return np.random.default_rng([seed, 7])
