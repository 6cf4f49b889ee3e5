# SPDX-License-Identifier: MIT
"""The time of day of a recording.

In: its metadata. Out: Unix times of arrival times, and the offset between the two clocks; None if the time of day was not recorded, as in a
simulation. Owns nothing. The clock of the arrivals never steps; its offset from UTC is therefore read once, at the start.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime, timedelta

LOG_TIME, IS_UTC = "log_time", "UTC"  # metadata key and value of a file whose messages have times in UTC
_EPOCH = datetime.fromtimestamp(0, UTC)
_LATEST_NS = 1 << 62  # year 2116


def utc_offset_ns(metadata: Mapping[str, str]) -> int | None:
    """UTC minus arrival time, ns; None without a usable clock in the metadata."""
    try:
        started = datetime.fromisoformat(metadata["started_utc"])
        started_ns = int(metadata["started_ns"])
        offset_ns = (started - _EPOCH) // timedelta(microseconds=1) * 1000 - started_ns
    except (KeyError, ValueError, OverflowError, TypeError):  # TypeError: without a time zone
        return None
    return offset_ns if 0 <= offset_ns < _LATEST_NS else None


def clock_of(metadata: Mapping[str, str]) -> Callable[[int], float] | None:
    """Arrival time in ns -> Unix time in s; None without a usable clock in the metadata."""
    offset_ns = utc_offset_ns(metadata)
    return None if offset_ns is None else lambda arrival_ns: (arrival_ns + offset_ns) * 1e-9


def log_offset_ns(metadata: Mapping[str, str]) -> int:
    """Log time minus arrival time of a file with these metadata, ns; 0 without the key, as in older files, and where the time of day is not known."""
    return utc_offset_ns(metadata) or 0 if metadata.get(LOG_TIME) == IS_UTC else 0


def with_log_time(metadata: Mapping[str, str]) -> dict[str, str]:
    """The metadata of a new file: its messages have times in UTC where the time of day is known."""
    others = {key: value for key, value in metadata.items() if key != LOG_TIME}
    return others if utc_offset_ns(metadata) is None else others | {LOG_TIME: IS_UTC}
