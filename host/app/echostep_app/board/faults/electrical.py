# SPDX-License-Identifier: MIT
"""The board's wiring, judged by the levels of its inputs: lines of facts, and findings, for `echostep doctor --electrical`.

In: `BoardReports` with an `Electrical`. Out: text, and `Finding`s. Owns the texts.
"""

from __future__ import annotations

from echostep.board.messages import Electrical, Healthy, Part
from echostep.board.reports import BoardReports
from echostep_app.board.faults.findings import Finding, Severity, part_in

ON_SPI = (Healthy.THIGH, Healthy.CALF, Healthy.BELT, Healthy.PRESSURE)
PULLED_DOWN = "the breakout boards pull it down: the firmware allows for that"
_LINES = ((Healthy.RANGER_LEFT, "D4", "A2"), (Healthy.RANGER_RIGHT, "D13", "A3"))  # echo and trigger [wiring.toml]


def level_line(reports: BoardReports) -> str:
    """The levels as one line of facts; "" without a report."""
    e = reports.electrical
    if e is None or not e.readings:
        return ""
    levels = (("MISO", e.miso_ones), ("D4", e.d4_ones), ("D13", e.d13_ones), ("SDA", e.sda_ones), ("SCL", e.scl_ones))
    return "levels    " + ", ".join(f"{name} {_level(ones, e.readings)}" for name, ones in levels)


def electrical_findings(reports: BoardReports) -> list[Finding]:
    """Findings by the levels, with the parts that the board has found; empty without a report."""
    e = reports.electrical
    if e is None or not e.readings:
        return []
    findings = _miso(reports, e) + _bus(e)
    return findings if reports.foot is not None else findings + _echo_lines(reports, e)


def _level(ones: int, readings: int) -> str:
    if ones in (0, readings):
        return "high" if ones else "low"
    return f"high {100 * ones / readings:.0f} % of the time"


def _miso(reports: BoardReports, e: Electrical) -> list[Finding]:
    found = reports.foot is not None or any(part_in(reports, device) is not Part.NONE for device in ON_SPI)
    if 0 < e.miso_ones < e.readings:
        what = "rests between the processor's thresholds: it reads as ones and zeros by turns"
        remedy = f"nothing must be done ({PULLED_DOWN}); 2.2 kohm from MISO to 3V3 make it a one"
        return [Finding(Severity.NOTE, "MISO", what, remedy)]
    if found:
        return []
    if e.miso_ones:
        what = "no part answers on SPI, and nothing pulls MISO down: no breakout board of an IMU is connected to it"
        remedy = "normal on a bare processor board; else check the wire from MISO to DO, and ground"
        return [Finding(Severity.NOTE, "SPI bus", what, remedy)]
    what = "no part answers on SPI, and MISO is low: a breakout board is connected to it, or it is shorted to ground"
    remedy = "check 5 V at the breakout boards, SCK, MOSI and the chip selects (D8, D9, D10, D6); then MISO for a short"
    return [Finding(Severity.FAULT, "SPI bus", what, remedy)]


def _bus(e: Electrical) -> list[Finding]:
    findings = []
    for name, pin, ones in (("SDA", "D2", e.sda_ones), ("SCL", "D3", e.scl_ones)):
        if not ones:
            what = f"is held low ({pin})"
            remedy = "unplug the compass, then the rangers on I2C, until it is high; else look for a short to ground"
            findings.append(Finding(Severity.FAULT, name, what, remedy))
    return findings


def _echo_lines(reports: BoardReports, e: Electrical) -> list[Finding]:
    """Findings on the echo lines of rangers that have not answered; the pull-up makes an open line a one."""
    findings = []
    for (device, echo, trigger), ones in zip(_LINES, (e.d4_ones, e.d13_ones), strict=True):
        answers = reports.status is not None and reports.status.healthy & device
        if answers or part_in(reports, device) not in (Part.NONE, Part.PULSE):
            continue
        if ones == e.readings:
            what = "is open: no ranger's Echo drives it, or it is shorted to 5 V"
            remedy = "normal before the ranger is wired; else check Echo's wire, and the ranger's 5 V and ground"
            findings.append(Finding(Severity.NOTE, echo, what, remedy))
        elif not ones and device is Healthy.RANGER_RIGHT and part_in(reports, device) is Part.NONE:
            what = "reads zero: the LED of an Arduino Micro, or a ranger's Echo whose trigger does not arrive"
            remedy = f"normal before the ranger is wired; else check Trig's wire ({trigger}), and that Trig and Echo are not exchanged"
            findings.append(Finding(Severity.NOTE, echo, what, remedy))
        elif not ones:
            what = "is driven low and never rises: a ranger's Echo is connected, but no trigger reaches it"
            remedy = f"check Trig's wire ({trigger}), and that Trig and Echo are not exchanged"
            findings.append(Finding(Severity.FAULT, echo, what, remedy))
    return findings
