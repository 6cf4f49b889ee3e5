# SPDX-License-Identifier: MIT
"""The map filter: measured path segments and beacon readings in, estimates out.

In: `MeasuredSegment`s, each with the pings triggered on it, in order of time; the beacons' readings. Out: an `Estimate` at the end of each segment.
Owns the clouds, the beacon map, and the probability that each cloud is right.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from echostep.angles import mean_angle
from echostep.board.gateway import BeaconReading
from echostep.localization.beacon_map import BeaconMap
from echostep.localization.belief import (
    AGREED,
    BELIEVED,
    DOUBTED,
    ELSEWHERE,
    FOUND,
    REFUTED,
    STATED,
    UNSTATED,
    WIDE_DOUBTED,
    CloudHypothesis,
    PlanVerdict,
    Plausibility,
    away_m,
    beyond_errors_that_stay,
    right_against,
)
from echostep.localization.building import Building
from echostep.localization.echoes.likelihood import EchoSettings
from echostep.localization.echoes.unplanned import UnplannedDensities, UsablePings, evidence_share
from echostep.localization.estimate import LOST_M, SURE, TRACKING_M, Estimate, Right, estimate, weight_about
from echostep.localization.grid.start import grid_of, is_unknown
from echostep.localization.height.height_filter import RelativeHeight, RidingHeight
from echostep.localization.height.levels import HeightChange
from echostep.localization.motion import HEIGHT_SD_M, Gap, Gaps, height_change, move_of
from echostep.localization.particle_arrays import Move, PingBatch
from echostep.localization.particles.cloud import Cloud, Evidence
from echostep.localization.particles.start import ANY_LEVEL, Air, Start
from echostep.localization.search import SearchProgress
from echostep.localization.settings import FilterSettings, echo_models, with_plan_error
from echostep.localization.team.meetings import (
    FITS,
    WRONG,
    Meeting,
    MeetingEffect,
    MeetingMemory,
    moved_by,
    start_at,
    weigh_by,
)
from echostep.localization.window import RecentWay
from echostep.path import MeasuredSegment, PathSegment
from echostep.plan.model import Pose

SUPPORTED_M = 2.0  # path behind the last ping on which the plan still supports the cloud, assumed
EXACT_SD_M = 0.005  # least standard deviation per axis of an estimate: no plan is more exact
# Standard deviation per axis when all views are hidden: a plan that explains few echoes may be so far off
HIDDEN_SD_M = 0.15
BY_DEFINITION = 1.0 - 1e-6  # without a plan: the map begins where the walk began, and no echo can contradict that
UNOBSERVED_DOUBT = 0.2  # probability that a move which was not observed led out of the scattered cloud, assumed


class MapFilter:
    """The tracked cloud, and a second one that searches the building while the first is doubted."""

    def __init__(
        self, building: Building, start: Start, walk_heading_rad: float, rng: np.random.Generator,
        settings: FilterSettings | None = None,
    ) -> None:  # fmt: skip
        """`walk_heading_rad`: the trunk's heading in the walk frame while it stands at the start."""
        self._settings = settings or FilterSettings()
        self._building = building
        self._rng = rng
        self._model, self._blurred = echo_models(self._settings)
        echo = with_plan_error(self._settings)
        self._pings = UsablePings(building.background(self._model), echo)
        cloud = self._new_cloud(start, walk_heading_rad)
        stated = not cloud.is_searching
        self._plan = PlanVerdict(self._settings.plan_sd_m)
        prior = (STATED if stated else UNSTATED) if building.has_walls else BY_DEFINITION
        self.tracked = CloudHypothesis(cloud, Plausibility(prior), stated)
        self.search: CloudHypothesis | None = None
        self._progress = SearchProgress(self._pings.odometer, building.levels, self.tracked.plausibility.log_odds)
        self._is_refuted = False  # whether the tracked cloud was as good as wrong since it was doubted
        self._is_elsewhere = False  # whether a gap may have led elsewhere since the tracked cloud was last confirmed
        self._height = None if building.has_walls else RelativeHeight(self._settings.climb.drift_m)
        self._gaps = Gaps()
        self._way = RecentWay()  # since the last gap
        self._riding = RidingHeight(HEIGHT_SD_M)
        self._barometer_starts = 0  # before the last height by pressure
        self._met = MeetingMemory(self._pings.odometer)
        self.beacon_map = BeaconMap(building.walls, self._settings.beacons, rng)
        if start.after_pause:
            self.tracked.plausibility.doubt(UNOBSERVED_DOUBT)
            self._search_beside(start.air, walk_heading_rad)

    @property
    def echo(self) -> EchoSettings:
        """Settings of the ranger model."""
        return self._settings.echo

    def set_ranger_model(self, echo: EchoSettings) -> None:
        """Use these ranger settings from the next segment on."""
        if echo != self._settings.echo:
            self._settings = replace(self._settings, echo=echo)
            self._model, self._blurred = echo_models(self._settings)
            self._pings.set_ranger_model(self._building.background(self._model), with_plan_error(self._settings))

    @property
    def cloud(self) -> Cloud:
        """The cloud that is tracked."""
        return self.tracked.cloud

    def update(self, measured: MeasuredSegment, readings: Sequence[BeaconReading] = ()) -> Estimate:
        """Propagate along a segment, reweight by its pings, height change and beacon readings, and resample; returns the estimate at its end."""
        segment = measured.segment
        gap = self._gaps.ended(measured)
        self._follow_barometer(measured)
        change = height_change(measured, self._riding.height_m)
        if self._height is not None:
            self._height.update(change)
        if segment.unobserved:
            self._scatter(segment, change)
        if gap is not None:
            if gap is not Gap.UNOBSERVED:  # a rest, a ride in a lift, or a walk
                self.tracked.plausibility.doubt(UNOBSERVED_DOUBT)
            self._search_beside(self.cloud.air, segment.heading1_rad)
        if not segment.unobserved:
            self._follow(measured, change)
        if not self.cloud.is_searching:
            self.beacon_map.update(self.cloud, segment, readings, bool(readings) and self.plan_supports)
        right = self._right()
        if self._choose(right.here, segment.heading1_rad):
            right = self._right()
        return self._estimate(segment, right)

    def meet(self, meeting: Meeting) -> MeetingEffect:
        """Weigh the clouds by the place of a teammate beside the wearer, and decide which of them is tracked.

        Agreement raises the cloud's probability to at most the meeting's: both may stem from one source. A contradiction moves a doubted cloud, a
        believed one only when a second teammate contradicts too and that is likelier. A radio range beyond PLACE_M moves nothing; ranges to two
        teammates' beacons can begin a search.
        """
        area_m2 = self._building.floor.area_m2
        refusal = MeetingEffect.EMPTY if area_m2 <= 0.0 else self._met.refusal(meeting)
        if refusal is not None:
            return refusal
        fits = [weigh_by(each, meeting, area_m2) for each in self._clouds()]
        if meeting.beacon is not None:
            return MeetingEffect.USED if fits[0] >= FITS else MeetingEffect.CONTRADICTS
        plausibility, wrong = self.tracked.plausibility, WRONG[meeting.status]
        if fits[0] >= FITS:
            plausibility.raise_to(min(fits[0], 1.0 - wrong))
            self._met.agree()
            return MeetingEffect.USED
        moved = moved_by(meeting, plausibility.probability, self._met.contradict())
        if moved is None:
            return MeetingEffect.CONTRADICTS
        self._met.agree()
        self._track_from(meeting, moved, search_fits=fits[-1] >= FITS)
        return MeetingEffect.MOVED

    def _track_from(self, meeting: Meeting, right: float, *, search_fits: bool) -> None:
        """Track the search from now on if it agrees with a meeting, otherwise a new cloud about the teammate, with any heading."""
        if self.search is not None and search_fits:
            self.tracked = self.search
            self.tracked.plausibility = Plausibility(right)
        else:
            at = start_at(meeting)
            start = Start(Pose(at.x_m, at.y_m, 0.0, at.level), at.sd_m, math.pi)
            self.tracked = CloudHypothesis(self._new_cloud(start, 0.0), Plausibility(right), is_stated=True)
        self.search, self._is_elsewhere = None, False

    def turn_walk_frame(self, by_rad: float) -> None:
        """Rotate all particles: the heading in the walk frame has changed while the wearer's heading on the map has not."""
        for each in self._clouds():
            each.cloud.turn_walk_frame(by_rad)

    def _new_cloud(self, start: Start, walk_heading_rad: float) -> Cloud:
        """A cloud of a start; a search, where the place is unknown."""
        s, b = self._settings, self._building
        cloud = Cloud(s.cloud, start, walk_heading_rad, self._rng, b.sheet, s.climb, b.floor)
        if is_unknown(start) and len(b.floor.x_m):
            cloud.grid = grid_of(start, walk_heading_rad, b.cells(self._model), b.floor, b.sheet, s, self._rng)
        return cloud

    @property
    def plan_supports(self) -> bool:
        """Whether the last metres of echoes confirm the cloud by the plan."""
        return self._building.has_walls and self._right().here > BELIEVED and self._pings.silent_m < SUPPORTED_M

    def _search_beside(self, air: Air | None, walk_heading_rad: float) -> None:
        """Search the whole building in addition to the tracked cloud, which covers the near places.

        `air`: calibration of the heights by pressure; None: the level is unknown, so places above and below are searched more densely than the rest.
        """
        if self.cloud.is_searching or not len(self._building.floor.x_m):
            return
        self._is_elsewhere, self._way = True, RecentWay()
        on_levels = self.cloud.sheet is not None and air is None
        near = replace(self._believed(walk_heading_rad), level=ANY_LEVEL) if on_levels else None
        self.search = self._new_search(Start(near=near, air=air), walk_heading_rad)

    def _follow_barometer(self, measured: MeasuredSegment) -> None:
        """Let the lag of the height by pressure drift over a pause; forget it where the heights begin anew."""
        anew = len(measured.height_m) > 0 and measured.barometer_starts != self._barometer_starts
        if anew:
            self._barometer_starts = measured.barometer_starts
        for each in self._clouds():
            if anew:
                each.cloud.forget_lag()
            else:
                each.cloud.let_lag_drift(self._gaps.pause_s)
        if anew:
            self._riding.forget()
            if self._height is not None:
                self._height.forget_lag()
        self._riding.add(measured.height_m, self._gaps.pause_s + measured.segment.t1_s - measured.segment.t0_s)

    def _scatter(self, segment: PathSegment, change: HeightChange) -> None:
        """Spread the clouds over an unobserved segment."""
        for each in self._clouds():
            each.cloud.scatter(move_of(segment), change)
            each.plausibility.doubt(UNOBSERVED_DOUBT)

    def _follow(self, measured: MeasuredSegment, change: HeightChange) -> None:
        """Propagate along an observed segment; a cloud resamples itself after each reweighting that needs it."""
        segment = measured.segment
        pings, unplanned = self._pings.take(measured if self._building.has_walls else measured.without_pings)
        move, path_m = move_of(segment), math.hypot(segment.dx_m, segment.dy_m)
        self._way.add(move, pings, change)
        for each in self._clouds():
            self._follow_with(each, move, pings, unplanned, evidence_share(segment.turn_rad))
            each.cloud.change_levels(move, change)
            if each.cloud.is_searching:
                if each.cloud.show_search():
                    self._way.pass_again(each.cloud, self._blurred, self._building.walls)
                    each.cloud.draw_veer()
                continue
            loss = self._building.log_loss_in_air(each.cloud.x_m, each.cloud.y_m, path_m) if path_m > 0.0 else None
            if loss is not None:
                each.cloud.reweight(loss)
        if self.search is None and self.tracked.has_contracted and self.tracked.plausibility.probability > BELIEVED:
            self._plan.confirm(path_m)

    def _follow_with(
        self, each: CloudHypothesis, move: Move, pings: PingBatch, unplanned: UnplannedDensities, share: float
    ) -> None:
        """Propagate and reweight one cloud, and update its probability by this share of the evidence of the pings."""
        cloud = each.cloud
        if cloud.grid is not None:
            cloud.grid.advance(move, pings, self._model)
        else:
            model = self._blurred if cloud.is_scattered else self._model  # by the spacing of sparse particles
            evidence = cloud.propagate_and_reweight(move, pings, model, self._building.walls)
            # Where there were several places, a light one may have lost its particles on one level by chance.
            if cloud.is_on_any_level and cloud.is_in_one_place:
                self._way.pass_again(cloud, self._blurred, self._building.walls)
                cloud.is_on_any_level = False
            path_m = math.hypot(move.dx_m, move.dy_m)
            if each is self.tracked and each.plausibility.probability > BELIEVED and not self._is_elsewhere:
                log_path = self._plan.pass_walls(self._believed(0.0), path_m, evidence.log_path)
                evidence = evidence._replace(log_path=log_path)
            if self._building.has_walls:
                self._update_plausibility(each, evidence, pings, unplanned, path_m, share)

    def _update_plausibility(
        self, each: CloudHypothesis, evidence: Evidence, pings: PingBatch, unplanned: UnplannedDensities, path_m: float,
        share: float,
    ) -> None:  # fmt: skip
        """Update the probability that a cloud is right by the density of its echoes against that without a plan.

        Echoes that made it converge are not counted as evidence for it: until it has contracted, they raise its probability to UNSTATED at most.
        """
        cloud, most = each.cloud, each.plausibility.probability
        converged = each.has_contracted and not cloud.is_scattered
        each.has_contracted = each.has_contracted or cloud.is_contracted
        rival = unplanned.either if converged or each.is_stated else unplanned.anywhere
        seen = 1.0 - cloud.hidden_shares[pings.ranger]
        gain = share * beyond_errors_that_stay(evidence.log_pings - rival, seen * pings.power)
        each.plausibility.update(gain, evidence.log_path, path_m)
        if converged:
            each.evidence_m += path_m
        else:
            each.plausibility.limit(min(most, UNSTATED) if cloud.rescues else max(most, UNSTATED))

    def _clouds(self) -> list[CloudHypothesis]:
        return [self.tracked] if self.search is None else [self.tracked, self.search]

    def _right(self) -> Right:
        """Probability that the tracked cloud is right: while the building is searched, no more than the search's weight there, or by predictions."""
        here = self.tracked.plausibility.probability
        if self.search is None:
            return Right(here)
        cloud, mean = self.search.cloud, self._believed(0.0)
        place_m = mean.x_m, mean.y_m, float(self.cloud.weight @ self.cloud.z_m)
        near, about = weight_about(cloud.map_x_m, cloud.y_m, cloud.z_m, cloud.weight, place_m, (TRACKING_M, LOST_M))
        most = near
        if cloud.is_searching or near <= ELSEWHERE:
            most = max(near, right_against(self.tracked, self.search, self._progress.log_odds_before))
        return Right(min(here, most), about)

    def _choose(self, right: float, walk_heading_rad: float) -> bool:
        """Begin a search where the tracked cloud is doubted, end it where it is believed again, or track the cloud of the search.

        `right`: probability that the tracked cloud is right. Returns whether the tracked cloud or the search was replaced.
        """
        tracked, search = self.tracked, self.search
        self._is_refuted = self._is_refuted or tracked.plausibility.log_odds < REFUTED
        self._note_unfound()
        if self._progress.is_astray(tracked.cloud):
            self._plan.fail_search()
            self.tracked = self._new_search(Start(), walk_heading_rad)
        elif search is None:
            return self._doubt(tracked, walk_heading_rad)
        elif right > AGREED:
            self._agree()
        elif search.plausibility.probability > FOUND and search.cloud.is_in_one_place and right < DOUBTED:
            self._follow_search(search)
        elif self._progress.has_failed(search):
            self._plan.fail_search()
            start = Start() if self._is_elsewhere else self._nearby(walk_heading_rad)
            self.search = self._new_search(start, walk_heading_rad)
        else:
            return False
        return True

    def _agree(self) -> None:
        """End a search that agrees with the tracked cloud: that cloud was right, unless it was refuted and is now at the true place by chance."""
        if self._is_refuted:
            self._plan.find(self._progress.length_m, math.inf)
        else:
            self._plan.agree()
        self.search, self._is_elsewhere = None, False

    def _follow_search(self, search: CloudHypothesis) -> None:
        """Track the cloud of the search."""
        was = self._believed(0.0)
        self.tracked, self.search, self._is_elsewhere = search, None, False
        self._plan.find(self._progress.length_m, away_m(was, self._believed(0.0)))

    def _note_unfound(self) -> None:
        """Count against the plan that a search has no probable place at the end of the path within which one is usually found."""
        cloud = self._clouds()[-1].cloud
        if cloud.is_searching and self._progress.note_unfound() and cloud.place_share < DOUBTED:
            self._plan.fail_search()

    def _doubt(self, tracked: CloudHypothesis, walk_heading_rad: float) -> bool:
        """Begin a search if the tracked cloud is improbable; returns whether a search began."""
        least = DOUBTED if tracked.has_contracted or tracked.cloud.rescues else WIDE_DOUBTED
        if tracked.plausibility.probability >= least or tracked.cloud.is_searching or not len(self._building.floor.x_m):
            return False
        if tracked.is_stated:
            self._plan.reject_start(self._pings.odometer.path_m)
        else:
            self._plan.reject_found(self._progress.length_m - self._progress.found_within_m)
        self._is_refuted = False
        self.search = self._new_search(self._nearby(walk_heading_rad), walk_heading_rad)
        return True

    def _nearby(self, walk_heading_rad: float) -> Start:
        """Anywhere, a share near the tracked cloud, at its height."""
        return Start(near=self._believed(walk_heading_rad), near_z_m=float(self.cloud.weight @ self.cloud.z_m))

    def _new_search(self, start: Start, walk_heading_rad: float) -> CloudHypothesis:
        self._progress.begin(self.tracked.plausibility.log_odds)
        self._met.forget_beacons()
        return CloudHypothesis(self._new_cloud(start, walk_heading_rad), Plausibility(UNSTATED))

    def _believed(self, walk_heading_rad: float) -> Pose:
        """The mean pose of the tracked cloud, on its likeliest level."""
        cloud, weight = self.cloud, self.cloud.weight
        level = cloud.likeliest_level
        on = cloud.level == level
        x, y = (float(np.average(v[on], weights=weight[on])) for v in (cloud.map_x_m, cloud.y_m))
        return Pose(x, y, mean_angle(cloud.turn_rad, weight) + walk_heading_rad, level)

    def _estimate(self, segment: PathSegment, right: Right) -> Estimate:
        """The estimate at the end of a segment."""
        hidden_sd_m = HIDDEN_SD_M * self.cloud.hidden_share
        sd_m = math.hypot(segment.anchor_sd_m, self._settings.plan_sd_m, hidden_sd_m, EXACT_SD_M)
        search = self.search.cloud if self.search else None
        elsewhere, plan_fits = self._building.elsewhere, self._plan.probability
        if plan_fits < SURE:  # above it, the stated errors are conditional on the plan
            right = Right(right.here * plan_fits, right.about)
        new = estimate(self.cloud, segment.t1_s, segment.heading1_rad, segment.step, sd_m, right, elsewhere, search)
        if self._height is not None:
            new = replace(new, z_m=self._height.height_m, z_sd_m=self._height.sd_m)
        return replace(
            new,
            plan_fits=plan_fits,
            outside=self._building.weight_outside(self.cloud.x_m, self.cloud.y_m, self.cloud.weight),
        )
