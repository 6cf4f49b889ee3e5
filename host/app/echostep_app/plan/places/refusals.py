# SPDX-License-Identifier: MIT
"""Limits on the use of a drawing, in words: storeys whose places are not known to a room.

In: a plan. Out: a sentence for each storey that is refused. Owns the words.
"""

from __future__ import annotations

import numpy as np

from echostep.plan import Plan


def refusals(plan: Plan) -> list[str]:
    """A sentence for each storey that is refused as a plan; none for a plan that was not drawn by a walk."""
    return [
        f"floor {level.name} of {plan.name} is refused as a plan: the places of its walls are known to "
        f"{float(np.median(level.place_sd[:, 2])):.1f} m only (1 sd); draw it again by a walk that comes back to known places"
        for level in plan.levels
        if level.is_refused
    ]
