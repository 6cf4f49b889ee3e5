# SPDX-License-Identifier: MIT
"""The rows of the table: each is a walk, the plan that the filter gets, and its start.

In: the walks of one seed. Out: `TRIALS`: name -> `Trial`. Owns what each row means. A start that is wrong is wrong in a random direction.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from echostep.errors import EchostepError
from echostep.localization import Start
from echostep.plan import Plan, Pose
from echostep_simulation.world.tower import tower
from echostep_studies.anywhere import plan_changes
from echostep_studies.anywhere.kidnaps import Kidnapped, asleep_in_lift, carried, off_in_lift, restarted
from echostep_studies.bench import echo_changes, sites
from echostep_studies.bench.walks import SimulatedWalk, X, Y, simulate, simulate_with_gap

KIDNAP_AT_M = 35.0  # way before a kidnapping
CARRIED_M = 20.0
ASLEEP_S = 60.0
AFTER_ASLEEP_M = 200.0  # length of a walk with such a gap


@dataclass(frozen=True, slots=True)
class Trial:
    """`segments` and truth of `walk`, the plan and the start that the filter gets, and when the search begins.

    `on_plan`: False where the plan is so different that the wearer has no place on it.
    """

    walk: SimulatedWalk
    plan: Plan
    start: Start
    from_s: float = 0.0
    on_plan: bool = True


class Walks:
    """The walks of one seed, each simulated when it is first asked for. `data`: folder of the public recordings."""

    def __init__(self, seed: int, data: Path | None) -> None:
        self.seed = seed
        self.data = data

    def rng(self, which: int) -> np.random.Generator:
        """A generator of its own for each purpose."""
        return np.random.default_rng([self.seed, 90, which])

    @cached_property
    def office(self) -> SimulatedWalk:
        """A walk in the demo office."""
        return simulate(sites.office(self.seed), self.seed)

    @cached_property
    def glazed(self) -> SimulatedWalk:
        """The same walk among panes of glass."""
        return simulate(echo_changes.with_panes(sites.office(self.seed), self.rng(0)), self.seed)

    @cached_property
    def asleep(self) -> Kidnapped:
        """A long walk in the office with a gap."""
        site = sites.office(self.seed, AFTER_ASLEEP_M)
        return simulate_with_gap(site, self.seed, KIDNAP_AT_M, ASLEEP_S)

    @cached_property
    def floors(self) -> SimulatedWalk:
        """A walk in the building of three storeys."""
        return simulate(sites.three_floors(self.seed), self.seed)

    @cached_property
    def floor(self) -> SimulatedWalk:
        """A walk on its lowest floor alone."""
        return simulate(sites.one_floor(self.seed, 0), self.seed)

    @cached_property
    def westport_house(self) -> SimulatedWalk:
        """A walk in a real building of seven floors."""
        if self.data is None:
            raise EchostepError("westport-house is one of the public recordings: --data DIR")
        return simulate(sites.westport_house(self.seed, self.data), self.seed)

    @cached_property
    def lift(self) -> Kidnapped:
        """A walk there with a ride in the lift, board and tracker off."""
        return off_in_lift(self._by_lift)

    @cached_property
    def asleep_in_lift(self) -> Kidnapped:
        """The same, only the laptop asleep."""
        return asleep_in_lift(self._by_lift)

    @cached_property
    def _by_lift(self) -> SimulatedWalk:
        return simulate(sites.by_lift(self.seed), self.seed)


def _exact(walk: SimulatedWalk) -> Pose:
    return walk.pose_at(walk.segments[0].segment.t0_s)


def _off(walks: Walks, off_m: float, off_deg: float, *, stated: bool = False) -> Trial:
    """A start in the office that is off by a distance in a random direction, and by an angle to a random side; `stated`: with that spread."""
    rng, pose = walks.rng(1), _exact(walks.office)
    way, side = rng.uniform(0.0, 2.0 * math.pi), rng.choice([-1.0, 1.0])
    x, y = pose.x_m + off_m * math.cos(way), pose.y_m + off_m * math.sin(way)
    start = Pose(x, y, pose.heading_rad + side * math.radians(off_deg), pose.level)
    stated_start = Start(start, off_m / math.sqrt(2.0), math.radians(off_deg)) if stated else Start(start)
    return Trial(walks.office, walks.office.built, stated_start)


def _from_start(walk: SimulatedWalk, plan: Plan | None = None) -> Trial:
    """From the exact start."""
    return Trial(walk, plan or walk.built, Start(_exact(walk)))


def _from_anywhere(walk: SimulatedWalk) -> Trial:
    """From an unknown start."""
    return Trial(walk, walk.built, Start())


def _wide(walk: SimulatedWalk) -> Trial:
    """From the middle of the plan, with a third of its size as standard deviation and any heading."""
    low, high = (f(walk.built.levels[0].walls.reshape(-1, 2), axis=0) for f in (np.min, np.max))
    x, y = (0.5 * (low + high)).tolist()
    return Trial(walk, walk.built, Start(Pose(x, y, 0.0), float((high - low).max()) / 3.0, math.pi))


def _from_room(walk: SimulatedWalk) -> Trial:
    """From somewhere in the room of the start, on the lowest floor of the building of three storeys."""
    pose = _exact(walk)
    return Trial(walk, walk.built, Start(room_m=sites.room_at(pose.x_m, pose.y_m), level=0))


def _kidnapped(kidnapped: Kidnapped) -> Trial:
    """From the exact start, judged from the end of the kidnapping on."""
    walk, from_s = kidnapped
    return Trial(walk, walk.built, Start(_exact(walk)), from_s)


def _restarted(walks: Walks) -> Trial:
    """A new tracker in mid-walk, which does not know where."""
    walk, from_s = restarted(walks.office, KIDNAP_AT_M)
    return Trial(walk, walk.built, Start(), from_s)


def _mirrored(walks: Walks) -> Trial:
    plan, start = plan_changes.mirrored(walks.office.built, _exact(walks.office))
    return Trial(walks.office, plan, Start(start), on_plan=False)


def _other_floor(walks: Walks) -> Trial:
    plan = sites.level_alone(tower(sites.STOREYS), 1)
    return Trial(walks.floor, plan, Start(_exact(walks.floor)), on_plan=False)


def _other_house(walks: Walks) -> Trial:
    plan = sites.level_alone(tower(sites.STOREYS), 0)
    return Trial(walks.office, plan, Start(Pose(sites.LOBBY.x_m, sites.LOBBY.y_m, math.pi)), on_plan=False)


def _on_other_plan(walks: Walks, change: Callable[..., Plan], which: int) -> Trial:
    """From the exact start, on a plan with one wall too many or too few beside the way."""
    way = walks.office.truth[:, [X, Y]]
    return _from_start(walks.office, change(walks.office.built, way, walks.rng(which)))


TRIALS: dict[str, Callable[[Walks], Trial]] = {
    "start/exact": lambda w: _from_start(w.office),
    "start/0.5m10deg": lambda w: _off(w, 0.5, 10.0),
    "start/20deg": lambda w: _off(w, 0.0, 20.0),
    "start/1m20deg": lambda w: _off(w, 1.0, 20.0),
    "start/1m20deg-told": lambda w: _off(w, 1.0, 20.0, stated=True),
    "start/room": lambda w: _from_room(w.floor),
    "start/wide": lambda w: _wide(w.office),
    "start/unknown-office": lambda w: _from_anywhere(w.office),
    "start/unknown-3-floors": lambda w: _from_anywhere(w.floors),
    "start/unknown-half-turn": lambda w: replace(_on_other_plan(w, plan_changes.beside_half_turn, 8), start=Start()),
    "start/unknown-westport-house": lambda w: _from_anywhere(w.westport_house),
    "kidnap/carried": lambda w: _kidnapped(carried(w.office, KIDNAP_AT_M, CARRIED_M)),
    "kidnap/lift": lambda w: _kidnapped(w.lift),
    "kidnap/lift-asleep": lambda w: _kidnapped(w.asleep_in_lift),
    "kidnap/restart": _restarted,
    "kidnap/asleep": lambda w: _kidnapped(w.asleep),
    "plan/10cm": lambda w: _from_start(w.office, plan_changes.displaced(w.office.built, 0.1, w.rng(2))),
    "plan/wall-missing": lambda w: _on_other_plan(w, plan_changes.wall_missing, 3),
    "plan/wall-added": lambda w: _on_other_plan(w, plan_changes.wall_added, 4),
    "plan/other-floor": _other_floor,
    "plan/mirrored": _mirrored,
    "plan/other-house": _other_house,
    "echoes/people-10": lambda w: _from_start(echo_changes.with_people(w.office, 0.1, w.rng(5))),
    "echoes/people-20": lambda w: _from_start(echo_changes.with_people(w.office, 0.2, w.rng(6))),
    "echoes/half-silent": lambda w: _from_start(echo_changes.silenced(w.office, 0.5, w.rng(7))),
    "echoes/one-ranger": lambda w: _from_start(echo_changes.one_ranger(w.office)),
    "echoes/glass": lambda w: _from_start(w.glazed, w.office.built),
    "hall": lambda w: _from_start(simulate(sites.hall(w.seed), w.seed)),
    "outside": lambda w: _from_start(simulate(sites.yard(w.seed), w.seed)),
}
NEEDS_DATA = {"start/unknown-westport-house"}
PEERED = {name for name in TRIALS if name.startswith(("start/unknown", "kidnap/"))}
