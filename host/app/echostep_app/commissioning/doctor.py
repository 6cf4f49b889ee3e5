# SPDX-License-Identifier: MIT
"""`echostep doctor`: checks the ports, the boards and the MTx, and prints each fault with its remedy.

In: ports by name, or those found on this computer. Out: a report as text. Owns nothing.
"""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from echostep.board.messages import Schedule
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, FOOT, MTX
from echostep_app.board.faults.health import Severity
from echostep_app.commissioning.diagnosis import Diagnosis, judge_board, judge_mtx
from echostep_app.commissioning.foot_diagnosis import judge_foot_board
from echostep_app.commissioning.probe import ProbeResult, probe
from echostep_app.commissioning.serial_ports import (
    MTX_NAME,
    PortSeen,
    Role,
    access_findings,
    find,
    find_boards,
    holder_findings,
    latency_findings,
    list_seen,
    rules_findings,
    rules_text,
)
from echostep_app.printing.console import console_for_people
from echostep_app.printing.progress import progress_line
from echostep_app.recording.device import sender, wrong_device

PROBE_S = 6.0
STYLES = {Severity.NOTE: "cyan", Severity.WARNING: "yellow", Severity.FAULT: "bold red"}

__all__ = ["examine", "rules_text", "run"]


def run(
    board: str | None, mtx: str | None, seconds: float, foot: str | None = None, *, electrical: bool = False
) -> bool:
    """Check everything and print the report; returns whether there is no warning and no fault."""
    console = console_for_people(highlight=False)
    with progress_line(f"Looking at the ports and listening for {seconds:g} s: stand still"):
        report = examine(board, mtx, seconds, foot, electrical=electrical)
    print_report(report, console)
    return report.fine


def examine(
    board: str | None,
    mtx: str | None,
    seconds: float = PROBE_S,
    foot: str | None = None,
    *,
    electrical: bool = False,
    schedule: Schedule | None = None,
) -> Diagnosis:
    """Check everything; ports that are None are searched for. `electrical`: also the levels of the boards' inputs; `schedule`: of the pings."""
    report = Diagnosis(electrical=electrical)
    seen = list_seen()
    report.lines += [f"port      {port.name}: {port.role.value} ({port.text})" for port in seen]
    board, foot = find_boards(seen, board, foot)
    ports = {BOARD: board, MTX: mtx or find(seen, Role.MTX, MTX_NAME), FOOT: foot}
    usable = {name: port for name, port in ports.items() if port is not None and _usable(report, name, port)}
    if ports[BOARD] is None:
        _judge_no_board(report, seen)
    if ports[MTX] is None and foot is None:
        what = "neither an MTx nor a foot board is plugged in: only the legs can be tracked"
        report.add(Severity.NOTE, "MTx", what, "plug it in, or name its port with --mtx or --foot")
    _judge_several_boards(report, seen, board, foot)
    at_ankle = usable.pop(FOOT, None)
    if usable:
        _probe_devices(report, usable, seconds, schedule)
    if at_ankle is not None and (probed := _probed(report, "foot board", {BOARD: at_ankle}, seconds)) is not None:
        judge_foot_board(report, probed, at_ankle)
    report.findings += rules_findings()
    report.findings.sort(key=lambda finding: -finding.severity)
    return report


def _usable(report: Diagnosis, name: str, port: str) -> bool:
    subject = {BOARD: "board", MTX: "MTx", FOOT: "foot board"}[name]
    no_access = access_findings(subject, port)
    report.findings += no_access or holder_findings(subject, port)
    if name == MTX and not no_access:
        report.findings += latency_findings(subject, port)
    return not no_access


def _judge_no_board(report: Diagnosis, seen: list[PortSeen]) -> None:
    blank = next((port for port in seen if port.role in (Role.BOOTLOADER, Role.SKETCH)), None)
    what = "no sensor board is plugged in" if seen else "no sensor board is plugged in, and no other serial port"
    remedy = "plug it in with a USB cable that carries data, not only power; or name its port with --board"
    if blank is not None:
        what, remedy = (
            f"{blank.path} is a {blank.role.value}",
            f"write the firmware: echostep flash --port {blank.path}",
        )
    report.add(Severity.FAULT, "board", what, remedy)


def _judge_several_boards(report: Diagnosis, seen: list[PortSeen], *chosen: str | None) -> None:
    boards = [port.name for port in seen if port.role is Role.BOARD]
    examined = [path for path in chosen if path is not None]
    if len(boards) > max(len(examined), 1):
        what = f"{len(boards)} boards are plugged in ({'; '.join(boards)}); this report is on {' and '.join(examined)}"
        report.add(Severity.NOTE, "board", what, "name the other one with --board")


def _probe_devices(report: Diagnosis, ports: dict[str, str], seconds: float, schedule: Schedule | None) -> None:
    probed = _probed(report, "ports", ports, seconds, check_gyros=True, schedule=schedule)
    if probed is None:
        return
    devices = {name: sender(probed.first_bytes.get(name, b"")) for name in ports}
    if wrong := [(name, device) for name, device in devices.items() if device is not None and device != name]:
        what, _, remedy = wrong_device(*wrong[0], ports).partition(": ")
        report.add(Severity.FAULT, "ports", what, remedy)
        return
    if BOARD in ports:
        judge_board(report, probed, ports[BOARD])
    if MTX in ports:
        judge_mtx(report, probed, with_board=BOARD in ports)


def _probed(
    report: Diagnosis, subject: str, ports: dict[str, str], seconds: float, *,
    check_gyros: bool = False, schedule: Schedule | None = None,
) -> ProbeResult | None:  # fmt: skip
    """What `probe` reads, with its notices as findings; None, with a finding, where a port cannot be opened."""
    try:
        probed = probe(ports, seconds, check_gyros=check_gyros, schedule=schedule)
    except EchostepError as error:
        what, _, remedy = str(error).partition("; ")
        report.add(Severity.FAULT, subject, what, remedy or "unplug it and plug it in again")
        return None
    for notice in probed.notices:
        report.add(Severity.WARNING, subject, notice, "check the cable and its plugs")
    return probed


def print_report(report: Diagnosis, console: Console) -> None:
    """Print the facts, then the findings with their remedies, the most severe first."""
    for line in report.lines:
        console.print(Text(line))
    for finding in report.findings:
        console.print(
            Text.assemble(
                (f"{finding.severity.name:8}", STYLES[finding.severity]), f"  {finding.subject}: {finding.what}"
            )
        )
        console.print(Text(f"          {finding.remedy}", style="dim"))
    count = sum(finding.severity > Severity.NOTE for finding in report.findings)
    console.print("Everything is fine." if not count else f"{count} finding{'s' if count > 1 else ''} to look after.")
