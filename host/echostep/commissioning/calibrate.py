"""`echostep calibrate`: the wearer's gyros, mounting, compass and legs, measured in a minute and written as settings.

In: the board's port, and a wearer who stands still, turns and walks when asked. Out: a settings file (TOML) for `--settings`, whose other sections
are kept. Owns the questions; the port is listened to by `listening`, what it means is found by `fitting`.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.console import Console

from echostep.board.calibration import GYROS, GyroSettings
from echostep.board.health import Severity, board_findings
from echostep.commissioning.fitting import Found, find_compass, find_gyros, find_legs, find_mounting
from echostep.commissioning.probe import ProbeResult, listen
from echostep.commissioning.serial_ports import BOARD_NAME, Role, access_findings, find, list_seen
from echostep.errors import EchostepError
from echostep.offline.leg_csv import segments
from echostep.ports.chunks import BOARD
from echostep.settings import parse_settings, read_settings

STILL_S, TURN_S, WALK_S = 10.0, 20.0, 20.0
WALKED_M = (3.0, 100.0)


@dataclass(frozen=True, slots=True)
class Wearer:
    """What the wearer knows of himself: lengths from hip to knee and from knee to ankle, and the way that he will walk."""

    thigh_m: float
    shank_m: float
    walked_m: float


@dataclass(frozen=True, slots=True)
class Part:
    """One thing to calibrate: what the wearer does, for how long, and how it is found; equal requests are made once."""

    name: str
    request: str
    seconds: float
    find: Callable[[ProbeResult, GyroSettings, Wearer], Found]


_TURN = "Turn: once round on the spot, slowly, and a little further."
PARTS = (
    Part(
        "gyros",
        "Gyros: stand still, or lay everything on a table.",
        STILL_S,
        lambda heard, _gyro, _wearer: find_gyros(heard),
    ),
    Part("mounting", _TURN, TURN_S, lambda heard, gyro, _wearer: find_mounting(heard, gyro)),
    Part("compass", _TURN, TURN_S, lambda heard, gyro, _wearer: find_compass(heard, gyro)),
    Part(
        "legs",
        "Legs: stand for two seconds, walk {walked_m:g} m straight on, and stand again.",
        WALK_S,
        lambda heard, gyro, wearer: find_legs(heard, gyro, segments(wearer.thigh_m, wearer.shank_m), wearer.walked_m),
    ),
)


def calibrate(port: str | None, names: list[str], wearer: Wearer, out: Path, console: Console) -> None:
    """Ask, listen, find and write; raises EchostepError with what was wrong and what to do again. What was found before that is kept."""
    parts = _wanted(names)
    _believable(wearer)
    wanted = port or find(list_seen(), Role.BOARD, BOARD_NAME)
    if wanted is None:
        raise EchostepError("no board is plugged in: plug it in, or name its port with --board; see echostep doctor")
    for finding in access_findings("board", wanted):
        raise EchostepError(str(finding))
    sections = _sections(out)
    for request, group in groupby(parts, key=lambda part: part.request):
        console.print(request.format(walked_m=wearer.walked_m))
        heard = _listen(wanted, next(group).seconds, console)
        for part in (part for part in parts if part.request == request):
            found, line = part.find(heard, _known_gyros(sections), wearer)
            console.print(line)
            for section, values in found.items():
                sections.setdefault(section, {}).update(values)
            _write(out, sections)
    console.print(f"{out}: use it with --settings {out}")


def _wanted(names: list[str]) -> list[Part]:
    known = [part.name for part in PARTS]
    for name in names:
        if name not in known:
            raise EchostepError(f"{name}: there is nothing of that name to calibrate; there are {', '.join(known)}")
    return [part for part in PARTS if part.name in (names or known)]


def _believable(wearer: Wearer) -> None:
    segments(wearer.thigh_m, wearer.shank_m)
    if not WALKED_M[0] <= wearer.walked_m <= WALKED_M[1]:
        raise EchostepError(f"--walked {wearer.walked_m:g}: expected {WALKED_M[0]:g} to {WALKED_M[1]:g} m, best 10")


def _listen(port: str, seconds: float, console: Console) -> ProbeResult:
    if sys.stdin.isatty():
        console.input("Press Enter to begin. ")
    with console.status(f"Listening for {seconds:g} s."):
        heard = listen({BOARD: port}, seconds)
    _check(heard, port)
    return heard


def _known_gyros(sections: dict[str, dict[str, Any]]) -> GyroSettings:
    """The biases that the file holds, which this calibration may just have found."""
    return GyroSettings(**sections.get("gyro", {}))


def _check(heard: ProbeResult, port: str) -> None:
    if heard.stale:
        raise EchostepError(heard.stale)
    if heard.words.identity is None:
        raise EchostepError(f"{port}: no word of the board: run echostep doctor")
    faults = [f for f in board_findings(heard.words) if f.severity is Severity.FAULT and "gyro" in f.subject]
    if len(faults) == len(GYROS):
        raise EchostepError(str(faults[0]))


def _sections(out: Path) -> dict[str, dict[str, Any]]:
    """What the file holds already; nothing when there is none."""
    if not out.exists():
        return {}
    text = read_settings(out)
    parse_settings(text, str(out))
    return tomllib.loads(text)


def _write(out: Path, sections: dict[str, dict[str, Any]]) -> None:
    lines = ["# Settings of echostep, with what echostep calibrate found."]
    for name, values in sections.items():
        lines += ["", f"[{name}]"]
        lines += [
            f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}" for key, value in values.items()
        ]
    text = "\n".join(lines) + "\n"
    parse_settings(text, str(out))
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text(text)
    except OSError as error:
        raise EchostepError(f"{out}: cannot write the settings: {error.strerror}") from error
