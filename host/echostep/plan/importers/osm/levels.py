# SPDX-License-Identifier: MIT
"""Level tags of OpenStreetMap -> numbers.

In: tags (`level=0;1`, `level=-1-2`, `repeat_on=3-5`). Out: level numbers, ascending. Owns nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from echostep.errors import EchostepError

RANGE = re.compile(r"^(-?\d+(?:\.\d+)?)\s*-\s*(-?\d+(?:\.\d+)?)$")
MOST = 300  # greatest level number, and most levels in a range


def levels_of(tags: Mapping[str, str], where: str = "") -> list[float]:
    """The level numbers of an element; empty when no tag can be read. Raises EchostepError for an impossible range."""
    texts = f"{tags.get('level', '')};{tags.get('repeat_on', '')}".split(";")
    found: set[float] = set()
    for text in (text.strip() for text in texts):
        if match := RANGE.match(text):
            low, high = float(match[1]), float(match[2])
            if not 0 <= high - low <= MOST:
                raise EchostepError(f"{where}: level {text[:40]!r} is no range of levels: expected LOW-HIGH, as 0-5")
            found |= {low + step for step in range(int(high - low) + 1)}
        else:
            try:
                level = float(text)
            except ValueError:
                continue
            if math.isfinite(level) and abs(level) <= MOST:
                found.add(level)
    return sorted(found)
