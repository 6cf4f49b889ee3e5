"""The map filter: legs of the trunk's path and the echoes heard on them in, estimates out.

In: `Leg`s in order of time, each with all pings triggered on it. Out: an `Estimate` at the end of each leg. Owns the cloud and what is known beside it:
how much news an echo brings, and how far the plan explains what is heard.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from echostep.calibration import Echo
from echostep.estimate import Estimate, estimate
from echostep.gait import Leg
from echostep.likelihoods import EchoSettings, echo_model
from echostep.particles import NOTHING, Cloud, CloudSettings, Heard, Move
from echostep.plan import Pose
from echostep.reflectors import Walls

Floats = NDArray[np.float64]

RANGER_AXES_RAD = (0.5 * math.pi, -0.5 * math.pi)
EXPLAINED_SHARE = 0.1
UNEXPLAINED = -1.5  # a tracked walk has +1, an echo that fits nowhere -5: the plan does not explain what is heard
LOST_SD_M = 3.0
REGAIN_M = 10.0
BELIEVED, DISBELIEVED = 1.2, -2.0  # of `explained`: echoes count in full, and with a fifth
LEAST_TRUST = 0.2
PLAN_SD_M = 0.15  # how far off a plan may be that explains little of what is heard


class MapFilter:
    """A cloud on a plan, from a start on."""

    def __init__(
        self, walls: Walls, start: Pose, walk_heading_rad: float, rng: np.random.Generator,
        cloud: CloudSettings | None = None, echo: EchoSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at `start`."""
        self.cloud = Cloud(cloud or CloudSettings(), start, walk_heading_rad, rng)
        self.explained = 1.0
        self._walls = walls
        self._echo = echo or EchoSettings()
        self._model = echo_model(self._echo)
        self._doubt_m = 0.0
        self._gone_m = 0.0
        self._last_m = [-math.inf, -math.inf]

    def follow(self, leg: Leg, heard: Sequence[Echo]) -> Estimate:
        """Move along a leg and weigh by its pings, in order of their times."""
        move = Move(leg.dx_m, leg.dy_m, leg.sd_m, leg.turn_sd_rad)
        if leg.unwatched:
            self.cloud.scatter(move)
            self._doubt_m = math.hypot(self._doubt_m, leg.sd_m)
        else:
            pings = self._pings(leg, heard)
            self._judge(self.cloud.follow(move, pings, self._model, self._walls), pings)
            self._doubt_m *= math.exp(-math.hypot(leg.dx_m, leg.dy_m) / REGAIN_M)
        return estimate(self.cloud, leg.t1_s, leg.heading1_rad, leg.step, math.hypot(self._doubt_m, PLAN_SD_M * (1.0 - self._trust())))

    def _pings(self, leg: Leg, heard: Sequence[Echo]) -> Heard:
        if not heard:
            return NOTHING
        length, span_s = math.hypot(leg.dx_m, leg.dy_m), leg.t1_s - leg.t0_s
        rows = []
        for ping in heard:
            share = min(max((ping.t_s - leg.t0_s) / span_s, 0.0), 1.0) if span_s > 0.0 else 1.0
            axis = leg.heading_rad(ping.t_s) + RANGER_AXES_RAD[ping.ranger]
            rows.append((share, axis, ping.range_m or 0.0, self._news(ping.ranger, self._gone_m + share * length)))
        self._gone_m += length
        return Heard(*np.array(rows).T.copy())

    def _news(self, ranger: int, at_m: float) -> float:
        """Share of independent information in this ranger's next echo: errors are correlated over some travel."""
        travel, self._last_m[ranger] = at_m - self._last_m[ranger], at_m
        return min(travel / self._echo.correlation_m, 1.0) * self._trust()

    def _trust(self) -> float:
        """Echoes are believed as far as the plan has explained them lately: furniture, passers-by and wrong plans repeat themselves."""
        return min(max((self.explained - DISBELIEVED) / (BELIEVED - DISBELIEVED), LEAST_TRUST), 1.0)

    def _judge(self, explained: Floats, pings: Heard) -> None:
        """A running mean of how well the plan explains the echoes; below a threshold nobody should trust the cloud."""
        for value, power in zip(explained.tolist(), pings.power.tolist(), strict=True):
            self.explained += power * EXPLAINED_SHARE * (value - self.explained)
            if self.explained < UNEXPLAINED:
                self._doubt_m = max(self._doubt_m, LOST_SD_M)
