# SPDX-License-Identifier: MIT
"""`echostep calibrate`: biases of the gyros, mounting, compass and leg scale, and the accelerometers, written as settings.

In: the board's port, while the wearer rests, turns and walks as asked; for the accelerometers both boards' ports, while the parts lie still.
Out: a settings file (TOML) for `--settings`, whose other sections are kept. Owns the instructions to the wearer; `probe` reads the ports,
`fitting` and `poses` compute the values.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from rich.console import Console

from echostep.board.calibration import GYROS
from echostep.errors import EchostepError
from echostep.file_mode import keep_earlier
from echostep.ports.chunks import BOARD
from echostep.settings import Settings, parse_settings, read_settings
from echostep_app.board.faults.health import Severity, board_findings
from echostep_app.commissioning.fitting import Fit, Values, doubt, fit_compass, fit_gyros, fit_legs, fit_mounting
from echostep_app.commissioning.poses import described, measure_poses
from echostep_app.commissioning.probe import ProbeResult, probe
from echostep_app.commissioning.serial_ports import access_findings, find_boards, list_seen
from echostep_app.offline.leg_track import checked_lengths
from echostep_app.printing.lines import as_error, write_whole
from echostep_app.printing.progress import progress_line

STILL_S, TURN_S, WALK_S = 10.0, 20.0, 20.0  # duration of each measurement
POSE_S = 3.0  # of a board in each pose: a second passes before it sends all axes, the mean of 200 samples is known to 0.003 m/s2
ACCELEROMETERS = "accelerometers"  # only when asked for: the boxes have to be taken off
WALKED_RANGE_M = (3.0, 100.0)  # of --walked: shorter walks have too few strides


Sections = dict[str, dict[str, Any]]  # of a settings file


class Ports(NamedTuple):
    """Ports of the belt board and of a foot board; those that are None are searched for."""

    board: str | None = None
    foot: str | None = None


@dataclass(frozen=True, slots=True)
class Wearer:
    """Lengths of the wearer's leg, hip to knee and knee to ankle, and of the walk that calibrates the legs."""

    thigh_m: float | None
    shank_m: float | None
    walked_m: float


@dataclass(frozen=True, slots=True)
class Calibration:
    """One calibration: instruction to the wearer, duration, and the fit by known settings. Parts with equal instructions share one measurement."""

    name: str
    request: str
    seconds: float
    fit: Callable[[ProbeResult, Settings, Wearer], Fit]


_TURN = "Turn: once round on the spot, slowly, and a little further."
PARTS = (
    Calibration(
        "gyros",
        "Gyros: stand still, or lay everything on a table.",
        STILL_S,
        lambda probed, _known, _wearer: fit_gyros(probed),
    ),
    Calibration("mounting", _TURN, TURN_S, lambda probed, known, _wearer: fit_mounting(probed, known)),
    Calibration("compass", _TURN, TURN_S, lambda probed, known, _wearer: fit_compass(probed, known)),
    Calibration(
        "legs",
        "Legs: stand for two seconds, walk {walked_m:g} m straight on, and stand again.",
        WALK_S,
        lambda probed, known, wearer: fit_legs(
            probed, known.gyro, checked_lengths(wearer.thigh_m, wearer.shank_m), wearer.walked_m
        ),
    ),
)


def calibrate(ports: Ports, names: list[str], wearer: Wearer, out: Path, console: Console) -> None:
    """Instruct, measure, fit and write, part by part; raises EchostepError with the remedy. Parts finished before it are kept."""
    parts = _chosen_parts(names)
    _check_wearer(wearer)
    ports = Ports(*find_boards(list_seen(), ports.board, ports.foot))
    if ports.board is None and (parts or ports.foot is None):
        raise EchostepError("no board is plugged in: plug it in, or name its port with --board; see echostep doctor")
    for finding in [f for port in ports if port is not None for f in access_findings("board", port)]:
        raise EchostepError(str(finding))
    sections = read_sections(out)
    if ACCELEROMETERS in names:
        _calibrate_accelerometers([port for port in ports if port is not None], out, sections, console)
    for request, group in groupby(parts, key=lambda part: part.request):
        console.print(request.format(walked_m=wearer.walked_m))
        seconds = next(group).seconds
        _wait(console)
        probed = _probe(str(ports.board), seconds, f"Listening for {seconds:g} s")
        _check_gyros(probed)
        for part in (part for part in parts if part.request == request):
            known = parse_settings(_text(sections), str(out))  # with what this calibration has just written
            values_of_section, line = part.fit(probed, known, wearer)
            console.print(line)
            _check_usual(values_of_section, console)
            for section, values in values_of_section.items():
                sections.setdefault(section, {}).update(values)
            write_sections(out, sections)
    console.print(f"{out}: use it with --settings {out}")


