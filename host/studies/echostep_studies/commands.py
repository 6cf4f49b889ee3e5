# SPDX-License-Identifier: MIT
"""`echostep evaluate ...`: one table of commands, one row a study. Heavy imports wait until a command runs.

In: nothing. Out: `app`, the commands. Owns the names of the studies, their options and defaults.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
import typer.core

from echostep_app.commands.options import out_option

if TYPE_CHECKING:
    from echostep_studies.frame.study import Study, StudyRequest

PAPERS, OURS, REAL = "The papers' experiments, simulated", "Ours, simulated", "Real recordings and files (--data)"


class InGroups(typer.core.TyperGroup):
    """Lists the studies in their groups, each with its whole help, its number of runs, and how long they take."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 (called by typer)
        """Written by --help below the options."""
        for group in (PAPERS, OURS, REAL):
            with formatter.section(group):
                formatter.write_dl([(row.name, row.described) for row in STUDIES if row.group == group])


app = typer.Typer(
    cls=InGroups,
    no_args_is_help=True,
    help="The papers' experiments and ours, with figures and plots. "
    "The number of runs is the default of --runs, and the duration is theirs, as an order of magnitude on two cores (November 2026), "
    "without the minutes in which the kernels are compiled once. A look takes --runs 2, and a bar shows the "
    "time that remains.",
)

Lasts = Literal["seconds", "minutes", "half an hour", "an hour", "hours"]
Options = tuple[Parameter, ...]
Given = dict[str, Any]  # values of the options by name


def _option(
    name: str, kind: Any, default: Any, words: str, metavar: str | None = None, least: int | None = None
) -> Parameter:
    declared = typer.Option(f"--{name.replace('_', '-')}", help=words, metavar=metavar, min=least)
    declared = out_option("DIR", words) if name == "out" else declared
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, declared])


def _runs(default: int, words: str) -> Parameter:
    return _option("runs", int, default, words, least=1)


def _data(words: str, default: Any = None) -> Parameter:
    return _option("data", Path | None if default is None else Path, default, words, "DIR")


def _rows(example: str, more: str = "") -> Parameter:
    return _option("rows", str, "*", f"Only rows of such a name: '{example}'.{more}", "PATTERN")


def _out(name: str) -> Parameter:
    return _option("out", Path, Path("out") / name, "Folder for plots, journal and Parquet.", "DIR")


SEED = _option("seed", int, 1, "Seed of the first run; run k has this plus k.", least=0)
JSON = _option("json", Path | None, None, "Write the rows there.", "FILE")
SCHEDULER = _option("scheduler", str | None, None, "Run on this Dask cluster, not on this machine.", "ADDRESS")
WESTPORT = _data("Folder of the public recordings, for westport-house.")


def _usual(name: str, runs: int, words: str, *own: Parameter) -> Options:
    """The options of a study of seeded runs, with its own ones in between."""
    return _runs(runs, words), SEED, *own, JSON, _out(name), SCHEDULER


@dataclass(frozen=True, slots=True)
class StudyCommand:
    """One row: `help`, how long the default runs take, the options in the order of --help, and what makes the study of a request and the options.

    The study is imported then.
    """

    name: str
    group: str
    help: str
    lasts: Lasts
    options: Options
    study: Callable[[StudyRequest, Given], Study[Any, Any]]

    @property
    def described(self) -> str:
        """Its help, how many runs it makes by default, and how long they take."""
        runs = [f"{option.default} runs: {self.lasts}" for option in self.options if option.name == "runs"]
        return f"{self.help} {runs[0] if runs else self.lasts.capitalize()}."


def _of(module: str) -> Any:
    """A module of the studies, imported when a command runs."""
    return import_module(f"echostep_studies.{module}")


