# SPDX-License-Identifier: MIT
"""The study `team`: errors of five wearers, each alone and with its meetings.

In: seeds. Out: rows `office/tap`, `tower/radio`, ... Owns the conditions. Simulated.

All but the first wearer know their starts; the first is told a wrong one (`door`: all begin side by side, as teams go in; `tap`, `radio`: all begin
apart; `beacons`: the same, each drops beacons, hears those of all and shares its own) or none (`unknown`, apart), or knows its own too and reports
false places (`liar`: that wearer is left out of all columns). `drawing`: the first one walks without a plan, from a known start, then the others
from theirs: `alone` without a plan, `together` on its drawing; the first one is left out. `ratio`: mean error of all wearers and runs together over
that alone. `worst`: the greatest such ratio of one wearer in one run, the first one left out; `by_chance`: the same of the trackers alone with other
random numbers, over those alone: how much of `worst` means nothing. An error on a wrong floor is at least a storey.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fnmatch import fnmatch
from functools import partial

import numpy as np

from echostep.arrays import Floats
from echostep.errors import EchostepError
from echostep.localization.estimate import Estimate, TrackStatus
from echostep.localization.particles.start import Start
from echostep.output.table import Table
from echostep.plan.model import NO_PLAN, Plan, Pose, load_plan
from echostep.plan.routing import RoutePlace
from echostep_studies.anywhere import judgement, sites
from echostep_studies.anywhere.judgement import FALSE_TRACKING_M, Truth, true_levels
from echostep_studies.anywhere.tours import random_tour
from echostep_studies.anywhere.walks import T, X, Y, Z
from echostep_studies.frame.report import Row, rows_by_name
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.simulation.tower import tower
from echostep_studies.team.beacons import with_dropped_beacons
from echostep_studies.team.drawings import drawing_by, track_on
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


def _office() -> Building:
    return load_plan(sites.OFFICE_PLAN), sites.OFFICE_DOOR


def _tower() -> Building:
    return tower(sites.STOREYS), sites.LOBBY


BUILDINGS: dict[str, Callable[[], Building]] = {"office": _office, "tower": _tower}
DRAWING = "office/drawing"  # of one storey: a drawing's storeys are not those of the plan
ROWS = (*(f"{building}/{how}" for building in BUILDINGS for how in HOWS), DRAWING)


def one_run(names: tuple[str, ...], length_m: float, seed: int) -> list[Row]:
    """The rows of these names for the teams of one seed."""
    rows: list[Row] = []
    for building, make in BUILDINGS.items():
        hows = [name.split("/")[1] for name in names if name.startswith(f"{building}/") and name != DRAWING]
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
            told = [_told(walks, begin, kind, seed), *walks.starts[1:]]
            if kind not in alone:
                alone[kind] = track_team(walks, told, None, seed), track_team(walks, told, None, seed + OTHER_DRAWS)
            together = track_team(walks, told, HOWS[how], seed)
            rows += [_row(f"{building}/{how}", walks, k, [alone[kind][0][k], together[k], alone[kind][1][k]]) | {"seed": seed}
                     for k in range(WEARERS) if not (how == "liar" and k == LIAR)]  # fmt: skip
    return rows + (_drawing_rows(length_m, seed) if DRAWING in names else [])


def _drawing_rows(length_m: float, seed: int) -> list[Row]:
    """The row DRAWING of the team of one seed."""
    walks = team_walks(*_office(), length_m, seed, at_door=True)
    drawn, rows = drawing_by(walks, FIRST), []
    for who in range(FIRST + 1, WEARERS):
        alone, again = (track_on(NO_PLAN, walks, who, seed + more) for more in (0, OTHER_DRAWS))
        runs = [alone, track_on(drawn, walks, who, seed), again]
        rows.append(_row(DRAWING, walks, who, runs) | {"seed": seed, "meetings": 0})
    return rows


def _told(walks: TeamWalks, begin: RoutePlace, kind: str, seed: int) -> Pose | Start:
    """The start that the first wearer's tracker is told."""
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


def _row(name: str, walks: TeamWalks, who: int, runs: Sequence[Sequence[Estimate]]) -> Row:
    """Errors of one wearer's tracker alone, together, and alone with other random numbers."""
    row: Row = {"name": name, "wearer": who, "meetings": sum(who in e.who for e in walks.encounters)}
    for key, estimates in zip(("alone", "together", "again"), runs, strict=True):
        error = errors_m(walks, who, estimates)
        sure = np.array([e.status is TrackStatus.TRACKING for e in estimates])
        row |= {f"{key}_m": float(error.mean()), f"false_{key}": float((sure & (error > FALSE_TRACKING_M)).mean())}
    return row


def errors_m(walks: TeamWalks, who: int, estimates: Sequence[Estimate]) -> Floats:
    """Errors (n,) of a wearer's estimates."""
    truth = walks.truth[who]
    t_s = np.array([e.t_s for e in estimates])
    x, y, z = (np.interp(t_s, truth[:, T], truth[:, k]) for k in (X, Y, Z))
    place = np.column_stack([x, y])
    true = Truth(place, true_levels(place, z, walks.plan))
    places = np.array([(e.x_m, e.y_m) for e in estimates]).reshape(-1, 2)
    return judgement.errors_m(places, np.array([e.level for e in estimates], np.int64), true)


def _summary(rows: Sequence[Row]) -> Row:
    """One row of all runs of a name."""
    first, others = ([r for r in rows if (r["wearer"] == FIRST) is is_first] for is_first in (True, False))
    found: Row = {"name": rows[0]["name"], "runs": len({r["seed"] for r in rows})}
    found["meetings"] = float(np.mean([r["meetings"] for r in rows]))
    for prefix, group in (("", rows), ("first_", first), ("others_", others)):
        for key in ("alone_m", "together_m"):
            found[prefix + key] = float(np.mean([r[key] for r in group])) if group else None
    found["ratio"] = found["together_m"] / found["alone_m"]
    found["worst"] = max(r["together_m"] / r["alone_m"] for r in others)
    found["by_chance"] = max(r["again_m"] / r["alone_m"] for r in others)
    for key in ("false_alone", "false_together"):
        found[key] = float(np.mean([r[key] for r in rows]))
    return {key: round(value, 4) if isinstance(value, float) else value for key, value in found.items()}


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


def team_study(rows: str = "*", length_m: float = LENGTH_M) -> Study:
    """The study of the rows whose names match a pattern."""
    names = tuple(name for name in ROWS if fnmatch(name, rows))
    if not names:
        raise EchostepError(f"--rows {rows}: no row is named so; there are: {', '.join(ROWS)}")
    return Study(
        "team",
        partial(one_run, names, length_m),
        lambda rows: [_summary(group) for group in rows_by_name(rows)],
        _tables,
    )
