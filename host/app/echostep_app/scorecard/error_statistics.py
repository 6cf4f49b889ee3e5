# SPDX-License-Identifier: MIT
"""Statistics of errors.

In: errors (n,) in metres. Out: `ErrorStatistics`. Owns nothing. A percentile is linear between the order statistics [Hyndman and Fan 1996,
definition 7]; a standard deviation is of these errors, divided by n.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from echostep.arrays import Floats


@dataclass(frozen=True, slots=True)
class ErrorStatistics:
    """Statistics of `count` errors, in metres; `ending_m` is the last one."""

    count: int
    mean_m: float
    sd_m: float
    rms_m: float
    min_m: float
    median_m: float
    p75_m: float
    p90_m: float
    p95_m: float
    max_m: float
    ending_m: float


def error_statistics(error_m: Floats | Sequence[float]) -> ErrorStatistics:
    """Statistics of errors (n,), n > 0."""
    errors = np.asarray(error_m, dtype=np.float64)
    median, p75, p90, p95 = (quantile(errors, share) for share in (0.5, 0.75, 0.9, 0.95))
    return ErrorStatistics(
        len(errors), float(errors.mean()), float(errors.std()), float(np.sqrt((errors**2).mean())), float(errors.min()),
        median, p75, p90, p95, float(errors.max()), float(errors[-1]),
    )  # fmt: skip


def quantile(error_m: Floats, share: float) -> float:
    """The error below which a share of them lies."""
    return float(np.quantile(error_m, share))
