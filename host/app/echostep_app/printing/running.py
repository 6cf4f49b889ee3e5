# SPDX-License-Identifier: MIT
"""What page and terminal say while the foot rests too briefly for a walk.

In: the newest segment and its estimate. Out: a note of a few words, beside the status, which stays as it is. Owns the words.
"""

from __future__ import annotations

from echostep.localization import Estimate, claims_place
from echostep.path import PathSegment


def running_note(segment: PathSegment | None, estimate: Estimate | None) -> str:
    """That the foot runs, with the 95 % radius of a position that may be named; empty while it walks or stands, or is not worn."""
    if segment is None or estimate is None or not segment.running:
        return ""
    if not claims_place(estimate):
        return "running"
    return f"running: position good to about {estimate.ellipse95.major_m:.1f} m"