def _calibrate_accelerometers(ports: list[str], out: Path, sections: Sections, console: Console) -> None:
    """The errors of all six-axis parts, into the sections and the file."""

    def listen(text: str) -> list[ProbeResult]:
        _wait(console)
        return [_probe(port, POSE_S, text) for port in ports]

    for place, errors in measure_poses(listen, console).items():
        console.print(described(place, errors))
        sections[f"{place}_imu"] = asdict(errors)
    write_sections(out, sections)


def _chosen_parts(names: list[str]) -> list[Calibration]:
    """The parts that are worn; all of them without a name."""
    known = [part.name for part in PARTS]
    for name in names:
        if name not in [*known, ACCELEROMETERS]:
            raise EchostepError(f"{name}: cannot be calibrated; choose from {', '.join([*known, ACCELEROMETERS])}")
    return [part for part in PARTS if part.name in (names or known)]


def _check_wearer(wearer: Wearer) -> None:
    checked_lengths(wearer.thigh_m, wearer.shank_m)
    if not WALKED_RANGE_M[0] <= wearer.walked_m <= WALKED_RANGE_M[1]:
        raise EchostepError(
            f"--walked {wearer.walked_m:g}: expected {WALKED_RANGE_M[0]:g} to {WALKED_RANGE_M[1]:g} m, best 10"
        )


def _wait(console: Console) -> None:
    if sys.stdin.isatty():
        console.input("Press Enter to begin. ")


def _check_usual(values: dict[str, Values], console: Console) -> None:
    """Improbable values are written only after a `y` on the terminal; without a terminal or that answer, raises EchostepError."""
    words = doubt(values)
    if words and not (sys.stdin.isatty() and console.input(f"{words}. Write it all the same? [y/N] ").lower() == "y"):
        raise EchostepError(f"{words}; nothing was written of it")


def _probe(port: str, seconds: float, text: str) -> ProbeResult:
    """The `ProbeResult` of the board at this port; `text` is shown meanwhile."""
    with progress_line(text):
        probed = probe({BOARD: port}, seconds)
    if probed.stale_firmware:
        raise EchostepError(probed.stale_firmware)
    if probed.reports.identity is None:
        raise EchostepError(f"{port}: the board does not answer: run echostep doctor")
    return probed


def _check_gyros(probed: ProbeResult) -> None:
    faults = [f for f in board_findings(probed.reports) if f.severity is Severity.FAULT and "gyro" in f.subject]
    if len(faults) == len(GYROS):
        raise EchostepError(str(faults[0]))


def read_sections(out: Path) -> Sections:
    """Sections of an existing settings file; empty without a file."""
    if not out.exists():
        return {}
    text = read_settings(out)
    parse_settings(text, str(out))
    return tomllib.loads(text)


def _text(sections: Sections) -> str:
    """The sections as TOML."""
    lines = ["# Settings of echostep, with the results of echostep calibrate."]
    for name, values in sections.items():
        lines += ["", f"[{name}]"]
        lines += [
            f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}" for key, value in values.items()
        ]
    return "\n".join(lines) + "\n"


def write_sections(out: Path, sections: Sections) -> None:
    """Write a settings file; raises EchostepError for values that no settings can have, and for a file that cannot be written."""
    text = _text(sections)
    parse_settings(text, str(out))
    with as_error(f"{out}: cannot write the settings"):
        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(keep_earlier(out), text.encode())
