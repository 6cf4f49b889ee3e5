# SPDX-License-Identifier: MIT
"""The kits of parts that a simulated board may have.

In: nothing. Out: `Kit`. Owns the names.
"""

from __future__ import annotations

from enum import Enum


class Kit(Enum):
    """Which parts are on the board: the papers' parts, or the kit of 2026 (firmware/README.md; not built yet)."""

    PAPERS = "papers"
    OF_2026 = "2026"
