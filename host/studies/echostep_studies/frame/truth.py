# SPDX-License-Identifier: MIT
"""The truth at the times of what is compared with it.

In: a table of what is true at known times. Out: its rows at other times. Owns nothing.
"""

from __future__ import annotations

import numpy as np

from echostep.arrays import Floats


def at_times(t_s: Floats, known_s: Floats, known: Floats) -> Floats:
    """Rows (n, k) at the times t_s (n,) of a table (m, k) that is known at known_s (m,), straight in between."""
    return np.column_stack([np.interp(t_s, known_s, column) for column in known.T])
