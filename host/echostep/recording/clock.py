# SPDX-License-Identifier: MIT
"""The time of day of a recording.

In: its metadata. Out: Unix times of arrival times; None where the time of day was not recorded, as in a simulation. Owns nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime


def clock_of(metadata: Mapping[str, str]) -> Callable[[int], float] | None:
    """Arrival time in ns -> Unix time in s; None without a usable clock in the metadata."""
    try:
        started = datetime.fromisoformat(metadata["started_utc"])
        started_ns = int(metadata["started_ns"])
        started_s = started.timestamp()
    except (KeyError, ValueError, OverflowError, OSError):
        return None
    if started.tzinfo is None:
        return None
    return lambda arrival_ns: started_s + (arrival_ns - started_ns) * 1e-9