STUDIES = (
    StudyCommand(
        "girard2011",
        PAPERS,
        "The 52 steps of Girard et al. 2011, their systems and ours, and what they could not handle (simulated).",
        "minutes",
        _usual("girard2011", 200, "Walks to simulate."),
        lambda _request, _given: _of("girard2011.study").STUDY,
    ),
    StudyCommand(
        "kits",
        OURS,
        "The 52 steps of Girard et al. 2011 with each kind of ranger and of foot (simulated; only SRF02 and MTx were ever worn).",
        "minutes",
        _usual("kits", 100, "Walks to simulate."),
        lambda _request, _given: _of("girard2011.kits").STUDY,
    ),
    StudyCommand(
        "echoes",
        OURS,
        "Echoes of simulated rangers, and how well the tracker's likelihood predicts them.",
        "seconds",
        (
            SEED, JSON, _out("echoes"), _option("fit", bool, False, "Fit the likelihood's settings to simulated pings (minutes)."),
            _option("sweeps", Path | None, None, "Measured sweeps instead: walls.csv, and CSV files of pings by pose and bearing.", "DIR"),
        ),
        lambda _request, given: _of("echoes.study").echoes_study(fit=given["fit"], sweeps=given["sweeps"]),
    ),
    StudyCommand(
        "incapacity",
        OURS,
        "Delay of the alarm for an incapacitated wearer, and rate of false alarms (simulated; recordings where they are).",
        "an hour",
        (
            _runs(1000, "Wearers who cannot move."), _option("days", int, 5, "Working days of eight hours.", least=0), SEED, JSON,
            _data("Folder of the public recordings; without it $ECHOSTEP_DATA, or ../shared/data."),
        ),
        lambda request, given: _of("incapacity.study").incapacity_study(given["days"], given["data"], request.seed),
    ),
    StudyCommand(
        "legs",
        PAPERS,
        "Legs and feet in every manner of moving, and the walks of Lee and Lee 2010 (simulated); with --data, real legs against the feet.",
        "an hour",
        _usual(
            "legs", 100, "People to simulate.", _data("Real legs instead: folder of the public recordings."),
            _rows("lap/*", " The paper's: 'lap/*', 'storeys*', 'floors'."),
        ),
        lambda _request, given: (
            _of("legs.recordings").recordings_study(given["data"]) if given["data"] else _of("legs.study").legs_study(given["rows"])
        ),
    ),
    StudyCommand(
        "floors",
        OURS,
        "Floors by pressure under weather, doors and fans, by stairs and lift (simulated).",
        "minutes",
        _usual("floors", 50, "Runs of 20 minutes."),
        lambda _request, _given: _of("floors.study").STUDY,
    ),
    StudyCommand(
        "storeys",
        OURS,
        "Walks through all floors of a building by stairs and lift (simulated).",
        "half an hour",
        _usual("storeys", 10, "Walks through each building.", WESTPORT),
        lambda _request, given: _of("floors.storeys").storeys_study(given["data"]),
    ),
    StudyCommand(
        "feet",
        REAL,
        "The foot on real recordings, one setting for all, beside the peers' figures.",
        "minutes",
        (
            _data("Folder of the public recordings.", Parameter.empty), JSON,
            _option("out", Path | None, None, "Draw the tracks there.", "DIR"),
            _option("leave_one_out", bool, False, "Also with the constants that the other sets would choose (minutes)."),
        ),
        lambda _request, given: _of("feet.study").feet_study(given["data"], given["out"], left_out=given["leave_one_out"]),
    ),
    StudyCommand(
        "fischer2008",
        PAPERS,
        "The guided returns of Fischer et al. 2008: dead reckoning, their fusion and ours, and every sweep (simulated).",
        "minutes",
        _usual("fischer2008", 1000, "Guided returns to simulate."),
        lambda request, _given: _of("fischer2008.study").fischer2008_study(request.runs, request.seed),
    ),
    StudyCommand(
        "anywhere",
        OURS,
        "Wrong and unknown starts, kidnappings, wrong plans, poor echoes: found or not, and what is claimed (simulated).",
        "an hour",
        _usual("anywhere", 200, "Walks of each row.", WESTPORT, _rows("kidnap/*", " Those of the peer: '*/amcl'.")),
        lambda _request, given: _of("anywhere.study").anywhere_study(given["data"], given["rows"]),
    ),
    StudyCommand(
        "simple",
        OURS,
        "Known starts in corridors, rooms, a flat and a hall, with the small faults of a first day (simulated).",
        "minutes",
        _usual("simple", 20, "Walks of each row.", _rows("corridor-20*")),
        lambda _request, given: _of("simple.study").simple_study(given["rows"]),
    ),
    StudyCommand(
        "doubt",
        OURS,
        "A sensor that lies, a wearer who is carried or pushed, rangers that die: for how long it is still called tracking (simulated).",
        "minutes",
        _usual("doubt", 20, "Walks of each row.", _rows("carried*")),
        lambda _request, given: _of("doubt.study").doubt_study(given["rows"]),
    ),
    StudyCommand(
        "operation",
        OURS,
        "Three storeys in every manner of moving, a battery changed on the way, scored by ISO/IEC 18305 (simulated).",
        "half an hour",
        _usual("operation", 10, "Operations of twenty minutes."),
        lambda _request, _given: _of("operation.study").operation_study(),
    ),
    StudyCommand(
        "team",
        OURS,
        "Five wearers, one at a wrong start, each alone and told of its meetings by tap or radio range (simulated).",
        "an hour",
        _usual("team", 10, "Teams of five wearers.", _rows("*/tap")),
        lambda _request, given: _of("team.study").team_study(given["rows"]),
    ),
    StudyCommand(
        "clutter",
        REAL,
        "Laser scans of real buildings as pings: furniture, people and doors that the plan does not have.",
        "half an hour",
        (
            _data("Folder of CARMEN logs: *.log, *.log.gz.", Parameter.empty),
            _option("starts", int, 50, "Unknown starts of each log.", least=0), SEED, JSON, _out("clutter"), SCHEDULER,
        ),
        lambda request, given: _of("clutter.study").clutter_study(given["data"], given["starts"], request.seed),
    ),
    StudyCommand(
        "importers",
        REAL,
        "Drawings, models and maps of a folder, imported without options: time, sizes, counts, doors in gaps, enclosed rooms.",
        "minutes",
        (_data("Folder of DXF, IFC, IMDF, OpenStreetMap or ROS files, searched with its folders.", Parameter.empty), JSON),
        lambda _request, given: _of("importers.study").importers_study(given["data"]),
    ),
    StudyCommand(
        "noplan",
        OURS,
        "Buildings drawn from a walk without a plan, beside FootSLAM; the trails of Fischer et al. 2008 (simulated).",
        "hours",
        _usual("noplan", 50, "Walks of each row.", WESTPORT, _rows("*/10min", " The paper's: 'trail/*'.")),
        lambda request, given: _of("noplan.study").noplan_study(given["data"], given["rows"], request),
    ),
)  # fmt: skip


@app.callback()
def evaluate() -> None:
    """The papers' experiments and ours, with figures and plots."""


def _add(row: StudyCommand) -> None:
    """Make the command of a row."""

    def command(**given: Any) -> None:
        from echostep_studies.frame.study import StudyRequest, run_study

        out = given.get("out") or Path("out") / row.name
        request = StudyRequest(given.get("runs", 1), given.get("seed", 0), given["json"], out, given.get("scheduler"))
        run_study(row.study(request, given), request)

    command.__signature__ = Signature(row.options)  # type: ignore[attr-defined]  # typer reads the options there
    command.__annotations__ = {option.name: option.annotation for option in row.options}
    command.__doc__ = row.help
    app.command(row.name)(command)


for _row in STUDIES:
    _add(_row)
