# SPDX-License-Identifier: MIT
"""Imports a file in a process of its own, with limits on time and memory.

In: a path, and hints. Out: `Plan`, `ImportReport`. Owns the process. Importers use large libraries (ezdxf, GEOS, a parser of STEP) that a
hostile file can keep busy for hours or crash. Here this ends in one error, and Ctrl-C ends it at once.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from echostep.errors import EchostepError
from echostep.plan import Plan, load_plan, parse_plan
from echostep_app.plan.importers.formats import import_plan, is_foreign
from echostep_app.plan.importers.report import Hints, ImportReport
from echostep_app.plan.writer import plan_json

# Assumed: ten times the need of the largest plan that was tried.
LONGEST_S = 300.0
MOST_MEMORY = 4 << 30  # bytes of address space
MOST_OUTPUT = 1 << 28  # characters of a plan
REFUSED = 3  # exit status of the process when it names what is wrong with the file
CHILD = "from echostep_app.plan.importers.limited import main; main()"


def open_limited(path: Path | str) -> Plan:
    """Read plan.json, or import another format without hints in a process with limits; doubts about an import go to stderr."""
    path = Path(path)
    if not is_foreign(path):
        return load_plan(path)
    try:
        plan, report = import_reported(path)
    except EchostepError as error:  # other commands have no options for it
        hint = f"make a plan of it with echostep plan import {path} -o plan.json --"
        raise EchostepError(str(error).replace("give --", hint)) from error
    for doubt in report.doubts:
        print(f"{path}: note: {doubt}", file=sys.stderr)
    return plan


def import_limited(path: Path, hints: Hints | None = None, above: Sequence[Path] = ()) -> Plan:
    """As `formats.import_plan`; raises EchostepError also when the file needs more than the limits."""
    return import_reported(path, hints, above)[0]


def import_reported(path: Path, hints: Hints | None = None, above: Sequence[Path] = ()) -> tuple[Plan, ImportReport]:
    """As `import_limited`, with the importer's report."""
    request = json.dumps([str(path), asdict(hints or Hints()), [str(file) for file in above]])
    with subprocess.Popen(
        [sys.executable, "-c", CHILD],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
    ) as child:
        try:
            out, err = child.communicate(request, LONGEST_S)
        except subprocess.TimeoutExpired as error:
            raise EchostepError(
                f"{path}: the import takes longer than {LONGEST_S:.0f} s: export one building only"
            ) from error
        finally:
            child.kill()
            child.wait()
    if child.returncode == REFUSED:
        raise EchostepError(err.strip())
    if child.returncode or len(out) > MOST_OUTPUT:
        reason = err.strip().splitlines()[-1][:200] if err.strip() else f"status {child.returncode}"
        raise EchostepError(
            f"{path}: the import failed, or needs more than {MOST_MEMORY >> 30} GiB of memory ({reason}): export one building only"
        )
    report, _, plan = out.partition("\n")
    return parse_plan(plan.encode()), ImportReport(**json.loads(report))


def main() -> None:
    """The process: read the request, import, write the report (one line) and the plan."""
    path, hints, above = json.load(sys.stdin)
    _limit_memory()
    try:
        report = ImportReport()
        plan = import_plan(Path(path), Hints(**hints), [Path(file) for file in above], report)
        sys.stdout.buffer.write(f"{json.dumps(asdict(report))}\n{plan_json(plan)}".encode())
    except EchostepError as error:
        print(error, file=sys.stderr)
        sys.exit(REFUSED)
    except KeyboardInterrupt:
        sys.exit(1)


def _limit_memory() -> None:
    """Limit the address space, where the operating system can."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    except (ImportError, ValueError, OSError):
        pass
