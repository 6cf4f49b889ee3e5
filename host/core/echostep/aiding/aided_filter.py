# SPDX-License-Identifier: MIT
"""The map filter with its aids: the readings of radio beacons on each segment, and meetings with teammates between segments.

In: the input of a `MapFilter`, `BeaconReading`s, `Meeting`s. Out: `Estimate`s; the effect of each meeting. Owns the beacon map, and the times of
meetings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from echostep.aiding.beacon_map import BeaconMap
from echostep.aiding.team.meeting import WRONG, Meeting, start_at
from echostep.aiding.team.meeting_memory import MeetingEffect, MeetingMemory, moved_by
from echostep.aiding.team.meetings import weigh_by
from echostep.beacons.model import BeaconSettings
from echostep.board.gateway import BeaconReading
from echostep.localization.building import Building
from echostep.localization.estimate import Estimate
from echostep.localization.grid.search import Search
from echostep.localization.map_filter import MapFilter
from echostep.localization.particles.cloud import Cloud
from echostep.localization.particles.start import Start
from echostep.localization.settings import FilterSettings
from echostep.particles.limits import PROBABLE
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Pose


class AidedFilter(MapFilter):
    """`beacon_map`: of the tracked cloud."""

    def __init__(
        self, building: Building, start: Start, walk_heading_rad: float, rng: np.random.Generator,
        settings: FilterSettings | None = None, beacons: BeaconSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame at the start."""
        super().__init__(building, start, walk_heading_rad, rng, settings)
        self.beacon_map = BeaconMap(building.walls, beacons or BeaconSettings(), rng)
        self._met = MeetingMemory(self.odometer)
        self._searches_met = 0
        self._readings: Sequence[BeaconReading] = ()

    def update(self, measured: MeasuredSegment, readings: Sequence[BeaconReading] = ()) -> Estimate:
        """The map filter's update, with the beacons' readings on the segment."""
        self._readings = readings
        return super().update(measured)

    def _aid(self, segment: PathSegment) -> None:
        """Reweight the tracked cloud, at the end of a segment, by the readings on the segment."""
        readings = self._readings
        if isinstance(self.cloud, Cloud):
            self.beacon_map.update(self.cloud, segment, readings, bool(readings) and self.plan_supports)

    def meet(self, meeting: Meeting) -> MeetingEffect:
        """Reweight the clouds by the place of a teammate next to the wearer, and choose the tracked one.

        Agreement raises the cloud's probability to at most the meeting's: both may stem from one source. A contradiction moves a doubted cloud, a
        believed one only when a second teammate contradicts too and that is likelier. A radio range beyond PLACE_M moves nothing; ranges to two
        teammates' beacons can begin a search.
        """
        area_m2 = self.building.floor.area_m2
        refusal = MeetingEffect.EMPTY if area_m2 <= 0.0 else self._refusal(meeting)
        if refusal is not None:
            return refusal
        fits = [weigh_by(each, meeting, area_m2) for each in self.belief.clouds]
        for each in self.belief.clouds:
            found = each.cloud.found() if isinstance(each.cloud, Search) else None
            if found is not None:
                self.belief.find(each, found)
        if meeting.beacon is not None:
            self.belief.normalise()
            return MeetingEffect.USED if fits[0] >= PROBABLE else MeetingEffect.CONTRADICTS
        tracked, wrong = self.belief.tracked, WRONG[meeting.status]
        if fits[0] >= PROBABLE:
            self.belief.raise_to(tracked, min(fits[0], 1.0 - wrong))
            self._met.agree()
            return MeetingEffect.USED
        moved = moved_by(meeting, self.belief.right, self._met.contradict())
        if moved is None:
            return MeetingEffect.CONTRADICTS
        self._met.agree()
        self._track_from(meeting, moved, search_fits=fits[-1] >= PROBABLE)
        return MeetingEffect.MOVED

    def _refusal(self, meeting: Meeting) -> MeetingEffect | None:
        """Why a meeting does not count; ranges to beacons count again for each new search."""
        if self.belief.searches_begun > self._searches_met:
            self._searches_met = self.belief.searches_begun
            self._met.forget_beacons()
        return self._met.refusal(meeting)

    def _track_from(self, meeting: Meeting, right: float, *, search_fits: bool) -> None:
        """Track the search from now on if it agrees with a meeting, otherwise a new cloud about the teammate, with any heading."""
        belief = self.belief
        if belief.search is not None and search_fits:
            belief.tracked, belief.search = belief.search, belief.tracked
            belief.search.table = None
        else:
            at = start_at(meeting)
            belief.tracked.cloud = self.new_cloud(Start(Pose(at.x_m, at.y_m, 0.0, at.level), at.sd_m, math.pi), 0.0)
        belief.raise_to(belief.tracked, right)
