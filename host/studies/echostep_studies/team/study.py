# SPDX-License-Identifier: MIT
"""The study `team`: errors of five wearers, each alone and with its meetings.

In: seeds. Out: rows `office/tap`, `tower/radio`, ... Owns the conditions. Simulated.

All wearers but the first have their true starts; the first has a wrong one (`door`: all begin side by side, as teams go in; `tap`, `radio`: all begin
apart; `beacons`: the same, each drops beacons, hears those of all and shares its own) or none (`unknown`, apart), or knows its own too and reports
false places (`liar`: that wearer is left out of all columns). `ratio`: mean error of all wearers and runs together over that alone. `worst`:
the greatest such ratio of one wearer in one run, the first one left out; `by_chance`: the same of the trackers alone with other random numbers, over
those alone: how much of `worst` means nothing. An error on a wrong floor is at least a storey.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization import Estimate, Start, TrackStatus
from echostep.plan import Plan, Pose, load_plan
from echostep_app.output.table import Table
from echostep_app.plan.routing import RoutePlace
from echostep_simulation.world.tower import tower
from echostep_studies.bench import judgement, sites
from echostep_studies.bench.judgement import FALSE_TRACKING_M, true_places
from echostep_studies.bench.tours import random_tour
from echostep_studies.frame.parts import matching
from echostep_studies.frame.report import Row, by_name, means
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.team.beacons import with_dropped_beacons
from echostep_studies.team.tracking import LIAR, How, track_team
from echostep_studies.team.walks import WEARERS, TeamWalks, team_walks

ASKED_RATIO, ASKED_WORST = 0.6, 1.05  # what a team asks for
LENGTH_M = 100.0  # least length of each way
WRONG_M = 5.0  # least distance of a wrong start from the true one: another room
FIRST = 0  # the wearer whose start is wrong or unknown
OTHER_DRAWS = 1_000_000  # added to the seed of the filters
TRIES = 200  # for a wrong start
HOWS = {
    "door": How.TAP,
    "tap": How.TAP,
    "radio": How.RADIO,
    "unknown": How.TAP,
    "liar": How.LIAR,
    "beacons": How.BEACONS,
}
COLUMNS = {
    "name": "", "runs": "runs", "meetings": "meetings", "alone_m": "alone m", "together_m": "together m", "ratio": "ratio",
    "first_alone_m": "first alone", "first_together_m": "together", "others_alone_m": "others alone",
    "others_together_m": "together", "worst": "worst", "by_chance": "by chance", "false_alone": "false tracking %", "false_together": "together",
}  # fmt: skip
Building = tuple[Plan, RoutePlace]
BUILDINGS: dict[str, Callable[[], Building]] = {
    "office": lambda: (load_plan(sites.OFFICE_PLAN), sites.OFFICE_DOOR), "tower": lambda: (tower(sites.STOREYS), sites.LOBBY),
}  # fmt: skip
ROWS = tuple(f"{building}/{how}" for building in BUILDINGS for how in HOWS)


@dataclass(frozen=True, slots=True, kw_only=True)
class WearerRun:
    """A wearer's tracker alone, together, and alone with other random numbers: mean errors, shares of false tracking."""

    name: str
    wearer: int
    meetings: int
    alone_m: float
    false_alone: float
    together_m: float
    false_together: float
    again_m: float
    false_again: float
    seed: int


def one_run(names: tuple[str, ...], length_m: float, seed: int) -> list[WearerRun]:
    """The rows of these names for the teams of one seed."""
    rows: list[WearerRun] = []
    for building, make in BUILDINGS.items():
        hows = [name.split("/")[1] for name in names if name.startswith(f"{building}/")]
        if not hows:
            continue
        plan, begin = make()
        apart = team_walks(plan, begin, length_m, seed) if set(hows) != {"door"} else None
        alone: dict[str, tuple[list[list[Estimate]], list[list[Estimate]]]] = {}
        for how in hows:
            walks = apart if apart and how != "door" else team_walks(plan, begin, length_m, seed, at_door=True)
            if how == "beacons":
                walks = with_dropped_beacons(walks, seed)
            kind = "wrong" if how in ("tap", "radio") else how
            begins = [_told(walks, begin, kind, seed), *walks.starts[1:]]
            if kind not in alone:
                alone[kind] = track_team(walks, begins, None, seed), track_team(walks, begins, None, seed + OTHER_DRAWS)
            together = track_team(walks, begins, HOWS[how], seed)
            rows += [_row(f"{building}/{how}", walks, k, [alone[kind][0][k], together[k], alone[kind][1][k]], seed)
                     for k in range(WEARERS) if not (how == "liar" and k == LIAR)]  # fmt: skip
    return rows


