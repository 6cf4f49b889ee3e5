# SPDX-License-Identifier: MIT
"""`echostep bench-report`: a new board's reports about itself, as one text file with lines for the measurements of firmware/bench.md.

In: ports by name, or those found on this computer. Out: the file. Owns the order of its parts, and the names of the measurements.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path

import numpy as np

from echostep.board.air import CELSIUS, USUAL_C, sound_m_s
from echostep.board.messages import GYROS_INVALID, Outcome, Ranger, Schedule
from echostep.errors import EchostepError
from echostep.file_mode import keep_earlier
from echostep_app.board.faults.findings import Finding, Severity
from echostep_app.commissioning.diagnosis import Diagnosis
from echostep_app.commissioning.doctor import examine
from echostep_app.commissioning.probe import ProbeResult
from echostep_app.printing.lines import as_error

MEASUREMENTS = (  # the headings of firmware/bench.md
    "Serial number",
    "D13 after the bootloader",
    "Supply and brown-out",
    "Current",
    "Idle MISO",
    "Rise of the level shifters",
    "Leg cables",
    "Compass cable",
    "Pulse ranger",
    "Ranges, and echoes of the other ranger",
    "Data-ready of the foot's part",
    "SRF02",
    "MaxSonar",
    "ADIS16100",
    "Temperature of an ADIS16100",
)


def write(board: str | None, foot: str | None, seconds: float, out: Path, schedule: Schedule | None = None) -> str:
    """Examine the boards, while the rangers fire by `schedule`, and write the report; returns its path and the next step in words."""
    report = examine(board, None, seconds, foot, electrical=True, schedule=schedule)
    if not report.probed:
        raise EchostepError(str(report.findings[0]) if report.findings else "no board has answered")
    with as_error(f"cannot write {out}"):
        keep_earlier(out).write_text("\n".join(text(report)) + "\n", encoding="utf-8")
    return f"{out}: fill in the lines of the measurements (firmware/bench.md) and send it in"


def text(report: Diagnosis) -> Iterable[str]:
    """The lines of the file."""
    yield f"echostep {version('echostep')} on {sys.platform}, Python {sys.version.split()[0]}"
    yield "\n[doctor]"
    yield from report.lines
    yield from (f"{finding.severity.name:8}  {finding}" for finding in report.findings)
    for subject, probed in report.probed.items():
        yield from (f"{finding.severity.name:8}  {finding}" for finding in _unrest(subject, probed))
    for subject, probed in report.probed.items():
        yield f"\n[{subject}]"
        yield from _reports(probed)
        yield from _ranges(probed)
        yield from _noise(probed)
    yield "\n[measurements]"
    yield from (f"{number:2}. {name}: " for number, name in enumerate(MEASUREMENTS, 1))


def _reports(probed: ProbeResult) -> Iterable[str]:
    """The newest of each report of the board, field by field."""
    r = probed.reports
    newest = (
        r.identity,
        r.configuration,
        r.status,
        r.board_health,
        r.parts,
        r.electrical,
        r.loop,
        r.foot,
        *r.gyros.values(),
    )
    for message in newest:
        if message is not None:
            yield f"{type(message).__name__}: " + ", ".join(f"{k} {v}" for k, v in message._asdict().items())


def _ranges(probed: ProbeResult) -> Iterable[str]:
    celsius = CELSIUS * float(np.median([p.temperature for p in probed.pressures])) if probed.pressures else USUAL_C
    for ranger in Ranger:
        pings = [p for p in probed.pings if p.ranger == ranger]
        flights_us = [p.time_of_flight_us for p in pings if p.outcome == Outcome.ECHO]
        if flights_us:
            metres = np.array(flights_us) * 0.5e-6 * sound_m_s(celsius)
            yield (
                f"{ranger.name.lower()}: {len(flights_us)} echoes in {len(pings)} pings, median {np.median(metres):.3f} m "
                f"({np.median(flights_us):.0f} us) at {celsius:.1f} degC, sd {metres.std():.3f} m"
            )
        elif pings:
            yield f"{ranger.name.lower()}: no echo in {len(pings)} pings"


REST_SD_COUNTS = 4.0  # 1 deg/s: eight times the noise of an ADIS16100 [data sheet: 0.5 counts in 40 Hz]; assumed


def _unrest(subject: str, probed: ProbeResult) -> list[Finding]:
    """Findings on gyros whose rates vary more than a board at rest explains: wrong bits, or a board that was moved."""
    noisy = [line.partition(":")[0] for line in _noise(probed) if float(line.rpartition("sd ")[2]) > REST_SD_COUNTS]
    what = f"{', '.join(noisy)}: the rates vary by more than {REST_SD_COUNTS:g} counts at rest"
    remedy = "lay the board down and repeat; if it stays, the SPI wires are too long (measurement 7)"
    return [Finding(Severity.WARNING, subject, what, remedy)] if noisy else []


def _noise(probed: ProbeResult) -> Iterable[str]:
    for name in ("thigh", "calf", "belt"):
        counts = [v for g in probed.gyros if (v := getattr(g, name)) != GYROS_INVALID]
        if counts:
            yield f"{name}: {len(counts)} rates, mean {np.mean(counts):.2f} counts, sd {np.std(counts):.2f}"
