"""`echostep doctor`: looks at the ports, the board and the MTx, and says what is wrong and what to do.

In: ports by name, or the ones that are found. Out: a report in words. Owns nothing of its own.
"""

from __future__ import annotations

from rich.console import Console
from rich.text import Text

from echostep.board.health import Finding, Severity
from echostep.commissioning.diagnosis import Diagnosis, judge_board, judge_mtx
from echostep.commissioning.probe import listen
from echostep.commissioning.serial_ports import (
    BOARD_NAME,
    MTX_NAME,
    PortSeen,
    Role,
    access_findings,
    find,
    holder_findings,
    latency_findings,
    list_seen,
    rules_findings,
    rules_text,
)
from echostep.errors import EchostepError
from echostep.ports.chunks import BOARD, MTX

SECONDS = 6.0
STYLES = {Severity.NOTE: "cyan", Severity.WARNING: "yellow", Severity.FAULT: "bold red"}

__all__ = ["examine", "rules_text", "run"]


def run(board: str | None, mtx: str | None, seconds: float) -> bool:
    """Look at everything and print it; whether all is fine."""
    console = Console(soft_wrap=True, highlight=False)
    with console.status("Looking at the ports and listening for some seconds: stand still."):
        report = examine(board, mtx, seconds)
    print_report(report, console)
    return report.fine


def examine(board: str | None, mtx: str | None, seconds: float = SECONDS) -> Diagnosis:
    """Look at everything; ports that are not named are searched for."""
    report = Diagnosis()
    seen = list_seen()
    report.lines += [f"port      {port.path}: {port.role.value} ({port.text})" for port in seen]
    wanted = {
        BOARD: board or find(seen, Role.BOARD, BOARD_NAME),
        MTX: mtx or find(seen, Role.MTX, MTX_NAME),
    }
    usable = {name: port for name, port in wanted.items() if port is not None and _usable(report, name, port)}
    if wanted[BOARD] is None:
        report.findings.append(_no_board(seen))
    if wanted[MTX] is None:
        report.findings.append(_no_mtx())
    report.findings += _several(seen, wanted[BOARD])
    if usable:
        _converse(report, usable, seconds)
    report.findings += rules_findings()
    report.findings.sort(key=lambda finding: -finding.severity)
    return report


def _usable(report: Diagnosis, name: str, port: str) -> bool:
    subject = "board" if name == BOARD else "MTx"
    found = access_findings(subject, port)
    report.findings += found or holder_findings(subject, port)
    if name == MTX and not found:
        report.findings += latency_findings(subject, port)
    return not found


def _no_board(seen: list[PortSeen]) -> Finding:
    waiting = next((port for port in seen if port.role in (Role.BOOTLOADER, Role.SKETCH)), None)
    if waiting is not None:
        what = f"{waiting.path} is a {waiting.role.value}"
        return Finding(Severity.FAULT, "board", what, f"write the firmware: echostep flash --port {waiting.path}")
    what = (
        "no sensor board is plugged in"
        if seen
        else "no sensor board is plugged in, nor anything else with a serial port"
    )
    remedy = "plug it in; a USB cable that only charges will not do; or name its port with --board"
    return Finding(Severity.FAULT, "board", what, remedy)


def _several(seen: list[PortSeen], chosen: str | None) -> list[Finding]:
    boards = [port.path for port in seen if port.role is Role.BOARD]
    if len(boards) < 2:
        return []
    what = f"{len(boards)} boards are plugged in ({', '.join(boards)}); this is about {chosen}"
    return [Finding(Severity.NOTE, "board", what, "name the other one with --board")]


def _no_mtx() -> Finding:
    what = "no MTx is plugged in: only the legs can be tracked"
    return Finding(Severity.NOTE, "MTx", what, "plug it in, or name its port with --mtx")


def _converse(report: Diagnosis, ports: dict[str, str], seconds: float) -> None:
    try:
        heard = listen(ports, seconds, check_gyros=True)
    except EchostepError as error:
        what, _, remedy = str(error).partition("; ")
        report.findings.append(Finding(Severity.FAULT, "ports", what, remedy or "unplug it and plug it in again"))
        return
    for notice in heard.notices:
        report.findings.append(Finding(Severity.WARNING, "ports", notice, "check the cable and its plugs"))
    if BOARD in ports:
        judge_board(report, heard, ports[BOARD])
    if MTX in ports:
        judge_mtx(report, heard, with_board=BOARD in ports)


def print_report(report: Diagnosis, console: Console) -> None:
    """The report for people: what was seen, then what to do, the worst first."""
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
