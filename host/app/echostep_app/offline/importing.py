# SPDX-License-Identifier: MIT
"""A foot IMU's file as a recording that the tracker replays.

In: `Imu`. Out: an MCAP recording of MTData2 messages that hold the samples as 32-bit floats. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.offline.imu_chunks import ImuChunks
from echostep.offline.imu_csv import Imu
from echostep.settings import imu_settings
from echostep_app.recording.recorder import Recorder

GAP = 1.5  # periods: a longer step is a gap


def import_imu(imu: Imu, name: str, out: Path, about: Mapping[str, str]) -> str:
    """Record the samples of the file `name` in the new file `out`, `about` beside them; returns what was recorded, in words. Raises EchostepError."""
    rate_hz = rate_of(imu.t_s)
    chunks = ImuChunks(rate_hz)
    note = f"imported from {name}: a foot IMU, no other sensor"
    with Recorder(out, {**about, "note": note, "settings_toml": imu_settings(rate_hz)}) as recorder:
        for chunk in chunks.of(imu.t_s, imu.accel, imu.gyro):
            recorder.wait_for_disk(chunk)
            recorder.write(chunk)
    recorder.check_whole()
    begin = f"t_s of its track counts from {imu.t_s[0]:.3f} s in the file"
    kept = len(imu.t_s) - chunks.left_out
    return f"{kept} samples at {rate_hz:.4g} Hz, {chunks.left_out} left out as within the same period; {begin}"


def rate_of(t_s: Floats) -> float:
    """Samples a second, from the times (n,), without the gaps; times in whole milliseconds give it, too."""
    steps = np.diff(t_s)
    steps = steps[steps > 0.0]
    return round(1.0 / float(steps[steps < GAP * np.median(steps)].mean()), 3)
