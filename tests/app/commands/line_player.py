# SPDX-License-Identifier: GPL-3.0-or-later
"""A foot IMU that prints lines, played from a file: `line_player.py IMU.csv | echostep live --foot lines:-`.

In: a CSV file of a foot IMU. Out: its lines on standard output at the pace of their times, the names of the columns each second. Owns nothing.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from echostep.offline.imu_csv import COLUMNS
from echostep_app.offline.foot_files import load_foot

HEADER = ",".join(COLUMNS)


def lines(path: Path) -> Iterator[tuple[float, str]]:
    """Time from the beginning (s) and text of each line."""
    imu, next_s = load_foot(path), 0.0
    for t_s, force, rate in zip((imu.t_s - imu.t_s[0]).tolist(), imu.accel.tolist(), imu.gyro.tolist(), strict=True):
        if t_s >= next_s:
            yield t_s, HEADER
            next_s = t_s + 1.0
        yield t_s, ",".join(f"{value:.6g}" for value in (round(t_s, 6), *force, *rate))


def paced(path: Path, speed: float = 1.0) -> Iterator[str]:
    """The lines at the pace of their times, or at `speed` times that."""
    began_s = time.monotonic()
    for t_s, line in lines(path):
        time.sleep(max(0.0, t_s / speed - (time.monotonic() - began_s)))
        yield line


if __name__ == "__main__":
    with suppress(BrokenPipeError, KeyboardInterrupt):
        for line in paced(Path(sys.argv[1])):
            print(line, flush=True)
