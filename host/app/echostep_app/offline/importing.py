# SPDX-License-Identifier: MIT
"""A foot IMU's file as a recording that the tracker replays.

In: `Imu`. Out: an MCAP recording of MTData2 messages that hold the samples as 32-bit floats. Owns nothing.
A message arrives at the time of its sample, counted from the first; a gap in the times is a gap in the counter.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from echostep.arrays import Floats
from echostep.offline.imu_csv import Imu
from echostep.ports.chunks import MTX, Chunk
from echostep.xsens import MTDATA2, encode_frame
from echostep_app.recording.recorder import Recorder

GAP = 1.5  # periods: a longer step is a gap
_SAMPLE = struct.Struct(">HBHHB3fHB3f")  # packets of identifier, length and value [LLCP, MTData2]
_COUNTER, _ACCEL, _GYRO = 0x1020, 0x4020, 0x8020


def import_imu(imu: Imu, name: str, out: Path, about: Mapping[str, str]) -> str:
    """Record the samples of the file `name` in the new file `out`, `about` beside them; returns what was recorded, in words. Raises EchostepError."""
    t_s, rate_hz = imu.t_s - imu.t_s[0], rate_of(imu.t_s)
    counts, first = np.unique(np.round(t_s * rate_hz).astype(np.int64), return_index=True)
    settings = f"[mtx]\nrate_hz = {rate_hz!r}\nlatency_s = 0.0\n\n[gait]\nfoot_left_m = 0.0\n"
    fields = {**about, "note": f"imported from {name}: a foot IMU, no other sensor", "settings_toml": settings}
    rows = zip(counts.tolist(), t_s[first].tolist(), imu.accel[first].tolist(), imu.gyro[first].tolist(), strict=True)
    with Recorder(out, fields) as recorder:
        for count, at_s, accel, gyro in rows:
            payload = _SAMPLE.pack(_COUNTER, 2, count & 0xFFFF, _ACCEL, 12, *accel, _GYRO, 12, *gyro)
            chunk = Chunk(MTX, round(1e9 * at_s), encode_frame(MTDATA2, payload))
            recorder.wait_for_disk(chunk)
            recorder.write(chunk)
    recorder.check_whole()
    left_out = len(t_s) - len(first)
    begin = f"t_s of its track counts from {imu.t_s[0]:.3f} s in the file"
    return f"{len(first)} samples at {rate_hz:.4g} Hz, {left_out} left out as within the same period; {begin}"


def rate_of(t_s: Floats) -> float:
    """Samples a second, from the times (n,), without the gaps; times in whole milliseconds give it, too."""
    steps = np.diff(t_s)
    steps = steps[steps > 0.0]
    return round(1.0 / float(steps[steps < GAP * np.median(steps)].mean()), 3)
