# SPDX-License-Identifier: MIT
"""Common parts of the payloads of chunks: JSON of a bounded size that is checked against a structure, and covariances.

In: bytes that may be damaged or hostile. Out: a structure, or None. Owns the limits of places.
"""

from __future__ import annotations

from typing import Annotated, TypeVar

import msgspec
from msgspec import Meta

MOST_LEVELS = 1000  # of a plan, assumed

Level = Annotated[int, Meta(ge=0, lt=MOST_LEVELS)]
Variance = Annotated[float, Meta(ge=0.0, le=1e12)]
T = TypeVar("T")


def decoded(payload: bytes | str, decoder: msgspec.json.Decoder[T], most_bytes: int) -> T | None:
    """The structure in a payload; None if the bytes are too many, or no such structure."""
    if len(payload) > most_bytes:
        return None
    try:
        return decoder.decode(payload)
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        return None


def is_covariance(xx_m2: float, xy_m2: float, yy_m2: float) -> bool:
    """Whether the three numbers are a covariance, to rounding: its determinant is not negative."""
    return xy_m2**2 <= xx_m2 * yy_m2 * (1.0 + 1e-9) + 1e-12
