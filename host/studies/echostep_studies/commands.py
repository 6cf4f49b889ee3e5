# SPDX-License-Identifier: MIT
"""`echostep evaluate ...`: one command a study. Heavy imports wait until a command runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="The papers' experiments and ours, with figures and plots.")

Seed = Annotated[int, typer.Option("--seed", help="Seed of the first run; run k has this plus k.", min=0)]
Json = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the rows there.")]
Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for plots, journal and Parquet.")]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", metavar="ADDRESS", help="Run on this Dask cluster, not on this machine.")
]
WestportData = Annotated[
    Path | None, typer.Option("--data", metavar="DIR", help="Folder of the public recordings, for westport-house.")
]


@app.callback()
def evaluate() -> None:
    """The papers' experiments and ours, with figures and plots."""


@app.command()
def girard2011(
    runs: Annotated[int, typer.Option("--runs", help="Walks to simulate.", min=1)] = 200,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/girard2011"),
    scheduler: Scheduler = None,
) -> None:
    """The 52 steps of Girard et al. 2011, their systems and ours, and what they could not handle (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.girard2011.study import STUDY

    run_study(STUDY, StudyRequest(runs, seed, json, out, scheduler))


@app.command()
def kits(
    runs: Annotated[int, typer.Option("--runs", help="Walks to simulate.", min=1)] = 100,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/kits"),
    scheduler: Scheduler = None,
) -> None:
    """The 52 steps of Girard et al. 2011 with each kind of ranger and of foot (simulated; only SRF02 and MTx were ever worn)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.girard2011.kits import STUDY

    run_study(STUDY, StudyRequest(runs, seed, json, out, scheduler))


@app.command()
def echoes(
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/echoes"),
    fit: Annotated[
        bool, typer.Option("--fit", help="Fit the likelihood's settings to simulated pings (minutes).")
    ] = False,
) -> None:
    """What simulated rangers hear, and how well the tracker's likelihood expects it."""
    from echostep_studies.echoes.study import echoes_study
    from echostep_studies.frame.study import StudyRequest, run_study

    run_study(echoes_study(fit=fit), StudyRequest(1, seed, json, out))


