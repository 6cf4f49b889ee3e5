# SPDX-License-Identifier: MIT
"""Taps: the preview of a check-in's effect.

In: a plan; a check-in that a page considers, and the scene that it was shown. Out: `Considered`: plain data. Owns the known spaces of the plan.
One thread asks at a time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from echostep.localization import Estimate, TrackStatus
from echostep.plan import Plan
from echostep.ports.people.check_in import CheckIn
from echostep_app.page.elements.likely_places import numbered, places_text
from echostep_app.page.elements.scene import PageScene, format_metres
from echostep_app.plan.places.bearing import KNOWN_HEADING_RAD
from echostep_app.plan.places.spaces import PlanSpaces
from echostep_app.plan.places.standing import StandingGround
from echostep_app.plan.places.whereabouts import Whereabouts

DOUBTED_M = 1.0  # a check-in that is farther than this outside the ellipse of a fitting place is doubted; assumed


@dataclass(frozen=True, slots=True)
class Considered:
    """The effect of a check-in. The field names are keys of the JSON.

    `x_m`, `y_m`: the place that it would give: the nearest possible one when the place that was asked for is impossible. `possible`: there is
    one. `text`: the effect, in sentences.
    """

    x_m: float
    y_m: float
    level: int
    heading_rad: float | None
    possible: bool
    text: str
    kind: Literal["considered"] = "considered"


class Taps:
    """Judges the check-ins of all pages of a run."""

    def __init__(self, plan: Plan) -> None:
        spaces = PlanSpaces(plan)
        self.whereabouts = Whereabouts(plan, spaces)
        self._ground = StandingGround(plan, spaces)
        self._plan = plan
        self._last: tuple[Estimate | None, str, str] = (None, "", "")

    def where(self, estimate: Estimate) -> str:
        """The place of an estimate in words; cached, because all pages of a live run show the same one."""
        return self._words(estimate, ())[0]

    def places(self, estimate: Estimate, numbers: Sequence[int] = ()) -> str:
        """The places of its hypotheses as a sentence, with their numbers."""
        return self._words(estimate, numbers)[1]

    def _words(self, estimate: Estimate, numbers: Sequence[int]) -> tuple[str, str]:
        """Both, kept for the next page that asks."""
        if self._last[0] is not estimate:
            words = self.whereabouts.words
            shown = numbered(estimate, numbers)
            places = tuple(words(h.x_m, h.y_m, h.level) for _, h in shown)
            where = words(estimate.x_m, estimate.y_m, estimate.level) if estimate.claims_place else ""
            self._last = estimate, where, places_text(shown, places, self._plan)
        return self._last[1:]

    def refusal(self, check_in: CheckIn) -> str:
        """Why a check-in is refused, in words; empty when it is not."""
        objection = self._ground.objection(check_in.x_m, check_in.y_m, check_in.level)
        return f"Not accepted: {objection.reason}." if objection else ""

    def consider(self, check_in: CheckIn, scene: PageScene | None) -> Considered:
        """The effect of a check-in after a scene."""
        x_m, y_m, level, heading_rad = check_in.x_m, check_in.y_m, check_in.level, check_in.heading_rad
        objection = self._ground.objection(x_m, y_m, level)
        if objection and objection.nearest_m is None:
            return Considered(x_m, y_m, level, heading_rad, False, f"Nobody can stand here: {objection.reason}.")
        sentences = []
        if objection and objection.nearest_m:
            away_m = math.dist(objection.nearest_m, (x_m, y_m))
            x_m, y_m = objection.nearest_m
            sentences.append(
                f"Nobody can stand there: {objection.reason}. The nearest possible place is {format_metres(away_m)} away."
            )
        words = self.whereabouts.words(x_m, y_m, level) or f"x {x_m:.1f}, y {y_m:.1f} m"
        floor = f", {self._plan.levels[level].name}" if len(self._plan.levels) > 1 else ""
        sentences.append(f"{words[0].upper()}{words[1:]}{floor}.")
        sentences += self._changes(x_m, y_m, check_in, scene)
        return Considered(x_m, y_m, level, heading_rad, True, " ".join(sentences))

    def _changes(self, x_m: float, y_m: float, check_in: CheckIn, scene: PageScene | None) -> list[str]:
        """How a check-in would change the estimate of a scene, and the objections to it."""
        estimate = scene.estimate if scene else None
        if check_in.heading_rad is not None:
            heading = "You face the arrow."
        elif estimate and estimate.heading_sd_rad <= KNOWN_HEADING_RAD:
            heading = "Your direction stays: drag to change it."
        else:
            heading = "Drag to where you look, or your direction is found while you walk."
        if scene is None or estimate is None or not estimate.claims_place:
            return [heading]
        away_m = math.dist((x_m, y_m), (estimate.x_m, estimate.y_m))
        moved = estimate.level != check_in.level or away_m > estimate.ellipse95.major_m + DOUBTED_M
        changes = [f"{format_metres(away_m)} from the estimate."] if estimate.level == check_in.level else []
        if moved and scene.echoes_fit and estimate.status is TrackStatus.TRACKING:
            changes.append("The echoes fit the estimate: are you sure?")
        return [*changes, heading]
