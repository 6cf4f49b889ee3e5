"""The tracker: bytes in, estimates out. The one place where the stages meet.

In: chunks in order of arrival. Out: estimates. Owns the intake, the cloud and the random generator. Live, replay and simulation all come through
`Tracker.take`; nothing in here looks at a wall clock, so equal chunks give equal estimates, bit for bit, in whatever portions they come.
"""

from __future__ import annotations

import numpy as np

from echostep.errors import EchostepError
from echostep.estimate import Estimate, unwatched
from echostep.gait import Leg
from echostep.gateway import Gateway, Word
from echostep.heading import Iron
from echostep.intake import Intake
from echostep.mapfilter import MapFilter
from echostep.particles import systematic
from echostep.plan import Plan, Pose
from echostep.settings import Settings
from echostep.sources import GATEWAY, Chunk, Portion, portion_of
from echostep.storeys import building
from echostep.waiting import Passage

MOST_WORDS = 4096  # of beacons that wait for the foot; older ones are forgotten


class Tracker:
    """Feed it every chunk; it returns the estimates that the chunk completes."""

    def __init__(self, plan: Plan, start: Pose | None = None, settings: Settings | None = None, seed: int = 0) -> None:
        """`start`: where the trunk stands and looks at the beginning; the plan's own start when None."""
        pose = start or plan.start
        if pose is None:
            raise EchostepError("the plan has no start: give one with --start X,Y,DEG")
        if pose.level >= len(plan.levels):
            raise EchostepError(f"the start is on level {pose.level}, the plan has {len(plan.levels)}, counted from 0")
        self.settings = settings or Settings()
        self.plan = plan
        self.start = pose
        s = self.settings
        self.intake = Intake(
            s.mtx, s.ranger, s.foot, s.gait, s.wearer, s.gyro, None if s.compass == Iron() else s.compass
        )
        self.building = building(plan)
        self.filter: MapFilter | None = None  # from the moment when the foot has stood still
        self.gateway = Gateway()
        self._words: list[Word] = []  # that wait for their leg
        self._rng = np.random.default_rng(seed)
        self._last: Estimate | None = None

    def feed(self, chunk: Chunk) -> list[Estimate]:
        """Take one chunk; estimates come at the middle of each stance, and twice a second while standing."""
        return self.take(portion_of([chunk]))

    def take(self, portion: Portion) -> list[Estimate]:
        """Take many chunks; the estimates are those that the chunks would have given one by one."""
        return [e for piece in portion.cut_after(GATEWAY) for e in self._take(piece)]

    def _take(self, portion: Portion) -> list[Estimate]:
        """Take chunks of which the last alone may be the gateway's: what beacons said is known from then on."""
        estimates: list[Estimate] = []
        for piece in self.intake.take(portion):
            if isinstance(piece, Passage):
                self.filter = self.filter or self._begin(piece.leg.heading0_rad, self._rng)
                self._last = self.filter.follow(piece, self._words_until(piece.leg.t1_s))
                estimates.append(self._last)
            elif self._last is not None:
                estimates.append(unwatched(self._last, piece.t_s))
        if said := portion.of(GATEWAY).received:
            self._words += self.gateway.take(said, self.intake.newest_s)
        return estimates

    def _words_until(self, t_s: float) -> list[Word]:
        """What beacons have said up to then and nobody has heard yet."""
        words = [word for word in self._words if word.t_s <= t_s]
        self._words = [word for word in self._words if word.t_s > t_s][-MOST_WORDS:]
        return words

    def warm_up(self) -> None:
        """Compile the kernels (seconds, the first time on a machine), so that nothing waits for it later; leaves the tracker as it was."""
        self.intake.warm_up()
        leg = Leg(0.0, 1.0, 0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0)
        one = Passage(leg, np.array([0.5]), np.array([0]), np.array([1.0]))
        self._begin(0.0, np.random.default_rng(0)).follow(one)
        systematic(np.ones(2), 0.5, 2)

    def _begin(self, walk_heading_rad: float, rng: np.random.Generator) -> MapFilter:
        s, b = self.settings, self.building
        return MapFilter(b.walls, self.start, walk_heading_rad, rng, s.cloud, s.echo, b.storeys, s.climb, s.beacons)
