"""The map filter: legs of the trunk's path and the echoes heard on them in, estimates out.

In: `MeasuredSegment`s, a leg each with the pings triggered on it, in order of time. Out: an `Estimate` at the end of each leg. Owns the cloud and
what is known beside it: how much news an echo brings, and how far the plan explains what is heard.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import median

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Floats, Ints
from echostep.board.gateway import BeaconReading
from echostep.localization.beacon_map import BeaconMap
from echostep.localization.beacon_slam import BeaconSettings
from echostep.localization.echo_likelihood import EchoSettings, echo_model
from echostep.localization.estimate import Estimate, estimate
from echostep.localization.level_changes import ClimbSettings, HeightChange
from echostep.localization.particles import Cloud, CloudSettings, Move, PingBatch
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Pose
from echostep.walls.echo_sources import Walls
from echostep.walls.level_sheet import LevelSheet

RANGER_AXES_RAD = np.array([0.5 * math.pi, -0.5 * math.pi])
EXPLAINED_SHARE = 0.1
NO_NEWS = 0.01  # a ping with less is not worth a look
UNEXPLAINED = -1.5  # a tracked walk has +1, an echo that fits nowhere -5: the plan does not explain what is heard
LOST_SD_M = 3.0
REGAIN_M = 10.0  # a way walked with full trust, after which a third of a doubt is left
BELIEVED, DISBELIEVED = 1.2, -1.0  # of `explained`: echoes count in full, and with a tenth
LEAST_TRUST = 0.1
TURNING_RAD = math.radians(
    15.0
)  # a leg that turns more than this is no straight line, and its headings are guesses in between
EXACT_SD_M = 0.005  # no plan is more exact
PUZZLED_MORE = 3.0  # who understands nothing of what he hears keeps so many times more particles about him
# Legs alone tell strides to 4 cm, headings to a degree: more particles miss none of the places that fit, also on the way after the legs told.
COARSE_MORE, COARSE_WAY_M = 2.0, 20.0
HEIGHT_SD_M = 0.3  # of one sample: an SCP1000 in its fast mode, a little worse than its documents say
LATE_SAMPLES = 9  # a second
AIR_SD_M = 0.1  # what the mean of many does not take away: draughts
PLAN_SD_M = 0.15  # how far off a plan may be that explains little of what is heard


class MapFilter:
    """A cloud on a plan, from a start on."""

    def __init__(
        self, walls: Walls, start: Pose, walk_heading_rad: float, rng: np.random.Generator,
        cloud: CloudSettings | None = None, echo: EchoSettings | None = None,
        storeys: LevelSheet | None = None, climbing: ClimbSettings | None = None, beacons: BeaconSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at `start`; `storeys`: how levels lie on the walls' sheet."""
        self.cloud = Cloud(cloud or CloudSettings(), start, walk_heading_rad, rng, storeys, climbing)
        self.crumbs = BeaconMap(walls, beacons or BeaconSettings(), rng)
        self.explained = 1.0
        self._walls = walls
        self._echo = echo or EchoSettings()
        self._model = echo_model(self._echo)
        self._doubt_m = 0.0
        self._gone_m = 0.0
        self._coarse_m = 0.0  # of way gone, up to which the cloud is a large one
        self._last_m = [-math.inf, -math.inf]

    def follow(self, passage: MeasuredSegment, words: Sequence[BeaconReading] = ()) -> Estimate:
        """Move along a leg and weigh by its pings and by what beacons said on it."""
        leg = passage.segment
        move = Move(leg.dx_m, leg.dy_m, leg.sd_m, leg.turn_sd_rad, leg.scale_sd)
        rise = _rise(leg, passage.height_m)
        if leg.unobserved:
            self.cloud.scatter(move, rise)
            self._doubt_m = math.hypot(self._doubt_m, leg.sd_m)
        else:
            heard = self._heard(passage)
            self._coarse_m = self._gone_m + COARSE_WAY_M if leg.scale_sd > 0.0 else self._coarse_m
            coarse = COARSE_MORE if self._gone_m < self._coarse_m else 0.0
            self.cloud.puzzle(1.0 + coarse + PUZZLED_MORE * (1.0 - self._trust()))
            self._judge(self.cloud.follow(move, heard, self._model, self._walls), heard.power)
            self.cloud.climb(move, rise)
            self._doubt_m *= math.exp(-math.hypot(leg.dx_m, leg.dy_m) * self._trust() / REGAIN_M)
        self.crumbs.hear(self.cloud, leg, words)
        doubt_m = math.hypot(self._doubt_m, leg.anchor_sd_m, PLAN_SD_M * (1.0 - self._trust()), EXACT_SD_M)
        return estimate(self.cloud, leg.t1_s, leg.heading1_rad, leg.step, doubt_m)

    def _heard(self, passage: MeasuredSegment) -> PingBatch:
        """The pings with their place on the leg, the axis that they were sent along, and the news that they bring."""
        leg = passage.segment
        length, span_s = math.hypot(leg.dx_m, leg.dy_m), leg.t1_s - leg.t0_s
        share = np.clip((passage.t_s - leg.t0_s) / span_s, 0.0, 1.0) if span_s > 0.0 else np.ones(len(passage.t_s))
        axis = leg.heading0_rad + share * wrap(leg.heading1_rad - leg.heading0_rad) + RANGER_AXES_RAD[passage.ranger]
        range_m = np.where(np.isnan(passage.range_m), 0.0, passage.range_m)
        power = self._news(passage.ranger, self._gone_m + share * length)
        power /= 1.0 + (wrap(leg.heading1_rad - leg.heading0_rad) / TURNING_RAD) ** 2
        self._gone_m += length
        new = power > NO_NEWS
        return PingBatch(share[new], axis[new], range_m[new], power[new])

    def _news(self, ranger: Ints, at_m: Floats) -> Floats:
        """Share of independent information in each ping: errors of one ranger's echoes are correlated over some travel."""
        power = np.zeros(len(at_m))
        for which in (0, 1):
            mine = np.flatnonzero(ranger == which)
            if len(mine):
                travel = at_m[mine]
                last_m, self._last_m[which] = self._last_m[which], float(travel[-1])
                travel[1:] -= travel[:-1].copy()
                travel[0] -= last_m
                power[mine] = np.minimum(travel / self._echo.correlation_m, 1.0)
        return power * self._trust()

    def _trust(self) -> float:
        """Echoes are believed as far as the plan has explained them lately: furniture, passers-by and wrong plans repeat themselves."""
        return min(max((self.explained - DISBELIEVED) / (BELIEVED - DISBELIEVED), LEAST_TRUST), 1.0)

    def _judge(self, explained: Floats, news: Floats) -> None:
        """A running mean of how well the plan explains the echoes; below a threshold nobody should trust the cloud."""
        for value, power in zip(explained.tolist(), news.tolist(), strict=True):
            self.explained += power * EXPLAINED_SHARE * (value - self.explained)
            if self.explained < UNEXPLAINED:
                self._doubt_m = max(self._doubt_m, LOST_SD_M)


def _rise(leg: PathSegment, height_m: Floats) -> HeightChange:
    """What foot and pressure say of the height at the end of a leg; the middle one of the last samples resists a slammed door."""
    late = height_m[-LATE_SAMPLES:].tolist()
    if not late:
        return HeightChange(leg.rise_m, leg.rise_sd_m, 0.0, math.inf, leg.t1_s - leg.t0_s)
    height, sd = median(late), math.hypot(AIR_SD_M, HEIGHT_SD_M / math.sqrt(len(late)))
    return HeightChange(leg.rise_m, leg.rise_sd_m, height, sd, leg.t1_s - leg.t0_s)