@app.command()
def incapacity(
    runs: Annotated[int, typer.Option("--runs", help="Wearers who cannot move.", min=1)] = 1000,
    days: Annotated[int, typer.Option("--days", help="Working days of eight hours.", min=0)] = 5,
    seed: Seed = 1,
    json: Json = None,
    data: Annotated[Path, typer.Option("--data", metavar="DIR", help="Folder of the public recordings.")] = Path(
        "../shared/data"
    ),
) -> None:
    """How soon a wearer who cannot move is told, and how often one who can (simulated; recordings where they are)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.incapacity.study import incapacity_study

    run_study(incapacity_study(days, data, seed), StudyRequest(runs, seed, json, Path("out/incapacity")))


@app.command()
def lee2010(
    runs: Annotated[int, typer.Option("--runs", help="People to simulate.", min=1)] = 100,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/lee2010"),
    scheduler: Scheduler = None,
) -> None:
    """The lap, the floors and the 3D track of Lee and Lee 2010, by their method and by ours (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.lee2010.study import STUDY

    run_study(STUDY, StudyRequest(runs, seed, json, out, scheduler))


@app.command()
def trails(
    runs: Annotated[int, typer.Option("--runs", help="Walks of each trail, each by another person.", min=1)] = 10,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/trails"),
    scheduler: Scheduler = None,
) -> None:
    """The trails of Fischer et al. 2008, by their dead reckoning and by ours (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.trails.study import STUDY

    run_study(STUDY, StudyRequest(runs, seed, json, out, scheduler))


@app.command("legs")
def legs_command(
    runs: Annotated[int, typer.Option("--runs", help="People to simulate.", min=1)] = 100,
    seed: Seed = 1,
    folder: Annotated[
        Path | None, typer.Option("--data", metavar="DIR", help="Real legs instead: folder of the public recordings.")
    ] = None,
    json: Json = None,
    out: Out = Path("out/legs"),
    scheduler: Scheduler = None,
) -> None:
    """Walks of 5 m by many simulated people, and what each fault of the sensors does; with --data, real legs against the feet."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.legs.people import STUDY
    from echostep_studies.legs.recordings import recordings_study

    study = STUDY if folder is None else recordings_study(folder)
    run_study(study, StudyRequest(runs if folder is None else 1, seed, json, out, scheduler))


@app.command()
def gaits(
    runs: Annotated[int, typer.Option("--runs", help="Courses in each manner.", min=1)] = 20,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/gaits"),
    scheduler: Scheduler = None,
) -> None:
    """Walking, hurrying, crawling, sidestepping, stairs and ladders, by the foot alone and by one leg alone (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.gaits.study import STUDY

    run_study(STUDY, StudyRequest(runs, seed, json, out, scheduler))


@app.command("floors")
def floors_command(
    runs: Annotated[int, typer.Option("--runs", help="Runs of 20 minutes.", min=1)] = 50,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/floors"),
    scheduler: Scheduler = None,
) -> None:
    """Floors by pressure under weather, doors and fans, by stairs and lift (simulated)."""
    from echostep_studies.floors.study import STUDY
    from echostep_studies.frame.study import StudyRequest, run_study

    run_study(STUDY, StudyRequest(runs, seed, json, out, scheduler))


@app.command("storeys")
def storeys_command(
    runs: Annotated[int, typer.Option("--runs", help="Walks through each building.", min=1)] = 10,
    seed: Seed = 1,
    folder: WestportData = None,
    json: Json = None,
    out: Out = Path("out/storeys"),
    scheduler: Scheduler = None,
) -> None:
    """Walks through all floors of a building by stairs and lift (simulated)."""
    from echostep_studies.floors.storeys import storeys_study
    from echostep_studies.frame.study import StudyRequest, run_study

    run_study(storeys_study(folder), StudyRequest(runs, seed, json, out, scheduler))


@app.command("feet")
def feet_command(
    folder: Annotated[Path, typer.Option("--data", metavar="DIR", help="Folder of the public recordings.")],
    json: Json = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Draw the tracks there.")] = None,
    left_out: Annotated[
        bool,
        typer.Option("--leave-one-out", help="Also with the constants that the other sets would choose (minutes)."),
    ] = False,
) -> None:
    """The foot on real recordings, one setting for all, beside the peers' figures."""
    from echostep_studies.feet.datasets import SETS
    from echostep_studies.feet.study import feet_study
    from echostep_studies.frame.recordings import recordings_in
    from echostep_studies.frame.study import StudyRequest, run_study

    recordings = recordings_in(folder, SETS)
    run_study(feet_study(recordings, out, left_out=left_out), StudyRequest(len(recordings), 0, json, out or Path()))


@app.command()
def fischer2008(
    runs: Annotated[int, typer.Option("--runs", help="Guided returns to simulate.", min=1)] = 1000,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/fischer2008"),
    scheduler: Scheduler = None,
) -> None:
    """The guided returns of Fischer et al. 2008: dead reckoning, their fusion and ours, and every sweep (simulated)."""
    from echostep_studies.fischer2008.study import fischer2008_study
    from echostep_studies.frame.study import StudyRequest, run_study

    run_study(fischer2008_study(runs, seed), StudyRequest(runs, seed, json, out, scheduler))


@app.command("anywhere")
def anywhere_command(
    runs: Annotated[int, typer.Option("--runs", help="Walks of each row.", min=1)] = 200,
    seed: Seed = 1,
    folder: WestportData = None,
    rows: Annotated[str, typer.Option("--rows", metavar="PATTERN", help="Only rows of such a name: 'kidnap/*'.")] = "*",
    json: Json = None,
    out: Out = Path("out/anywhere"),
    scheduler: Scheduler = None,
) -> None:
    """Wrong and unknown starts, kidnappings, wrong plans, poor echoes: found or not, and what is claimed (simulated)."""
    from echostep_studies.anywhere.study import anywhere_study
    from echostep_studies.frame.study import StudyRequest, run_study

    run_study(anywhere_study(folder, rows), StudyRequest(runs, seed, json, out, scheduler))


@app.command("operation")
def operation_command(
    runs: Annotated[int, typer.Option("--runs", help="Operations of twenty minutes.", min=1)] = 10,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/operation"),
    scheduler: Scheduler = None,
) -> None:
    """Three storeys in every manner of moving, a battery changed on the way, scored by ISO/IEC 18305 (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.operation.study import operation_study

    run_study(operation_study(), StudyRequest(runs, seed, json, out, scheduler))


@app.command("team")
def team_command(
    runs: Annotated[int, typer.Option("--runs", help="Teams of five wearers.", min=1)] = 10,
    seed: Seed = 1,
    rows: Annotated[str, typer.Option("--rows", metavar="PATTERN", help="Only rows of such a name: '*/tap'.")] = "*",
    json: Json = None,
    out: Out = Path("out/team"),
    scheduler: Scheduler = None,
) -> None:
    """Five wearers, one at a wrong start, each alone and told of its meetings by tap or radio range (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.team.study import team_study

    run_study(team_study(rows), StudyRequest(runs, seed, json, out, scheduler))


@app.command("clutter")
def clutter_command(
    folder: Annotated[Path, typer.Option("--data", metavar="DIR", help="Folder of CARMEN logs: *.log, *.log.gz.")],
    starts: Annotated[int, typer.Option("--starts", help="Unknown starts of each log.", min=0)] = 50,
    seed: Seed = 1,
    json: Json = None,
    out: Out = Path("out/clutter"),
    scheduler: Scheduler = None,
) -> None:
    """Laser scans of real buildings as pings: furniture, people and doors that the plan does not have."""
    from echostep_studies.clutter.study import clutter_study
    from echostep_studies.frame.study import StudyRequest, run_study

    study = clutter_study(folder, starts, seed)
    run_study(study, StudyRequest(len(study.seeds or ()), seed, json, out, scheduler))


@app.command("noplan")
def noplan_command(
    runs: Annotated[int, typer.Option("--runs", help="Walks of each row.", min=1)] = 50,
    seed: Seed = 1,
    folder: WestportData = None,
    rows: Annotated[str, typer.Option("--rows", metavar="PATTERN", help="Only rows of such a name: '*/10min'.")] = "*",
    json: Json = None,
    out: Out = Path("out/noplan"),
    scheduler: Scheduler = None,
) -> None:
    """Buildings drawn from a walk without a plan, beside FootSLAM; a second person on the drawing (simulated)."""
    from echostep_studies.frame.study import StudyRequest, run_study
    from echostep_studies.noplan.study import noplan_study

    request = StudyRequest(runs, seed, json, out, scheduler)
    run_study(noplan_study(folder, rows, request), request)
