# SPDX-License-Identifier: MIT
"""What several tests of the simulation use."""

from __future__ import annotations

from echostep.board import messages as m
from echostep.board.frames import BoardReader
from echostep.xsens import MtSample, MtxReader
from echostep_simulation.devices.mtx import MtxModel

WAYPOINTS = ((0.0, 0.0), (6.0, 0.0), (6.0, 5.0))


SPEED_M_S = 343.2


FAULTLESS = MtxModel(
    gyro_noise=0.0,
    gyro_bias_rad_s=0.0,
    accel_noise=0.0,
    accel_bias_m_s2=0.0,
    mag_noise=0.0,
    drift_ppm=0.0,
    lean_rad=0.0,
)


def samples_of(frames: list[bytes]) -> list[MtSample]:
    """Each by a reader of its own: without noise samples repeat, which one reader does not believe."""
    return [sample for frame in frames for sample in MtxReader().feed(frame)]


def heard(sent: list[tuple[int, bytes]], reader: BoardReader | None = None) -> list[m.Message]:
    reader = reader or BoardReader()
    found = [x for _, part in sent for x in reader.feed(part)]
    assert reader.counts.rejected == reader.counts.lost == 0
    return found
