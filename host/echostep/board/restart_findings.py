# SPDX-License-Identifier: MIT
"""Findings on the board's restarts, its crashes and its supply voltage, each with a remedy.

In: `BoardReports`. Out: `Finding`s. Owns the texts.
"""

from __future__ import annotations

from echostep.board.findings import BoardReports, Finding, Severity
from echostep.board.messages import BOARD_HEALTH_INVALID, BoardHealth, CrashPlace, ResetCause

LEAST_MV = 4100  # a measurement below it is below the 4.5 V that 16 MHz need, although the reference is off by up to 9 % [data sheet]
SAG = 0.08  # of the usual voltage; by reason: 0.4 V, more than the drop on a good cable
_POWER_REMEDY = (
    "use a shorter, thicker USB cable or a powered hub; set the brown-out fuse to 4.3 V (firmware/README.md)"
)


def restart_findings(reports: BoardReports) -> list[Finding]:
    """Finding on an unwanted cause of the last restart, or on earlier crashes."""
    cause = ResetCause(0 if reports.identity is None else reports.identity.reset_cause)
    health = reports.board_health
    if cause & ResetCause.WATCHDOG or (health is not None and health.crashes):
        what = "was restarted by its watchdog"
        what += "" if health is None or not health.crashes else f" ({crash_text(health)})"
        return [Finding(Severity.WARNING, "board", what, "if it happens again, report this line and what was done")]
    if cause & ResetCause.BROWN_OUT:
        return [Finding(Severity.WARNING, "board", "restarted because its supply was too low", _POWER_REMEDY)]
    return []


def crash_text(health: BoardHealth) -> str:
    """The crashes of a board as text: how many since power was applied, and where the last one was."""
    times = f"{health.crashes} times" if health.crashes != 1 else "once"
    where = CrashPlace(health.crash_place).name.lower()
    address = f", address 0x{2 * health.crash_address:04x}" if health.crash_address else ""
    return f"{times} since it got power, last in {where}{address}"


def supply_findings(reports: BoardReports) -> list[Finding]:
    """Finding on a supply voltage that is too low or has sagged in the last second."""
    health = reports.board_health
    if health is None or BOARD_HEALTH_INVALID in (health.supply_mv, health.supply_least_mv):
        return []
    least_v, usual_v = 1e-3 * health.supply_least_mv, 1e-3 * reports.usual_supply_mv
    if health.supply_least_mv < LEAST_MV:
        what = f"its supply is {least_v:.2f} V, it needs 4.5 V: it may stop at any time"
        return [Finding(Severity.FAULT, "board", what, _POWER_REMEDY)]
    if least_v < (1.0 - SAG) * usual_v:
        what = f"its supply sagged to {least_v:.2f} V, usual is {usual_v:.2f} V"
        return [Finding(Severity.WARNING, "board", what, _POWER_REMEDY)]
    return []
