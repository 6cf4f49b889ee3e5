# SPDX-License-Identifier: MIT
"""The peer: augmented Monte Carlo localization as in [Thrun, Burgard and Fox 2005, table 8.3], with this project's motion and p(echo | pose).

In: segments, a plan, a start. Out: `FilterRun`. Owns its particles. Random poses are mixed in as far as the mean likelihood falls behind its own
long-term mean. Levels change as in this project's filter; the book knows one.
Its measurement update is p(echo | pose) of this project without a memory, for each particle.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from statistics import median

import numpy as np

from echostep.arrays import Floats, Ints
from echostep.echoes.likelihood import EchoModel, EchoSettings, echo_density, echo_model
from echostep.height.levels import (
    UNKNOWN_LAG_M2,
    ClimbSettings,
    HeightArrays,
    HeightChange,
    change_levels,
    level_change_model,
)
from echostep.jit import kernel
from echostep.localization import CloudSettings, Start, TrackStatus
from echostep.particles.arrays import Move, ParticleArrays
from echostep.particles.kernels import (
    NOISE_BEND,
    MovePiece,
    begin_segment,
    effective_size,
    end_segment,
    propagate,
    systematic,
)
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan import Plan
from echostep.walls.echo_sources import Walls, echo_sources, one_receiver
from echostep.walls.floor import walkable_floor
from echostep.walls.index import WallIndex
from echostep.walls.level_sheet import LevelSheet, lay_out_levels, level_of
from echostep_studies.bench.filtering import WARM_UP, Claim, FilterRun


@kernel
def weight_by_ping(particles: ParticleArrays, axis: float, range_m: float, model: EchoModel, walls: WallIndex) -> float:
    """Multiply each weight by p(range | pose); returns the mean likelihood before. The greatest log-weight becomes 0."""
    x, y, turn, _, log_weight = particles
    block, distance_m, off_axis_rad, kind = one_receiver()
    top, weight, evidence = -np.inf, 0.0, 0.0
    for i in range(len(x)):
        count = echo_sources(x[i], y[i], axis + turn[i], walls, block)
        likelihood = echo_density(range_m, count, distance_m, off_axis_rad, kind, model)
        w = math.exp(log_weight[i])
        weight += w
        evidence += w * likelihood
        log_weight[i] += math.log(likelihood)
        top = max(top, log_weight[i])
    for i in range(len(x)):
        log_weight[i] -= top
    return evidence / weight


SIZE = 20_000
# Decay rates of the long-term and the short-term mean likelihood, a ping; those of the ROS node amcl
ALPHA_SLOW, ALPHA_FAST = (0.001, 0.1)
SCALE_SD = 0.02  # of the lengths, at the start
CELL_M, NEAR_M = 1.0, 1.5  # the estimate is the mean of the particles within NEAR_M of the heaviest cell's mean
HEIGHT_SD_M, HEIGHT_SAMPLES = 0.15, 9  # of a median of heights by pressure
# Tracking: so much weight so near; lost: less than so much so near
SURE, SURE_M, UNSURE, UNSURE_M = (0.95, 1.0, 0.5, 5.0)
RISK = 1e-3


def track_by_amcl(segments: Sequence[MeasuredSegment], plan: Plan, start: Start, seed: int) -> FilterRun:
    """The peer from the first segment on."""
    for k in range(2):
        peer = AugmentedMcl(plan, start, segments[0].segment.heading0_rad, np.random.default_rng([seed, 81]))
        claims, begin_s = [], time.process_time()
        for segment in segments if k else segments[:WARM_UP]:
            claims.append(peer.update(segment))
    return FilterRun(tuple(claims), SIZE, time.process_time() - begin_s)


class AugmentedMcl:
    """The filter of table 8.3; resampling waits until half of the particles are effective."""

    def __init__(self, plan: Plan, start: Start, walk_heading_rad: float, rng: np.random.Generator) -> None:
        laid_out = lay_out_levels(plan)
        self._walls: Walls = laid_out.walls
        self._sheet: LevelSheet = laid_out.sheet
        self._floor = walkable_floor(self._walls.index.walls)
        self._rng, self._model = rng, echo_model(EchoSettings())
        x, y, heading = self._draw(start, SIZE)
        scale = 1.0 + SCALE_SD * rng.standard_normal(SIZE)
        self._particles = ParticleArrays(x, y, heading - walk_heading_rad, scale, np.zeros(SIZE))
        self._heights = HeightArrays(self._sheet.height_m[level_of(x, self._sheet)], np.zeros(SIZE))
        self._lag_variance = UNKNOWN_LAG_M2
        self._slow = self._fast = 0.0
        self._travel_m = np.full(2, np.inf)  # since the last ping of each ranger that was used

    def update(self, measured: MeasuredSegment) -> Claim:
        """Sample the motion, weight by each ping, resample with random poses."""
        segment = measured.segment
        length, done = math.hypot(segment.dx_m, segment.dy_m), 0.0
        for share, ranger, off_heading_rad, range_m in _pings(measured):
            self._move(segment, share - done)
            self._travel_m += length * (share - done)
            done = share
            if self._travel_m[ranger] >= EchoSettings().correlation_m:
                self._travel_m[ranger] = 0.0
                heading = segment.heading0_rad + share * segment.turn_rad
                self._weight(heading + off_heading_rad, range_m, heading)
        self._move(segment, 1.0 - done)
        self._travel_m += length * (1.0 - done)
        self._change_levels(measured)
        return self._claim(segment)

    def _draw(self, start: Start, count: int) -> tuple[Floats, Floats, Floats]:
        sheet = self._sheet if len(self._sheet.height_m) > 1 else None
        return start.draw(count, self._floor, sheet, self._rng)[:3]

    def _move(self, segment: PathSegment, share: float) -> None:
        """A share of a segment, with the noise that the filter of this project adds."""
        if share <= 0.0:
            return
        s, length = CloudSettings(), math.hypot(segment.dx_m, segment.dy_m)
        sd = math.hypot(segment.sd_m, s.step_sd * math.sqrt(length))
        turn_sd = math.hypot(segment.turn_sd_rad, math.radians(s.turn_sd_deg) * math.sqrt(length))
        sds = np.array([[sd], [sd], [turn_sd], [s.scale_sd * math.sqrt(length)]])
        noise = np.zeros((5, SIZE))
        noise[:NOISE_BEND] = math.sqrt(share) * sds * self._rng.standard_normal((NOISE_BEND, SIZE))
        p, dx, dy = self._particles, share * segment.dx_m, share * segment.dy_m
        walls = self._walls.near(p.x_m, p.y_m, math.hypot(dx, dy))
        arrays = begin_segment(p)
        propagate(p, arrays, MovePiece(dx, dy, 0.0, 0.0), 1.0, noise, math.exp(-s.wall_cost), walls)
        end_segment(p, arrays.weight)

    def _weight(self, axis: float, range_m: float, walk_heading_rad: float) -> None:
        """Weights and their mean (lines 5 to 10 of the table), then resampling (lines 11 to 16)."""
        p = self._particles
        mean = weight_by_ping(p, axis, range_m, self._model, self._walls.near(p.x_m, p.y_m))
        self._slow += (ALPHA_SLOW if self._slow else 1.0) * (mean - self._slow)
        self._fast += (ALPHA_FAST if self._fast else 1.0) * (mean - self._fast)
        if effective_size(np.exp(p.log_weight)) < 0.5 * SIZE:
            self._resample(walk_heading_rad)

    def _resample(self, walk_heading_rad: float) -> None:
        """Each particle is a random pose with probability 1 - w_fast / w_slow, else one of the old ones by weight."""
        chosen = systematic(np.exp(self._particles.log_weight), float(self._rng.random()), SIZE)
        p, h = self._particles, self._heights
        p = ParticleArrays(p.x_m[chosen], p.y_m[chosen], p.turn_rad[chosen], p.scale[chosen], np.zeros(SIZE))
        self._particles, self._heights = p, HeightArrays(h.z_m[chosen], h.lag_m[chosen])
        random = np.flatnonzero(self._rng.random(SIZE) < max(0.0, 1.0 - self._fast / self._slow))
        if len(random):
            x, y, heading = self._draw(Start(), len(random))
            p.x_m[random], p.y_m[random], p.turn_rad[random] = x, y, heading - walk_heading_rad
            p.scale[random] = 1.0 + SCALE_SD * self._rng.standard_normal(len(random))
            self._heights.z_m[random] = self._sheet.height_m[level_of(x, self._sheet)]

    def _change_levels(self, measured: MeasuredSegment) -> None:
        if len(self._sheet.height_m) < 2:
            return
        s, last = measured.segment, measured.height_m[-HEIGHT_SAMPLES:].tolist()
        span_s = s.t1_s - s.t0_s
        height_m, sd_m = (median(last), HEIGHT_SD_M) if last else (0.0, math.inf)
        self._lag_variance += ClimbSettings().drift_m ** 2 * span_s if last else 0.0
        self._lag_variance, _ = change_levels(
            self._particles, self._heights, Move(s.dx_m, s.dy_m, s.sd_m, s.turn_sd_rad), self._rng.standard_normal(SIZE),
            HeightChange(s.rise_m, s.rise_sd_m, height_m, sd_m, height_m, span_s), self._lag_variance, level_change_model(ClimbSettings()),
            self._sheet,
        )  # fmt: skip

    def _claim(self, segment: PathSegment) -> Claim:
        """The mean about the heaviest cell; its status and radius by the weight of the particles near it."""
        p = self._particles
        weight = np.exp(p.log_weight)
        weight /= weight.sum()
        x, y = p.x_m, p.y_m
        cell = np.floor(x / CELL_M) + 1e6 * np.floor(y / CELL_M)
        _, member = np.unique(cell, return_inverse=True)
        inside = member == np.bincount(member, weight).argmax()
        for reach_m in (CELL_M, NEAR_M):
            at = np.average(x[inside], weights=weight[inside]), np.average(y[inside], weights=weight[inside])
            inside = np.hypot(x - at[0], y - at[1]) < reach_m
        level = int(level_of(np.array([at[0]]), self._sheet)[0])
        away = np.hypot(x - at[0], y - at[1])
        near, about = (float(weight[away < limit].sum()) for limit in (SURE_M, UNSURE_M))
        status = (
            TrackStatus.TRACKING if near >= SURE else TrackStatus.UNCERTAIN if about >= UNSURE else TrackStatus.LOST
        )
        map_x = float(at[0]) - level * self._sheet.pitch_m * (len(self._sheet.height_m) > 1)
        z = float(self._sheet.height_m[level])
        return Claim(segment.t1_s, map_x, float(at[1]), level, z, status, _radius(away, weight))


def _pings(measured: MeasuredSegment) -> list[tuple[float, int, float, float]]:
    """Share of the segment, ranger, its axis from the heading, and range (0: none) of each ping."""
    s = measured.segment
    span_s = s.t1_s - s.t0_s
    share = np.clip((measured.t_s - s.t0_s) / span_s, 0.0, 1.0) if span_s > 0.0 else np.ones(len(measured.t_s))
    columns = share, measured.ranger, measured.off_heading_rad, np.nan_to_num(measured.range_m)
    return list(zip(*(column.tolist() for column in columns), strict=True))


def _radius(away_m: Floats, weight: Floats) -> float:
    """Distance beyond which RISK of the weight is."""
    order: Ints = np.argsort(away_m)
    k = int(np.searchsorted(np.cumsum(weight[order]), 1.0 - RISK))
    return float(away_m[order[min(k, len(order) - 1)]])
