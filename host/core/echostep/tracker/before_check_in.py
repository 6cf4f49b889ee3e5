# SPDX-License-Identifier: MIT
"""The filter before a check-in, kept with all measurements since, so that the check-in can be undone.

In: the tracker's state at a check-in, then each measured segment with its beacon readings and meetings. Out: the same state, and these segments.
Owns the segments. After an undo the filter processes them as if there had been no check-in: the estimates from then on are those of a run
without it, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from echostep.aiding import AidedFilter, TimedMeeting
from echostep.board.gateway import BeaconReading
from echostep.localization import Estimate
from echostep.path import MeasuredSegment
from echostep.ports.people.check_in import CheckIn

# Time for which a check-in can be undone: 10 s for a person, in a demo at several times real time
UNDO_S = 120.0
MOST_KEPT = 2000  # segments: several times as many as a person walks in that time


@dataclass(slots=True)
class BeforeCheckIn:
    """State before a check-in: filter, newest check-in, newest estimate, state of the random generator.

    `since`: segments with their readings and meetings.
    """

    filter: AidedFilter | None
    check_in: CheckIn | None
    estimate: Estimate | None
    random_state: Any
    since: list[tuple[MeasuredSegment, list[BeaconReading], list[TimedMeeting]]] = field(default_factory=list)

    def add(self, measured: MeasuredSegment, readings: list[BeaconReading], meetings: list[TimedMeeting]) -> bool:
        """Keep a segment after the check-in; False when the check-in is too long ago to be undone."""
        self.since.append((measured, readings, meetings))
        begin_s = self.since[0][0].segment.t0_s
        return measured.segment.t1_s - begin_s < UNDO_S and len(self.since) < MOST_KEPT
