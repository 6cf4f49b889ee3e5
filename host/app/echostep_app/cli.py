# SPDX-License-Identifier: MIT
"""The command line: `echostep demo | live | record | replay | map | score | foot | legs | doctor | flash | calibrate | decode` and more.

In: the command's arguments and options. Out: files, views, an exit status (0: done; 1: done, but a recording lacks something; 2: a
mistake, named in one line). Owns nothing.
The commands are declared in `commands/`. Modules that are slow to import are imported inside the command that needs them, so that `--help` answers
at once.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
import typer.core

from echostep.errors import INSTEAD, EchostepError, IncompleteError, has_left, words_of
from echostep.file_mode import share_files
from echostep.kernel_cache import on_compiling
from echostep_app.commands import files, hardware, plan, recordings, runs
from echostep_app.extras import EXTRAS, lacks
from echostep_app.interruption import end_by_signals, is_asked
from echostep_app.printing.lines import complain, say
from echostep_app.printing.people import lost_result, to_people

LOST_KERNEL = "no compiled object"  # numba's words where a signal's exception was dropped in a callback of LLVM, while a kernel was compiled
STUDIES = "echostep_app.commands"  # entry points of the commands of the studies, a distribution of their own
MISSING = "The studies are a package of their own: pip install echostep-studies."


class _Missing(typer.core.TyperGroup):
    """A group of commands that are not there: any name of one raises EchostepError."""

    def get_command(self, *_: Any) -> NoReturn:
        raise EchostepError(f"{self.name}: {MISSING}")


def add_studies(to: typer.Typer) -> None:
    """Add the commands of `echostep-studies`; without it, a group of which each raises EchostepError."""
    missing = typer.Typer(cls=_Missing, no_args_is_help=True, help=MISSING, callback=lambda: None)
    studies = {entry.name: entry.load() for entry in entry_points(group=STUDIES)}
    to.add_typer(studies.get("evaluate", missing), name="evaluate")


app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Indoor pedestrian tracking.",
)
for nameless in (runs, files, hardware, recordings):
    app.add_typer(nameless.app)
add_studies(app)
app.add_typer(hardware.beacons_app, name="beacons")
app.add_typer(plan.app, name="plan")


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        from echostep.board.messages import SCHEMA_HASH

        say(f"echostep {version('echostep')}, protocol 0x{SCHEMA_HASH:08X}")
        raise typer.Exit


@app.callback()
def options(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and end."),
    ] = False,
    share: Annotated[
        bool, typer.Option("--share", help="Recordings and tracks may be read by other users, as the umask allows.")
    ] = False,
) -> None:
    """Indoor pedestrian tracking."""
    share_files(wanted=share)


def main() -> None:
    """Entry point: a mistake ends with one line and status 2; signals end a run after its files are written."""
    end_by_signals()
    on_compiling[:] = [tell_of_compiling]
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # where its cache lies, for a user without a home
    with to_people():
        status = _status()
        if not status and (lost := lost_result()):
            complain(f"echostep: {lost}: what was printed is not whole")
            status = 2
    sys.exit(status)


def tell_of_compiling() -> None:
    """A line for the first kernel that is compiled where nothing counts them (`kernel_parts`)."""
    on_compiling.clear()
    if sys.stderr is not None and sys.stderr.isatty():
        complain("echostep: kernels are compiled, once on this computer: it takes about a minute")


def _status() -> int:
    """The exit status of the command, which is run."""
    try:
        if words := former_use(sys.argv[1:]) or piped(sys.argv[1:]):
            raise EchostepError(words)
        app()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except EchostepError as error:
        complain(f"echostep: {words_of(error)}")
        return 1 if isinstance(error, IncompleteError) else 2
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS or not (words := lacks("this", package)):
            raise
        complain(f"echostep: {words}")
        return 2
    except OSError as error:
        complain(f"echostep: {words_of(error)}")
        return 2
    except (KeyboardInterrupt, RuntimeError) as error:
        if isinstance(error, RuntimeError) and not (is_asked() and LOST_KERNEL in str(error)):
            raise
        return 130
    return 0


def former_use(words: Sequence[str]) -> str:
    """The sentence about the first former use in the words of a command line, without the program's name; empty where there is none."""
    given = (word.replace("=", " ", 1) if word.startswith("--") else word for word in words if word != "--share")
    line = f" {' '.join(given)} "
    return next((has_left(use) for use in INSTEAD if _is_used(use, line)), "")


def piped(words: Sequence[str]) -> str:
    """The sentence about the first pipe in place of a file, which commands read several times; empty where there is none."""
    with suppress(OSError):  # a word that can be no name of a file
        if pipe := next((word for word in words if word == "-" or Path(word).is_fifo()), ""):
            return f"{pipe}: a pipe cannot be read twice: write it to a file, and give that"
    return ""


def _is_used(use: str, line: str) -> bool:
    if use.endswith((":", "/")):
        return f" {use}" in line
    command, _, option = use.partition(" --")
    return line.startswith(f" {command} ") and (not option or f" --{option} " in line)
