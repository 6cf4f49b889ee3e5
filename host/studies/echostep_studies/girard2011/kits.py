# SPDX-License-Identifier: MIT
"""`echostep evaluate kits`: the 52 steps of Girard with the rangers and the feet of either kit; the kit of 2026 was not built yet.

In: seeds. Out: rows: errors and coverage of the paper's filter and of the default one with each kind of ranger, on the same steps.
Everything here is simulated: building, walker, sensors. In the rows of the rangers the foot is the same; `kit_feet` has those of the feet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

from echostep.board.messages import Part, Schedule
from echostep.echoes.likelihood import EchoSettings
from echostep.echoes.rangers import ECHO_OF
from echostep_app.output.table import Table
from echostep_simulation.devices.srf02 import HALF_US
from echostep_simulation.world.acoustics import MAXSONAR, PULSE_RANGER, SRF02, Acoustics
from echostep_studies.frame.report import Row, as_dicts, by_name
from echostep_studies.frame.study import Study, StudyRequest
from echostep_studies.girard2011 import kit_feet
from echostep_studies.girard2011.kit_feet import PROFILE
from echostep_studies.girard2011.study import COLUMNS, MethodRun, default, girard, method_run, summarize
from echostep_studies.papers.girard2011 import GirardSettings
from echostep_studies.simulation.marker_walk import MarkerWalk, lay_markers, walk_markers
from echostep_studies.simulation.sites import SimulatedSite, furnished, otb

PULSE_CONE_RAD = math.radians(30.0)  # [HC-SR04 user guide: best within 30 degrees]
MAXSONAR_CONE_RAD = math.radians(45.0)  # -6 dB each way of the piston in `acoustics`
MAXSONAR_HALF_S = 0.05  # [firmware/ranger.h]


@dataclass(frozen=True, slots=True)
class RangerKind:
    """One kind of ranger: how it hears, the settings of the two filters that fit it, and half its period between pings."""

    acoustics: Acoustics
    echo: EchoSettings
    girard: GirardSettings
    half_s: float = HALF_US[Schedule.CONCURRENT] * 1e-6


@cache
def kinds() -> dict[str, RangerKind]:
    """The kinds of rangers by the names of their rows; `pulse, as SRF02` is a pulse ranger with the settings of the SRF02."""
    echo, maxsonar = ECHO_OF[Part.PULSE], ECHO_OF[Part.MAXSONAR]
    paper = GirardSettings()
    narrow = replace(paper, aperture_rad=PULSE_CONE_RAD, maximum_m=echo.maximum_m)
    far = replace(paper, aperture_rad=MAXSONAR_CONE_RAD, maximum_m=maxsonar.maximum_m)
    return {
        "SRF02": RangerKind(SRF02, EchoSettings(), paper),
        "pulse": RangerKind(PULSE_RANGER, echo, narrow),
        "MaxSonar": RangerKind(MAXSONAR, maxsonar, far, MAXSONAR_HALF_S),
        "pulse, as SRF02": RangerKind(PULSE_RANGER, EchoSettings(), paper),
    }


def one_run(seed: int) -> list[MethodRun]:
    """Both filters with each kind of ranger on the paper's site, and the default filter among furniture."""
    rows: list[MethodRun] = []
    for name, kind in kinds().items():
        for site, ours in ((otb(), "default"), (furnished(seed), "default, furniture")):
            walk = _walk(site, seed, kind)
            outputs = {f"{ours}, {name}": default(site, walk, seed, kind.echo)}
            if ours == "default":
                outputs = {f"paper's filter, {name}": girard(site, walk, seed, settings=kind.girard)} | outputs
            rows += [method_run(row, PROFILE, seed, walk, seen) for row, seen in outputs.items()]
    return rows + kit_feet.rows(seed)


def _walk(site: SimulatedSite, seed: int, kind: RangerKind) -> MarkerWalk:
    return walk_markers(lay_markers(site.route), site.built, seed, site.passers, None, kind.acoustics, kind.half_s)


def _tables(rows: list[Row], request: StudyRequest) -> list[Table]:
    title = f"Position error in metres by kind of ranger, and of the foot alone, {request.runs} simulated runs; only SRF02 and MTx were ever worn"
    return [Table(title, as_dicts(sorted(rows, key=lambda row: row["name"].split(", ")[:-1])), COLUMNS)]


STUDY = Study("kits", (MethodRun,), one_run, by_name(summarize), _tables)
