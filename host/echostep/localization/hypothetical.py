# SPDX-License-Identifier: MIT
"""A cloud that may be the right one.

In: a cloud. Out: `Hypothetical`. Owns the probability that the cloud is right, and the doubts that beacons of teammates cast on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from echostep.localization.meeting_model import WRONG, share_of, weigh
from echostep.localization.particles import Cloud
from echostep.localization.plausibility import Plausibility
from echostep.ports.meeting import Meeting

MOST_DOUBT = math.log(WRONG["tracking"])  # of all ranges of one teammate: then this teammate is wrong
LEAST_WRONG = 1e-6  # probability that a range is wrong, at least, in a ratio


@dataclass(slots=True)
class Hypothetical:
    """A cloud, the probability that it is right, and whether it has contracted once: before that, echoes tell little of it.

    `is_stated`: it began where it was said to begin, so it should explain the echoes from the first on. `doubts`: log-odds that ranges to beacons of
    each teammate have taken from it. `judged_m`: length of the path on which it was judged by the echoes that it foretold.
    """

    cloud: Cloud
    plausibility: Plausibility
    is_stated: bool = False
    has_contracted: bool = False
    judged_m: float = 0.0
    doubts: dict[str, float] = field(default_factory=dict)

    def weigh_range(self, meeting: Meeting, area_m2: float) -> float:
        """Weigh the cloud by a range to a teammate's beacon; returns the probability that the range is right, given the cloud.

        A range that the cloud explains worse than chance casts doubt on it; one that it explains takes such doubt back, and gives nothing else.
        """
        right = weigh(self.cloud, meeting, area_m2)
        if self.has_contracted or self.is_stated:
            before = self.doubts.get(meeting.name, 0.0)
            after = before + share_of(meeting) * math.log(WRONG[meeting.status] / max(1.0 - right, LEAST_WRONG))
            self.doubts[meeting.name] = min(max(after, MOST_DOUBT), 0.0)
            self.plausibility.add(self.doubts[meeting.name] - before)
        return right
