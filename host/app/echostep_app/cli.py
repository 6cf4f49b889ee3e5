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
from typing import Annotated

import typer

from echostep.errors import EchostepError, IncompleteError, words_of
from echostep.file_mode import share_files
from echostep_app.commands import beacons, commander, files, hardware, plan, recordings, runs
from echostep_app.commands.former import former_use, piped
from echostep_app.commands.studies import add_studies
from echostep_app.extras import EXTRAS, lacks
from echostep_app.interruption import end_by_signals, is_asked
from echostep_app.printing.compiling import tell_of_compiling
from echostep_app.printing.lines import complain, say
from echostep_app.printing.people import lost_result, to_people

LOST_KERNEL = "no compiled object"  # numba's words where a signal's exception was dropped in a callback of LLVM, while a kernel was compiled

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Indoor pedestrian tracking.",
)
for nameless in (runs, files, commander, hardware, recordings):
    app.add_typer(nameless.app)
add_studies(app)
for name, group in {"beacons": beacons, "plan": plan}.items():
    app.add_typer(group.app, name=name)


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
    tell_of_compiling()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # where its cache lies, for a user without a home
    with to_people():
        status = _status()
        if not status and (lost := lost_result()):
            complain(f"echostep: {lost}: what was printed is not whole")
            status = 2
    sys.exit(status)


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
