# SPDX-License-Identifier: MIT
"""`echostep calibrate`: biases of the gyros, mounting, compass and leg scale, measured in a minute and written as settings.

In: the board's port, while the wearer stands still, turns and walks as asked. Out: a settings file (TOML) for `--settings`, whose other sections
are kept. Owns the instructions to the wearer; `probe` reads the port, `fitting` computes the values.
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
from echostep.commissioning.fitting import Fit, fit_compass, fit_gyros, fit_legs, fit_mounting
from echostep.commissioning.listening_bar import listening_bar
from echostep.commissioning.probe import ProbeResult, probe
from echostep.commissioning.serial_ports import BOARD_NAME, Role, access_findings, find, list_seen
from echostep.errors import EchostepError
from echostep.offline.leg_lengths import checked_lengths
from echostep.ports.chunks import BOARD
from echostep.settings import parse_settings, read_settings

STILL_S, TURN_S, WALK_S = 10.0, 20.0, 20.0  # duration of each measurement
WALKED_RANGE_M = (3.0, 100.0)  # of --walked; by reason: shorter walks have too few strides


@dataclass(frozen=True, slots=True)
class Wearer:
    """Lengths of the wearer's leg, hip to knee and knee to ankle, and of the walk that calibrates the legs."""

    thigh_m: float
    shank_m: float
    walked_m: float


@dataclass(frozen=True, slots=True)
class Part:
    """One calibration: instruction to the wearer, duration, and the fit. Parts with equal instructions share one measurement."""

    name: str
    request: str
    seconds: float
    fit: Callable[[ProbeResult, GyroSettings, Wearer], Fit]


_TURN = "Turn: once round on the spot, slowly, and a little further."
PARTS = (
    Part(
        "gyros",
        "Gyros: stand still, or lay everything on a table.",
        STILL_S,
        lambda probed, _gyro, _wearer: fit_gyros(probed),
    ),
    Part("mounting", _TURN, TURN_S, lambda probed, gyro, _wearer: fit_mounting(probed, gyro)),
    Part("compass", _TURN, TURN_S, lambda probed, gyro, _wearer: fit_compass(probed, gyro)),
    Part(
        "legs",
        "Legs: stand for two seconds, walk {walked_m:g} m straight on, and stand again.",
        WALK_S,
        lambda probed, gyro, wearer: fit_legs(
            probed, gyro, checked_lengths(wearer.thigh_m, wearer.shank_m), wearer.walked_m
        ),
    ),
)


def calibrate(port: str | None, names: list[str], wearer: Wearer, out: Path, console: Console) -> None:
    """Instruct, measure, fit and write, part by part; raises EchostepError with what to repeat. Parts finished before it are kept."""
    parts = _chosen_parts(names)
    _check_wearer(wearer)
    board_port = port or find(list_seen(), Role.BOARD, BOARD_NAME)
    if board_port is None:
        raise EchostepError("no board is plugged in: plug it in, or name its port with --board; see echostep doctor")
    for finding in access_findings("board", board_port):
        raise EchostepError(str(finding))
    sections = _sections(out)
    for request, group in groupby(parts, key=lambda part: part.request):
        console.print(request.format(walked_m=wearer.walked_m))
        probed = _probe(board_port, next(group).seconds, console)
        for part in (part for part in parts if part.request == request):
            values_of_section, line = part.fit(probed, _known_gyros(sections), wearer)
            console.print(line)
            for section, values in values_of_section.items():
                sections.setdefault(section, {}).update(values)
            _write(out, sections)
    console.print(f"{out}: use it with --settings {out}")


def _chosen_parts(names: list[str]) -> list[Part]:
    known = [part.name for part in PARTS]
    for name in names:
        if name not in known:
            raise EchostepError(f"{name}: cannot be calibrated; choose from {', '.join(known)}")
    return [part for part in PARTS if part.name in (names or known)]


def _check_wearer(wearer: Wearer) -> None:
    checked_lengths(wearer.thigh_m, wearer.shank_m)
    if not WALKED_RANGE_M[0] <= wearer.walked_m <= WALKED_RANGE_M[1]:
        raise EchostepError(
            f"--walked {wearer.walked_m:g}: expected {WALKED_RANGE_M[0]:g} to {WALKED_RANGE_M[1]:g} m, best 10"
        )


def _probe(port: str, seconds: float, console: Console) -> ProbeResult:
    if sys.stdin.isatty():
        console.input("Press Enter to begin. ")
    with listening_bar(f"Listening for {seconds:g} s", seconds, console):
        probed = probe({BOARD: port}, seconds)
    _check(probed, port)
    return probed


def _known_gyros(sections: dict[str, dict[str, Any]]) -> GyroSettings:
    """Gyro settings of the file, with those that this calibration has just written."""
    return GyroSettings(**sections.get("gyro", {}))


def _check(probed: ProbeResult, port: str) -> None:
    if probed.stale_firmware:
        raise EchostepError(probed.stale_firmware)
    if probed.reports.identity is None:
        raise EchostepError(f"{port}: the board does not answer: run echostep doctor")
    faults = [f for f in board_findings(probed.reports) if f.severity is Severity.FAULT and "gyro" in f.subject]
    if len(faults) == len(GYROS):
        raise EchostepError(str(faults[0]))


def _sections(out: Path) -> dict[str, dict[str, Any]]:
    """Sections of an existing settings file; empty without a file."""
    if not out.exists():
        return {}
    text = read_settings(out)
    parse_settings(text, str(out))
    return tomllib.loads(text)


def _write(out: Path, sections: dict[str, dict[str, Any]]) -> None:
    lines = ["# Settings of echostep, with the results of echostep calibrate."]
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
