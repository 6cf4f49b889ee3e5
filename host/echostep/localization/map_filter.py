"""The map filter: measured path segments and beacon readings in, estimates out.

In: `MeasuredSegment`s, each with the pings triggered on it, in order of time; the beacons' readings. Out: an `Estimate` at the end of each segment.
Owns the cloud, the beacon map, and how far the plan explains the echoes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from statistics import median

import numpy as np

from echostep.angles import wrap
from echostep.arrays import Floats, Ints
from echostep.board.gateway import BeaconReading
from echostep.localization.beacon_map import BeaconMap
from echostep.localization.beacon_model import BeaconSettings
from echostep.localization.echo_likelihood import EchoSettings, echo_model
from echostep.localization.estimate import Estimate, estimate
from echostep.localization.level_changes import ClimbSettings, HeightChange
from echostep.localization.particle_kernels import Move, PingBatch
from echostep.localization.particles import Cloud, CloudSettings
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Pose
from echostep.walls.echo_sources import Walls
from echostep.walls.level_sheet import LevelSheet

RANGER_AXES_RAD = np.array([0.5 * math.pi, -0.5 * math.pi])  # from the trunk's heading: ranger 0 looks left, 1 right
LEAST_POWER = 0.01  # share of independent information below which a ping is left out, by reason: it changes nothing
EXPLAINED_SHARE = 0.1  # of one independent ping in the running mean `explained`, by reason: ten pings
# Values of `explained` (log of a density in 1/m): a tracked walk has +1, an echo that fits nowhere -5.
FULL_TRUST, NO_TRUST = 1.2, -1.0  # the trust in echoes is 1 from the first on, and falls to LEAST_TRUST at the second
UNEXPLAINED = -1.5  # below it the plan does not explain the echoes, and the estimate is lost
LEAST_TRUST = 0.1  # by reason: with none the trust could not rise again
LOST_SD_M = 3.0  # standard deviation added to a lost estimate, by reason: its status is then "lost"
REGAIN_M = 10.0  # path at full trust over which that standard deviation falls to 1 / e, by reason
# Turn on a segment at which its pings count half, by reason: headings between its ends are interpolated
TURNING_RAD = math.radians(15.0)
EXACT_SD_M = 0.005  # least standard deviation per axis of an estimate, by reason: no plan is more exact
PLAN_SD_M = (
    0.15  # standard deviation per axis at zero trust, by reason: a plan that explains few echoes may be so far off
)
UNTRUSTED_FACTOR = 3.0  # extra cloud-size factor at zero trust, by reason
COARSE_FACTOR = 2.0  # extra cloud-size factor with the legs' odometry alone, by reason: its strides are known to 4 cm, its headings to a degree
COARSE_PATH_M = 20.0  # path for which that factor stays after the last such segment, by reason
HEIGHT_SD_M = 0.3  # of one height by pressure: an SCP1000 in its fast mode, a little worse than its data sheet says
HEIGHT_SAMPLES = 9  # used at the end of a segment: a second
AIR_SD_M = 0.1  # of a height by pressure that more samples do not reduce, by reason: draughts


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """Settings of the filter's parts."""

    cloud: CloudSettings = field(default_factory=CloudSettings)
    echo: EchoSettings = field(default_factory=EchoSettings)
    climb: ClimbSettings = field(default_factory=ClimbSettings)
    beacons: BeaconSettings = field(default_factory=BeaconSettings)


