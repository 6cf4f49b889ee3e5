# SPDX-License-Identifier: MIT
"""The rows of the study: one for each figure of a recording, of a set, and of the live foot.

In: nothing. Out: `FigureRow`. Owns nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

from msgspec import UNSET, UnsetType


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureRow:
    """A figure in metres, or as the metric says; `left_out`: the same under the constants that the other sets would choose, where that was asked."""

    set: str
    recording: str
    metric: str
    value: float
    distance_m: float | None
    peer: float | None
    peer_name: str | None
    left_out: float | UnsetType | None = UNSET