def _told(walks: TeamWalks, begin: RoutePlace, kind: str, seed: int) -> Pose | Start:
    """The start that is given to the first wearer's tracker."""
    true = walks.starts[FIRST]
    if kind not in ("wrong", "door", "beacons"):
        return Start() if kind == "unknown" else true
    rng = np.random.default_rng([seed, 78])
    for _ in range(TRIES):
        x, y, _pause, z = (*random_tour(walks.plan, begin, 1.0, rng, anywhere=True)[0], 0.0, 0.0)[:4]
        level = int(np.abs([k.height_m - z for k in walks.plan.levels]).argmin())
        if math.hypot(x - true.x_m, y - true.y_m) > WRONG_M:
            return Pose(x, y, rng.uniform(-math.pi, math.pi), level)
    raise EchostepError(f"plan {walks.plan.name}: no place is {WRONG_M:g} m from the start")


def _row(name: str, walks: TeamWalks, who: int, runs: Sequence[Sequence[Estimate]], seed: int) -> WearerRun:
    """Errors of one wearer's tracker alone, together, and alone with other random numbers."""
    errors, false = [], []
    for estimates in runs:
        error = errors_m(walks, who, estimates)
        sure = np.array([e.status is TrackStatus.TRACKING for e in estimates])
        errors.append(float(error.mean()))
        false.append(float((sure & (error > FALSE_TRACKING_M)).mean()))
    return WearerRun(
        name=name, wearer=who, meetings=sum(who in e.who for e in walks.encounters), alone_m=errors[0], false_alone=false[0],
        together_m=errors[1], false_together=false[1], again_m=errors[2], false_again=false[2], seed=seed,
    )  # fmt: skip


def errors_m(walks: TeamWalks, who: int, estimates: Sequence[Estimate]) -> Floats:
    """Errors (n,) of a wearer's estimates."""
    true = true_places(walks.truth[who], np.array([e.t_s for e in estimates]), walks.plan)
    places = np.array([(e.x_m, e.y_m) for e in estimates]).reshape(-1, 2)
    return judgement.errors_m(places, np.array([e.level for e in estimates], np.int64), true)


def _summary(rows: Sequence[WearerRun]) -> Row:
    """One row of all runs of a name."""
    parts = {"first": [r for r in rows if r.wearer == FIRST], "others": [r for r in rows if r.wearer != FIRST]}
    mean = means(rows, ("meetings", "alone_m", "together_m", "false_alone", "false_together"))
    for part, wearers in parts.items():
        mean |= {f"{part}_{key}": value for key, value in means(wearers, ("alone_m", "together_m")).items()}
    ratios = {
        "ratio": mean["together_m"] / mean["alone_m"], "worst": max(r.together_m / r.alone_m for r in parts["others"]),
        "by_chance": max(r.again_m / r.alone_m for r in parts["others"]),
    }  # fmt: skip
    rounded = {key: round(value, 4) for key, value in (mean | ratios).items()}
    return {"name": rows[0].name, "runs": len({r.seed for r in rows}), **rounded}


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    shown = [{k: 100.0 * v if k.startswith("false") else v for k, v in row.items()} for row in rows]
    notes = [
        f"Asked: ratio at most {ASKED_RATIO} where one start is wrong, worst at most {ASKED_WORST}: "
        + ", ".join(f"{row['name']} {_met(row)}" for row in rows if not row["name"].endswith("liar")) + ".",
        "meetings: of each wearer. first: the wearer whose start is wrong or unknown. worst: of the others, in one run. Simulated.",
    ]  # fmt: skip
    return [Table(f"Five wearers, each alone and with meetings: {request.runs} teams a row", shown, COLUMNS, notes)]


def _met(row: Row) -> str:
    return "met" if row["ratio"] <= ASKED_RATIO and row["worst"] <= ASKED_WORST else "not met"


def team_study(rows: str = "*", length_m: float = LENGTH_M) -> Study[WearerRun, Row]:
    """The study of the rows whose names match a pattern."""
    names = matching(ROWS, rows)
    return Study("team", (WearerRun,), partial(one_run, names, length_m), by_name(_summary), _tables)
