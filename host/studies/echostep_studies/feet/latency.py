# SPDX-License-Identifier: MIT
"""Latency of the step events and processor time of the foot filter, fed sample by sample.

In: a recording. Out: seconds of data from the begin of a stance to the step that it ends, and the share of one core at 200 Hz. Owns nothing.
"""

from __future__ import annotations

from time import process_time

import numpy as np

from echostep.foot.steps import Foot, Step
from echostep_studies.bench.recordings.feet import FootRecording
from echostep_studies.feet.leave_one_out import FigureRow

LIVE_HZ = 200.0
LIVE = "live"  # the `set` of these rows


def pace(recording: FootRecording) -> tuple[list[float], float]:
    """Latency (s) of each step, and processor seconds a sample."""
    foot, late = Foot(), []
    t_s, accel, gyro = recording.t_s, recording.accel, recording.gyro
    began = process_time()
    for k in range(len(t_s)):
        for event in foot.feed(t_s[k : k + 1], accel[k : k + 1], gyro[k : k + 1]):
            if isinstance(event, Step):
                late.append(float(t_s[k] - event.t_end_s))
    return late, (process_time() - began) / len(t_s)


def pace_rows(recordings: list[FootRecording]) -> list[FigureRow]:
    """Latency and cost over all recordings; the values are seconds and a share, as the metrics say."""
    pace(recordings[0])  # not counted: kernels compile
    paces = [pace(recording) for recording in recordings]
    late = [seconds for part, _ in paces for seconds in part]
    cost = float(np.mean([seconds for _, seconds in paces]))
    figures = {
        "step told after its stance began, median, s": float(np.median(late)),
        "step told after its stance began, worst, s": max(late),
        f"share of a core at {LIVE_HZ:.0f} Hz, sample by sample": cost * LIVE_HZ,
    }
    return [
        FigureRow(
            set=LIVE, recording="all", metric=metric, value=round(value, 4), distance_m=None, peer=None, peer_name=None
        )
        for metric, value in figures.items()
    ]
