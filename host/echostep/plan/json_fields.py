# SPDX-License-Identifier: MIT
"""Checks of fields in untrusted JSON.

In: a value and its path in the file, as `levels[0].doors[2].line`. Out: the value with its type, or a ValueError that begins with the path.
Owns nothing.
"""

from __future__ import annotations

from typing import Any

from echostep.fields import short

LIMIT_M = 1e5  # greatest coordinate: 100 km, more than any site


def number(value: Any, where: str, limit: float = LIMIT_M, unit: str = "m") -> float:
    """A finite number within +-limit."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= limit:
        raise ValueError(f"{where}: {short(value)} is not a finite number within {limit:.0f} {unit}")
    return float(value)


def text(value: Any, where: str) -> str:
    """A string that can be written as UTF-8."""
    if not isinstance(value, str) or any("\ud800" <= letter <= "\udfff" for letter in value):
        raise ValueError(f"{where}: {short(value)} is not a text")
    return value


def typed(value: Any, where: str, kind: type) -> Any:
    """A value of type `kind`: list, or dict (an object)."""
    if not isinstance(value, kind):
        raise ValueError(f"{where}: expected {'a list' if kind is list else 'an object'}, found {type(value).__name__}")
    return value
