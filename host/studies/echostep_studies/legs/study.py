# SPDX-License-Identifier: MIT
"""`echostep evaluate legs`: distances by leg gyros and by the foot, in every manner of moving, and the walks of [Lee 2010].

In: seeds. Out: rows `legs/natural`, `legs/upstairs`, `foot/walking`, `lap/lee2010`, `storeys`, ... Owns the order of the parts. Everything is
simulated; `recordings` has real legs.
"""

from __future__ import annotations

from typing import Any

from echostep_studies.frame.parts import study_of
from echostep_studies.frame.report import Row
from echostep_studies.frame.study import Study
from echostep_studies.legs import feet, lee_walks, manners, people

PARTS = (people.PART, manners.PART, feet.PART, lee_walks.PART)


def legs_study(pattern: str = "*") -> Study[Any, Row]:
    """The study of the rows whose names match a pattern."""
    return study_of("legs", PARTS, pattern)
