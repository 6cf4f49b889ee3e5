# SPDX-License-Identifier: MIT
"""Aids of the map filter: radio beacons, and meetings with teammates.

In: the filter's hypotheses, beacons' readings, meetings. Out: the same hypotheses, reweighted; places of beacons. Owns the records of both.
The names below are its public interface; only its own tests look behind it.
"""

from typing import TYPE_CHECKING

from echostep.additions import face

if TYPE_CHECKING:
    from echostep.aiding.aided_filter import AidedFilter
    from echostep.aiding.beacon_map import BeaconPlace, BeaconState
    from echostep.aiding.team.meeting import TimedMeeting, carries_position, on_the_way, start_at
    from echostep.aiding.team.meeting_memory import MeetingEffect, MeetingNews, MeetingQueue
    from echostep.aiding.team.shared_beacons import MOST_TEAMMATES, TeamBeaconMap, shared_beacons

__getattr__ = face(__name__)
