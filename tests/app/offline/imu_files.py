# SPDX-License-Identifier: MIT
"""Files of a foot IMU, and a plan to walk on."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from echostep.offline.imu_csv import Imu


def write(file: Path, imu: Imu) -> None:
    rows = np.column_stack([imu.t_s, imu.accel, imu.gyro])
    np.savetxt(file, rows, delimiter=",", header="t_s,ax,ay,az,gx,gy,gz", comments="", fmt="%.9g")


def hall(file: Path, aside: int = 9) -> Path:
    """The plan of a hall of 49 m, `aside` m to either side of its middle."""
    walls = [[-aside, -9, aside, -9], [aside, -9, aside, 40], [aside, 40, -aside, 40], [-aside, 40, -aside, -9]]
    file.write_text(json.dumps({"echostep_plan": 1, "name": "Hall", "levels": [{"name": "0", "walls": walls}]}))
    return file
