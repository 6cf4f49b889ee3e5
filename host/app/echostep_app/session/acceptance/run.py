# SPDX-License-Identifier: MIT
"""`echostep acceptance`: the guided walk, live, and the page of it.

In: a protocol, ports. Out: plan, recording, track and page in one folder. Owns what is called simulated: a board behind a pseudo terminal.
"""

from __future__ import annotations

import io
import os
import sys
from functools import partial
from pathlib import Path
from typing import TextIO

from echostep.walk.recorded import SIMULATED
from echostep_app.printing.console import console
from echostep_app.printing.lines import as_error
from echostep_app.session.acceptance.guide import Guide
from echostep_app.session.acceptance.page import write_page
from echostep_app.session.acceptance.protocol import Protocol
from echostep_app.session.options import OutputOptions, PortOptions, TrackingOptions
from echostep_app.session.results import output_folder
from echostep_app.session.runs.live import live

PLAN_NAME = "acceptance-plan.json"
PSEUDO_TERMINALS = "/dev/pts/"  # of Linux [pts(4)]: no board has one


def acceptance(
    protocol: Protocol, rounds: int, ports: PortOptions, output: OutputOptions, settings: Path | None = None
) -> list[str]:
    """Guide the walk, record and track it, and write its page; returns the lines about it."""
    plan_path = output_folder(output.folder) / PLAN_NAME
    with as_error(f"{plan_path}: cannot write the plan", "; give another folder with --out"):
        plan_path.write_text(protocol.plan_text, encoding="utf-8")
    tracking = TrackingOptions(plan_path, settings_path=settings, seed=0)
    fields = {"note": "acceptance walk"}
    if _is_simulated(ports):
        fields |= {"note": "acceptance walk, simulated: a port is a pseudo terminal", "source": SIMULATED}
    guide = Guide(protocol, rounds, _lines(), partial(console.print, markup=False, highlight=False), fields)
    return write_page(live(tracking, ports, output, guide))


def _lines() -> TextIO:
    """What is typed; bytes that are no text are lines, too, and there may be no input at all."""
    if isinstance(sys.stdin, io.TextIOWrapper):
        sys.stdin.reconfigure(errors="replace")
    return sys.stdin or io.StringIO()


def _is_simulated(ports: PortOptions) -> bool:
    """Whether a port is a pseudo terminal, as the twin's."""
    given = (ports.board, ports.mtx, ports.foot)
    return any(os.path.realpath(port).startswith(PSEUDO_TERMINALS) for port in given if port is not None)
