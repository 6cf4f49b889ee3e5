"""A run that is guided: the tracker's estimates in, cues out, to show, to speak and to keep.

In: a plan, where to go, estimates as they come. Out: the newest `Cue`, sentences, cues.csv. Owns the guide.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

from echostep.errors import EchostepError
from echostep.estimate import Estimate
from echostep.guidance import Cue, Guide
from echostep.plan import Plan
from echostep.routes import Place, Route, Routes
from echostep.tracker import Tracker

CUE_COLUMNS = ("t_s", "kind", "arrow_rad", "left_m", "text", "spoken")


def destination(text: str, plan: Plan) -> Place:
    """The place of a room's name, of X,Y[,LEVEL], or the plan's start (`start`); raises EchostepError that lists the rooms."""
    if text == "start" and plan.start is not None:
        return Place(plan.start.x_m, plan.start.y_m, max(plan.start.level, 0))
    for k, level in enumerate(plan.levels):
        for room in level.rooms:
            if room.name.casefold() == text.casefold():
                return Place(*room.at_m, k)
    try:
        x, y, *rest = (float(part) for part in text.split(","))
        level_number = int(rest[0]) if rest else 0
        if len(rest) > 1 or not (math.isfinite(x) and math.isfinite(y)) or not 0 <= level_number < len(plan.levels):
            raise ValueError
    except (ValueError, OverflowError) as error:
        names = sorted({room.name for level in plan.levels for room in level.rooms})
        known = f"one of: {', '.join(names)}" if names else "this plan names no rooms"
        raise EchostepError(f"--guide {text}: expected start, X,Y[,LEVEL] on the plan, or a room; {known}") from error
    return Place(x, y, level_number)


class Guided:
    """Guides the wearer of one tracker to one place; the way is laid at the first estimate."""

    def __init__(self, tracker: Tracker, to: Place) -> None:
        """Raises EchostepError for a place outside the plan, before anybody walks."""
        self._tracker = tracker
        self._to = to
        self._routes = Routes(tracker.plan)
        self._routes.way(to, to)
        self._guide: Guide | None = None
        self.cues: list[Cue] = []

    @property
    def cue(self) -> Cue | None:
        """The newest cue."""
        return self.cues[-1] if self.cues else None

    @property
    def route(self) -> Route | None:
        """The way as it is now."""
        return self._guide.route if self._guide else None

    def take(self, estimates: Sequence[Estimate]) -> list[Cue]:
        """Cues for new estimates."""
        new: list[Cue] = []
        for e in estimates:
            if self._guide is None and not self._lay(e):
                continue
            assert self._guide is not None
            crumbs = self._tracker.filter.crumbs if self._tracker.filter else None
            new.append(self._guide.cue(e, crumbs.heard_s if crumbs else None))
        self.cues += new
        return new

    def write(self, path: Path) -> None:
        """All cues as CSV."""
        with path.open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(CUE_COLUMNS)
            writer.writerows([getattr(cue, name) for name in CUE_COLUMNS] for cue in self.cues)

    def _lay(self, e: Estimate) -> bool:
        """Lay the way from a first estimate; a place from which no way leads is asked again at the next."""
        try:
            route = self._routes.way(Place(e.x_m, e.y_m, e.level), self._to)
        except EchostepError:
            return False
        self._guide = Guide(route, planner=self._routes)
        return True
