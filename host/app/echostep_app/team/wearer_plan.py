# SPDX-License-Identifier: MIT
"""`--plan wearer:NAME`: the plan that another wearer's walk has drawn, from the team's broker, as a file beside the recording.

In: the option as given, a broker. Out: the path of a plan file, with which a replay has the same plan. Owns the subscription while it waits. Files
are named by their content, so none is replaced and one drawing has one file.
"""

from __future__ import annotations

import hashlib
import os
import queue
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from echostep.errors import EchostepError
from echostep.file_mode import claim
from echostep.plan import Plan
from echostep_app.plan.places.refusals import refusals
from echostep_app.printing.lines import as_error, put_aside
from echostep_app.team.endpoint import Endpoint
from echostep_app.team.inbox import ListenerThread
from echostep_app.team.messages.report import checked_name
from echostep_app.team.messages.shared_drawings import MOST_BYTES, checked_drawing, drawing_topic

PREFIX = "wearer:"
WAIT_S = 60.0  # for a drawing: the other wearer may just have set out
DIGITS = 16  # of the SHA-256, in the name of the file
PrintLine = Callable[[str], None]


def drawing_wearer(plan: Path | None) -> str | None:
    """The name in `--plan wearer:NAME`; None for a file or no plan. Raises EchostepError for a name that cannot be."""
    given = "" if plan is None else str(plan)
    return checked_name(f"--plan {PREFIX}", given.removeprefix(PREFIX)) if given.startswith(PREFIX) else None


def plan_file(
    plan: Path | None, broker: Endpoint | None, team: str, folder: Path, print_line: PrintLine
) -> Path | None:
    """The file of `--plan`; a teammate's drawing is waited for and written into `folder` first. `team`: `+` for any."""
    name = drawing_wearer(plan)
    if name is None:
        return plan
    if broker is None:
        raise EchostepError(f"--plan {PREFIX}{name} needs the team's broker, mqtt://HOST: a run names it by --publish")
    print_line(f"Waiting for {name}'s drawing from {broker}, at most {WAIT_S:.0f} s")
    payload, drawn = _fetched(broker, name, team, print_line)
    path = _kept(payload, name, folder)
    print_line(f"{_described(drawn)}: {path}")
    for sentence in refusals(drawn):
        print_line(sentence)
    return path


def _fetched(broker: Endpoint, name: str, team: str, print_line: PrintLine) -> tuple[bytes, Plan]:
    """The first drawing that can be used; what cannot is told once, and a newer one is waited for. Raises EchostepError after WAIT_S."""
    from echostep_app.team.mqtt.publisher import Listener

    newest = queue.Queue[bytes](maxsize=1)  # of a flood one drawing waits
    listener = Listener(
        broker, [drawing_topic(team, name)], lambda *message: _put(newest, message[1]), MOST_BYTES + 1024
    )
    receiver = ListenerThread(listener, lambda text: print_line(f"{broker}: {text}"))
    end_s, unused = time.monotonic() + WAIT_S, ""
    try:
        while (left_s := end_s - time.monotonic()) > 0.0:
            payload = newest.get(timeout=left_s)
            try:
                return payload, checked_drawing(payload)
            except EchostepError as error:
                if not unused:
                    print_line(f"{name}'s drawing on {broker} is not used, waiting for another: {error}")
                unused = str(error)
    except queue.Empty:
        pass
    finally:
        receiver.close()
    if unused:
        raise EchostepError(f"--plan {PREFIX}{name}: the drawing on {broker} is not used: {unused}")
    raise EchostepError(
        f"--plan {PREFIX}{name}: no drawing came from {broker} in {WAIT_S:.0f} s: "
        f"does {name} walk without a plan, and publish to this broker as this team?"
    )


def _put(newest: queue.Queue[bytes], payload: bytes) -> None:
    """Put a payload in the place of the one before; an empty one is what a broker sends when it was told to forget."""
    if payload:
        with suppress(queue.Empty):
            newest.get_nowait()
        newest.put_nowait(payload)


def _kept(payload: bytes, name: str, folder: Path) -> Path:
    """The file of a drawing, written unless it is there; another content is put aside. Raises EchostepError when it cannot be written."""
    letters = "".join(c if c.isalnum() or c in "-_" else "_" for c in name)
    path = folder / f"drawing-{letters}-{hashlib.sha256(payload).hexdigest()[:DIGITS]}.json"
    with as_error(f"{path}: cannot write the drawing"):
        folder.mkdir(parents=True, exist_ok=True)
        if path.is_file() and path.read_bytes() == payload:
            return path
        if os.path.lexists(path):
            put_aside(path, "the drawing is written anew")
        part = path.with_suffix(".part")
        claim(part).write_bytes(payload)
        part.replace(path)
    return path


def _described(plan: Plan) -> str:
    """A drawing in words."""
    sd = "" if plan.uncertainty_m is None else f", to {100.0 * plan.uncertainty_m:.0f} cm (1 sd)"
    storeys = f" on {len(plan.levels)} storeys" if len(plan.levels) > 1 else ""
    return f"{plan.name}: {sum(len(level.heard) for level in plan.levels)} walls{storeys}{sd}{_doubt(plan)}"


def _doubt(plan: Plan) -> str:
    """How many of its walls are doubtful."""
    doubtful = sum(len(level.doubtful) for level in plan.levels if not level.is_refused)
    return f"; {doubtful} of them are doubtful" if doubtful else ""
