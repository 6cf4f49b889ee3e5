# SPDX-License-Identifier: MIT
"""The map filter: measured path segments and beacon readings in, estimates out.

In: `MeasuredSegment`s, each with the pings triggered on it, in order of time. Out: an `Estimate` at the end of each segment.
Owns the clouds, and the probability that each is right.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from echostep.echoes.likelihood import EchoSettings
from echostep.echoes.range_bias import RangeBias
from echostep.echoes.unplanned import RangeMemory, UnplannedDensities, UsablePings, evidence_share
from echostep.elementary import dot, mean_angle
from echostep.height.height_filter import RelativeHeight, RidingHeight
from echostep.height.levels import Air, HeightChange
from echostep.localization.belief import PLAN_FITS, WRONG_PER_M, Belief, CloudHypothesis, CrossedWalls
from echostep.localization.building import Building
from echostep.localization.cloud_estimate import estimate_of, weight_about
from echostep.localization.estimate import Estimate
from echostep.localization.grid.cells import GridCells
from echostep.localization.grid.search import Search
from echostep.localization.grid.start import grid_about, grid_of, is_unknown
from echostep.localization.motion import HEIGHT_SD_M, height_change, move_of
from echostep.localization.particles.cloud import Cloud, cloud_about
from echostep.localization.particles.particles import Particles
from echostep.localization.particles.start import STATED, Start, wide
from echostep.localization.settings import FilterSettings, echo_models, inexact, with_plan_error
from echostep.localization.unmeasured import UNOBSERVED_DOUBT, UnmeasuredWay
from echostep.localization.window import RecentWay
from echostep.particles.arrays import Move, PingBatch
from echostep.particles.kernels import systematic
from echostep.particles.limits import BELIEVED, PROBABLE
from echostep.path import MeasuredSegment, Odometer, PathSegment
from echostep.plan import ANY_LEVEL, Pose
from echostep.walls.echo_sources import Walls

SUPPORTED_M = 2.0  # path behind the last ping on which the plan still supports the cloud, assumed
EXACT_SD_M = 0.005  # least standard deviation per axis of an estimate: no plan is more exact
# Standard deviation per axis when all views are hidden: a plan that explains few echoes may be this far off
HIDDEN_SD_M = 0.15
BY_DEFINITION = 1.0 - 1e-6  # without a plan: the map begins where the walk began, and no echo can contradict that
NEAR_SD_M = 2.0  # standard deviation of a place that was believed before a gap, per axis; assumed


class MapFilter:
    """The tracked cloud, and a second one that searches the building while the first is doubted."""

    def __init__(
        self, building: Building, start: Start, walk_heading_rad: float, rng: np.random.Generator,
        settings: FilterSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame at the start."""
        self._settings = settings or FilterSettings()
        self.building = building
        self._rng = rng
        self._model, self._blurred = echo_models(self._settings)
        echo = with_plan_error(self._settings)
        self._pings = UsablePings(building.background(self._model), echo, self._settings.cloud.rough_m)
        self._bias = RangeBias(self.echo.sd_m)
        cloud = self.new_cloud(start, walk_heading_rad)
        prior = (1.0 if cloud.is_searching else STATED) if building.has_walls else BY_DEFINITION
        self.belief = Belief(cloud, prior, PLAN_FITS if building.has_walls else 1.0)
        self._crossed = CrossedWalls()
        self._height = None if building.has_walls else RelativeHeight(self._settings.climb.drift_m)
        self._unmeasured = UnmeasuredWay(on_plan=building.has_walls)
        self._way = RecentWay(wide(start), walk_heading_rad)  # since the last gap
        self._riding = RidingHeight(HEIGHT_SD_M)
        self._barometer_starts = 0  # before the last height by pressure
        if start.after_pause:
            self.belief.leave(UNOBSERVED_DOUBT)
            self._search_beside(start.air, walk_heading_rad)

    @staticmethod
    def call_kernels() -> None:
        """Call the kernels that a filter needs later than at its first segment: resampling, and learning the rangers' common bias."""
        systematic(np.ones(2), 0.5, 2)
        zero = np.zeros(1)
        ping = PingBatch(zero, zero, zero, zero, np.zeros(1, np.int64), zero, zero, zero, zero, zero)
        model, _ = echo_models(FilterSettings())
        RangeBias(1.0).learn(ping, (zero, zero, zero), (0.0, 0.0, 0.0), Walls(np.empty((0, 4))), model)

    def stated(self, t_s: float, walk_heading_rad: float, step: int) -> Estimate:
        """The estimate at a start that has just been stated."""
        return estimate_of([(self.cloud, STATED)], t_s, walk_heading_rad, step)

    @property
    def echo(self) -> EchoSettings:
        """Settings of the ranger model."""
        return self._settings.echo

    def set_ranger_model(self, echo: EchoSettings) -> None:
        """Use these ranger settings from the next segment on."""
        if echo != self._settings.echo:
            self._settings = replace(self._settings, echo=echo)
            self._model, self._blurred = echo_models(self._settings)
            self._bias = RangeBias(echo.sd_m)
            self._pings.set_ranger_model(self.building.background(self._model), with_plan_error(self._settings))

    @property
    def odometer(self) -> Odometer:
        """Of the wearer's path."""
        return self._pings.odometer

    @property
    def cloud(self) -> Particles:
        """The particles of the cloud that is tracked, or of the search if there is none."""
        return self.belief.tracked.cloud.particles

    def update(self, measured: MeasuredSegment) -> Estimate:
        """Propagate along a segment, reweight by its pings and height change, and resample; returns the estimate at its end."""
        # 1. The trunk may have moved though no step was measured.
        measured = self._unmeasured.weighed(measured, self._level_m())
        segment, belief, away = measured.segment, self.belief, self._unmeasured.away
        # 2. How the height has changed, by the foot and by pressure.
        change = self._height_change(measured)
        # 3. A way that was not observed scatters each hypothesis, straight through the building.
        if segment.unobserved:
            for each in belief.clouds:
                each.cloud.scatter(move_of(segment), change)
            self._way.clear()
        # 4. After a stand, a pause, a long way that was not observed, the wearer may be elsewhere.
        belief.leave(away)
        if away >= UNOBSERVED_DOUBT:
            self._search_beside(self.cloud.air, segment.heading1_rad)
        # 5. Along an observed way each hypothesis moves, and is weighed by pings, walls and heights.
        # 6. The hypotheses are compared, and the rangers' bias is learnt from the likeliest.
        if not segment.unobserved:
            self._compare(segment, *self._follow(measured, change))
        # 7. The aids reweight the tracked one.
        self._aid(segment)
        # 8. If the trunk is probably in none, it is searched.
        if belief.is_doubted and len(self.building.floor.x_m):
            self._begin_search(self._way.begin, self._way.walk_heading_rad)
        # 9. The estimate of the tracked one, and of its rival.
        return self._estimate(segment)

    def _aid(self, segment: PathSegment) -> None:
        """Reweight the tracked cloud at the end of a segment by the aids [`echostep.aiding`]: here none."""

    def turn_walk_frame(self, by_rad: float) -> None:
        """Rotate all particles: the heading in the walk frame has changed while the wearer's heading on the map has not."""
        for part in self.belief.parts:
            part.turn_walk_frame(by_rad)
        self._way.clear()

    def new_cloud(self, start: Start, walk_heading_rad: float) -> Cloud | Search:
        """A cloud from a start; a search, if the place is unknown."""
        s, b = self._settings, self.building
        start = b.drawn.widened(start)
        if is_unknown(start) and len(b.floor.x_m):
            return self._search_from(start, walk_heading_rad)
        return cloud_about(s.cloud, start, walk_heading_rad, self._rng, b.sheet, s.climb, b.floor, b.walls.index)

    def _search_from(self, start: Start, walk_heading_rad: float) -> Search:
        """A search on the floor, which there is."""
        s, b = self._settings, self.building
        return grid_of(start, walk_heading_rad, *self._table(), b.floor, b.sheet, s, self._rng)

    def _table(self) -> tuple[GridCells, RangeMemory]:
        """The cells of a grid, and the density of pings without a plan that is as inexact as the cells."""
        unplanned = RangeMemory(self.building.background(self._model), inexact(self._settings))
        return self.building.cells(self._model), unplanned

    @property
    def plan_supports(self) -> bool:
        """Whether the last metres of echoes confirm the cloud by the plan."""
        return self.building.has_walls and self.belief.right > BELIEVED and self._pings.silent_m < SUPPORTED_M

    def _search_beside(self, air: Air | None, walk_heading_rad: float) -> None:
        """Search the whole building in addition to the tracked cloud, which covers the near places.

        `air`: calibration of the heights by pressure; None if the level is unknown: places above and below are searched more densely than the rest.
        """
        if self.belief.tracked.cloud.is_searching or not len(self.building.floor.x_m):
            return
        self._way.clear()
        on_levels = self.cloud.sheet is not None and air is None
        near = replace(self._believed(walk_heading_rad), level=ANY_LEVEL) if on_levels else None
        self._begin_search(Start(near=near, sd_m=NEAR_SD_M, heading_sd_rad=math.pi, air=air), walk_heading_rad)

    def _begin_search(self, start: Start, walk_heading_rad: float) -> None:
        """Search the building along the last metres of the path."""
        search = self._search_from(start, walk_heading_rad)
        self.belief.begin_search(search, self._way.search(search, self._model))
        if not self.belief.tracked.cloud.is_searching:
            self.belief.tracked.table = grid_about(
                self.cloud, *self._table(), self.building.floor, self._settings, self._rng
            )

    def _height_change(self, measured: MeasuredSegment) -> HeightChange:
        """The change of height over a segment. The lag of the height by pressure drifts over a pause; it is forgotten where the heights restart."""
        anew = len(measured.height_m) > 0 and measured.barometer_starts != self._barometer_starts
        for part in self.belief.parts:
            part.let_lag_drift(self._unmeasured.pause_s)
            if anew:
                part.forget_lag()
        if anew:
            self._barometer_starts = measured.barometer_starts
            self._riding.forget()
            if self._height is not None:
                self._height.forget_lag()
        self._riding.add(measured.height_m, self._unmeasured.pause_s + measured.segment.t1_s - measured.segment.t0_s)
        change = height_change(measured, self._riding.height_m)
        if self._height is not None:
            self._height.update(change)
        return change

    def _follow(self, measured: MeasuredSegment, change: HeightChange) -> tuple[Move, PingBatch]:
        """Propagate along an observed segment; a cloud resamples itself after each reweighting that needs it. Returns the move and its pings."""
        segment, belief, walls = measured.segment, self.belief, self.building.walls
        heard = self._bias.corrected(measured) if self.building.has_walls else measured.without_pings
        pings, unplanned = self._pings.take(heard)
        move, path_m = move_of(segment), math.hypot(segment.dx_m, segment.dy_m)
        self._way.add(move, pings, change)
        clouds, share = belief.clouds, evidence_share(segment.turn_rad)
        for each in clouds:
            if isinstance(each.cloud, Search):
                each.weigh(share * each.cloud.advance(move, pings, self._model), 0.0)
            else:
                self._follow_with(each, each.cloud, move, pings, unplanned, share)
        belief.weigh_heights([each.change_levels(move, change) for each in clouds])
        for each in clouds:
            if isinstance(each.cloud, Search):
                found = each.cloud.found()
                if found is not None:
                    self._way.pass_again(found, self._blurred, walls)
                    belief.find(each, found)
            elif (loss := self.building.log_loss_in_air(each.cloud.x_m, each.cloud.y_m, path_m)) is not None:
                each.cloud.reweight(loss)
        return move, pings

    def _follow_with(
        self, each: CloudHypothesis, cloud: Cloud, move: Move, pings: PingBatch, unplanned: UnplannedDensities, share: float
    ) -> None:  # fmt: skip
        """Propagate and reweight one cloud, and its hypothesis by this share of the evidence of the pings."""
        # By the spacing of sparse particles
        model, alone = (self._blurred, unplanned.log_blurred) if cloud.is_scattered else (self._model, unplanned.log)
        evidence = cloud.propagate_and_reweight(move, pings, model, self.building.walls)
        # Where there were several places, a light one may have lost its particles on one level by chance.
        if cloud.is_on_any_level and cloud.is_in_one_place:
            self._way.pass_again(cloud, self._blurred, self.building.walls)
            cloud.is_on_any_level = False
        if each.table is not None:
            each.weigh(share * each.table.advance(move, pings, self._model), evidence.log_path)
        elif self.building.has_walls:
            log_ratio, log_passed = dot(unplanned.counts, evidence.log_pings - alone), evidence.log_path
            if self.belief.search is None:
                path_m = math.hypot(move.dx_m, move.dy_m)
                log_passed = self._crossed.charge(self._believed(0.0), path_m, log_passed)
            each.weigh(share * log_ratio, log_passed)

    def _compare(self, segment: PathSegment, move: Move, pings: PingBatch) -> None:
        """Update the belief after a move: end improbable clouds, and merge clouds in one place; learn the bias where the likeliest is."""
        belief, path_m = self.belief, math.hypot(segment.dx_m, segment.dy_m)
        if not self.building.has_walls:
            return
        belief.judge_plan(path_m)
        belief.leave(WRONG_PER_M * path_m)
        belief.prune()
        if self._is_found_here():
            belief.merge()
        if len(pings.share) and belief.right > PROBABLE:  # bounded by its prior
            cloud = self.cloud
            self._bias.learn_behind(cloud.arrays, cloud.weight, move, pings, self.building.walls, self._model)

    def _is_found_here(self) -> bool:
        """Whether a search has found the place of the tracked cloud."""
        if self.belief.search is None or self.belief.search.cloud.is_searching:
            return False
        cloud, mean = self.belief.search.cloud.particles, self._believed(0.0)
        return weight_about(cloud, mean, dot(self.cloud.weight, self.cloud.z_m))[0] > PROBABLE

    def _level_m(self) -> float:
        """Height of the tracked cloud in the plan (m) by the level that is believed, NaN: none is."""
        tracked = self.belief.tracked.cloud
        if tracked.sheet is None:
            return 0.0 if self.building.has_walls else math.nan
        is_known = not tracked.is_searching and self.cloud.level_shares.max() > BELIEVED
        return dot(self.cloud.weight, self.cloud.z_m) if is_known else math.nan

    def _believed(self, walk_heading_rad: float) -> Pose:
        """The mean pose of the tracked cloud, on its likeliest level."""
        cloud = self.cloud
        weight, level = cloud.weight, int(cloud.level_shares.argmax())
        on = cloud.level == level
        x, y = (float(np.average(v[on], weights=weight[on])) for v in (cloud.map_x_m, cloud.y_m))
        return Pose(x, y, mean_angle(cloud.turn_rad, weight) + walk_heading_rad, level)

    def _estimate(self, segment: PathSegment) -> Estimate:
        """The estimate at the end of a segment."""
        belief = self.belief
        stood = 1.0 - self._unmeasured.probability
        mixture = [(each.cloud.particles, stood * belief.probability(each)) for each in belief.clouds]
        cloud, _ = mixture[0]
        hidden_sd_m = HIDDEN_SD_M * cloud.hidden_share
        map_sd_m, drawn = 0.0, self.building.drawn
        if drawn.are_stated:
            at = self._believed(0.0)
            map_sd_m = drawn.sd_m(at.x_m, at.y_m, at.level)
        sd_m = math.hypot(segment.anchor_sd_m, self._settings.plan_sd_m, hidden_sd_m, EXACT_SD_M, map_sd_m)
        return estimate_of(
            mixture, segment.t1_s, segment.heading1_rad, segment.step, sd_m, map_sd_m, self.building.elsewhere,
            None if self._height is None else (self._height.height_m, self._height.sd_m), belief.plan_fits,
            self.building.weight_outside(cloud.x_m, cloud.y_m, cloud.weight), self._unmeasured.on_level,
        )  # fmt: skip
