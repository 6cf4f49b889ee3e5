"""The tracker: bytes in, estimates out. The one place where the stages meet.

In: chunks in order of arrival. Out: estimates. Owns the intake, the cloud and the random generator. Live, replay and simulation all come through
`Tracker.take`; nothing in here looks at a wall clock, so equal chunks give equal estimates, bit for bit, in whatever portions they come.
"""

from __future__ import annotations

import math

import numpy as np

from echostep.calibration import Echo
from echostep.errors import EchostepError
from echostep.estimate import Estimate, estimate, unwatched
from echostep.gait import Leg
from echostep.intake import Intake
from echostep.likelihoods import echo_model
from echostep.particles import Cloud, systematic
from echostep.plan import Plan, Pose
from echostep.settings import Settings
from echostep.sources import Chunk, Portion, portion_of
from echostep.waiting import Passage
from echostep.walls import build_index

EXPLAINED_SHARE = 0.1
UNEXPLAINED = -1.5  # a tracked walk has +1, an echo that fits nowhere -5: the plan does not explain what is heard
LOST_SD_M = 3.0
REGAIN_M = 10.0
RANGER_AXES_RAD = (0.5 * math.pi, -0.5 * math.pi)


class Tracker:
    """Feed it every chunk; it returns the estimates that the chunk completes."""

    def __init__(self, plan: Plan, start: Pose | None = None, settings: Settings | None = None, seed: int = 0) -> None:
        """`start`: where the trunk stands and looks at the beginning; the plan's own start when None."""
        pose = start or plan.start
        if pose is None:
            raise EchostepError("the plan has no start: give one with --start X,Y,DEG")
        self.settings = settings or Settings()
        self.plan = plan
        self.start = pose
        self.intake = Intake(self.settings.mtx, self.settings.ranger, self.settings.foot, self.settings.gait)
        self.walls = build_index(plan.levels[0].walls)
        self.cloud: Cloud | None = None
        self._rng = np.random.default_rng(seed)
        self._model = echo_model(self.settings.echo)
        self._t_s = 0.0  # the cloud's time
        self.explained = 0.0  # mean log-probability of the last echoes under the cloud
        self._last: Estimate | None = None
        self._doubt_m = 0.0  # a cloud that was scattered may gather in the wrong place: trust returns as he walks
        self._share = 0.0  # of the first leg that the cloud has gone
        self._echo_xy: list[tuple[float, float] | None] = [None, None]
        self._xy = (0.0, 0.0)  # walk frame, of the cloud's time

    def feed(self, chunk: Chunk) -> list[Estimate]:
        """Take one chunk; estimates come at the middle of each stance, and twice a second while standing."""
        return self.take(portion_of([chunk]))

    def take(self, portion: Portion) -> list[Estimate]:
        """Take many chunks; the estimates are those that the chunks would have given one by one."""
        estimates: list[Estimate] = []
        for piece in self.intake.take(portion):
            if isinstance(piece, Passage):
                if self.cloud is None:
                    self.cloud = Cloud(self.settings.cloud, self.start, piece.leg.heading0_rad, self._rng)
                estimates.append(self._pass(self.cloud, piece))
            elif self._last is not None:
                estimates.append(unwatched(self._last, piece.t_s))
        return estimates

    def warm_up(self) -> None:
        """Compile the kernels (seconds, the first time on a machine), so that nothing waits for it later; leaves the tracker as it was."""
        self.intake.warm_up()
        cloud = Cloud(self.settings.cloud, self.start, 0.0, np.random.default_rng(0))
        cloud.move(0.01, 0.0, 0.01, 0.0, self.walls)
        cloud.weigh(0.0, 1.0, 0.1, self._model, self.walls)
        systematic(np.ones(2), 0.5, 2)

    # legs and echoes -> cloud

    def _pass(self, cloud: Cloud, passage: Passage) -> Estimate:
        """Move the cloud along a leg, from ping to ping."""
        leg = passage.leg
        if not leg.unwatched:
            columns = (passage.t_s.tolist(), passage.ranger.tolist(), passage.range_m.tolist())
            for t_s, ranger, range_m in zip(*columns, strict=True):
                self._hear(cloud, leg, Echo(t_s, ranger, None if math.isnan(range_m) else range_m))
        self._go(cloud, leg, leg.t1_s)
        self._share = 0.0
        self._last = estimate(cloud, leg.t1_s, leg.heading1_rad, leg.step, self._doubt_m)
        return self._last

    def _go(self, cloud: Cloud, leg: Leg, t_s: float) -> None:
        """Propagate along a leg up to a time; the leg's variance is spent evenly over it."""
        share = (t_s - leg.t0_s) / (leg.t1_s - leg.t0_s) if leg.t1_s > leg.t0_s else 1.0
        part = min(max(share, self._share), 1.0) - self._share
        self._share += part
        self._t_s = max(self._t_s, t_s)
        dx, dy = part * leg.dx_m, part * leg.dy_m
        if leg.unwatched:
            self._t_s = leg.t1_s
            cloud.scatter(leg.dx_m, leg.dy_m, leg.sd_m, leg.turn_sd_rad)
            self._doubt_m = math.hypot(self._doubt_m, leg.sd_m)
        elif dx or dy:
            self._xy = (self._xy[0] + dx, self._xy[1] + dy)
            self._doubt_m *= math.exp(-math.hypot(dx, dy) / REGAIN_M)
            root = math.sqrt(part)
            cloud.move(dx, dy, leg.sd_m * root, leg.turn_sd_rad * root, self.walls)

    def _hear(self, cloud: Cloud, leg: Leg, heard: Echo) -> None:
        """Move up to the ping and weigh by it, as far as it says anything new."""
        self._go(cloud, leg, heard.t_s)
        axis = leg.heading_rad(heard.t_s) + RANGER_AXES_RAD[heard.ranger]
        power = self._news(heard.ranger)
        if power > 0.0:
            explained = cloud.weigh(axis, heard.range_m, power, self._model, self.walls)
            self.explained += power * EXPLAINED_SHARE * (explained - self.explained)
            if self.explained < UNEXPLAINED:
                self._doubt_m = max(self._doubt_m, LOST_SD_M)

    def _news(self, ranger: int) -> float:
        """Share of independent information in this ranger's next echo: errors are correlated over some travel."""
        last, self._echo_xy[ranger] = self._echo_xy[ranger], self._xy
        if last is None:
            return 1.0
        travel = math.hypot(self._xy[0] - last[0], self._xy[1] - last[1])
        return min(travel / self.settings.echo.correlation_m, 1.0)