class MapFilter:
    """A cloud on a plan, from a start on.

    `explained`: running mean of log p(ping) under the cloud, log of a density in 1/m: how well the plan explains the echoes.
    """

    def __init__(
        self, walls: Walls, start: Pose, walk_heading_rad: float, rng: np.random.Generator,
        settings: FilterSettings | None = None, sheet: LevelSheet | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at `start`; `sheet`: how levels lie on the walls' sheet."""
        settings = settings or FilterSettings()
        self.cloud = Cloud(settings.cloud, start, walk_heading_rad, rng, sheet, settings.climb)
        self.beacon_map = BeaconMap(walls, settings.beacons, rng)
        self.explained = 1.0
        self._walls = walls
        self._echo = settings.echo
        self._model = echo_model(settings.echo)
        self._doubt_m = 0.0  # standard deviation per axis that the cloud's own spread does not show
        self._path_m = 0.0  # length of the path so far
        self._coarse_until_m = 0.0  # length of the path up to which COARSE_FACTOR holds
        self._last_ping_m = [-math.inf, -math.inf]  # length of the path at each ranger's last ping

    @property
    def trust(self) -> float:
        """Trust in the echoes, LEAST_TRUST to 1: as far as the plan explained the last ones. Echoes that it does not explain repeat themselves."""
        return min(max((self.explained - NO_TRUST) / (FULL_TRUST - NO_TRUST), LEAST_TRUST), 1.0)

    def update(self, measured: MeasuredSegment, readings: Sequence[BeaconReading] = ()) -> Estimate:
        """Propagate along a segment, reweight by its pings, height change and beacon readings, and resample; returns the estimate at its end."""
        segment = measured.segment
        if segment.unobserved:
            self._scatter(measured)
        else:
            self._follow(measured)
        self.beacon_map.update(self.cloud, segment, readings)
        doubt_m = math.hypot(self._doubt_m, segment.anchor_sd_m, PLAN_SD_M * (1.0 - self.trust), EXACT_SD_M)
        return estimate(self.cloud, segment.t1_s, segment.heading1_rad, segment.step, doubt_m)

    def _scatter(self, measured: MeasuredSegment) -> None:
        """Spread the cloud over an unobserved segment."""
        self.cloud.scatter(_move(measured.segment), _height_change(measured))
        self._doubt_m = math.hypot(self._doubt_m, measured.segment.sd_m)

    def _follow(self, measured: MeasuredSegment) -> None:
        """Propagate along an observed segment; the cloud resamples itself after each reweighting that needs it."""
        segment = measured.segment
        pings = self._usable_pings(measured)
        if segment.scale_sd > 0.0:
            self._coarse_until_m = self._path_m + COARSE_PATH_M
        coarse = COARSE_FACTOR if self._path_m < self._coarse_until_m else 0.0
        self.cloud.set_minimum_size(1.0 + coarse + UNTRUSTED_FACTOR * (1.0 - self.trust))
        log_evidence = self.cloud.propagate_and_reweight(_move(segment), pings, self._model, self._walls)
        self._judge(log_evidence, pings.power)
        self.cloud.change_levels(_move(segment), _height_change(measured))
        self._doubt_m *= math.exp(-math.hypot(segment.dx_m, segment.dy_m) * self.trust / REGAIN_M)

    def _usable_pings(self, measured: MeasuredSegment) -> PingBatch:
        """The pings that bring information, with their share of the segment and their axis in the walk frame; extends the path by the segment."""
        segment = measured.segment
        length, span_s = math.hypot(segment.dx_m, segment.dy_m), segment.t1_s - segment.t0_s
        turn = wrap(segment.heading1_rad - segment.heading0_rad)
        share = np.ones(len(measured.t_s))
        if span_s > 0.0:
            share = np.clip((measured.t_s - segment.t0_s) / span_s, 0.0, 1.0)
        axis = segment.heading0_rad + share * turn + RANGER_AXES_RAD[measured.ranger]
        range_m = np.where(np.isnan(measured.range_m), 0.0, measured.range_m)
        power = self._independent_share(measured.ranger, self._path_m + share * length) * self.trust
        power /= 1.0 + (turn / TURNING_RAD) ** 2
        self._path_m += length
        used = power > LEAST_POWER
        return PingBatch(share[used], axis[used], range_m[used], power[used])

    def _independent_share(self, ranger: Ints, path_m: Floats) -> Floats:
        """Share of independent information in each ping (k,): errors of one ranger's echoes are correlated over `correlation_m` of the path."""
        power = np.zeros(len(path_m))
        for which in (0, 1):
            own = np.flatnonzero(ranger == which)
            if len(own):
                travel = path_m[own]
                last_m, self._last_ping_m[which] = self._last_ping_m[which], float(travel[-1])
                travel[1:] -= travel[:-1].copy()
                travel[0] -= last_m
                power[own] = np.minimum(travel / self._echo.correlation_m, 1.0)
        return power

    def _judge(self, log_evidence: Floats, power: Floats) -> None:
        """Update `explained` by the pings' log-evidence; below UNEXPLAINED the cloud's spread is not believed."""
        for value, share in zip(log_evidence.tolist(), power.tolist(), strict=True):
            self.explained += share * EXPLAINED_SHARE * (value - self.explained)
            if self.explained < UNEXPLAINED:
                self._doubt_m = max(self._doubt_m, LOST_SD_M)


def _move(segment: PathSegment) -> Move:
    return Move(segment.dx_m, segment.dy_m, segment.sd_m, segment.turn_sd_rad, segment.scale_sd)


def _height_change(measured: MeasuredSegment) -> HeightChange:
    """The foot's rise, and the median of the last heights by pressure: a slammed door moves a mean, but not a median."""
    segment, last = measured.segment, measured.height_m[-HEIGHT_SAMPLES:].tolist()
    span_s = segment.t1_s - segment.t0_s
    if not last:
        return HeightChange(segment.rise_m, segment.rise_sd_m, 0.0, math.inf, span_s)
    height_sd_m = math.hypot(AIR_SD_M, HEIGHT_SD_M / math.sqrt(len(last)))
    return HeightChange(segment.rise_m, segment.rise_sd_m, median(last), height_sd_m, span_s)
