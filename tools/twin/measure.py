# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of the real firmware in the twin: rates, errors of time stamps, losses, memory; each with its limit and PASS or FAIL.

In: the ELF and the twin (`make measure` builds both). Out: a table for each kit of parts; exit status 1 when a limit is missed. Owns the limits.
The speed has no limit, for it is that of the computer.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from echostep.board import messages as m
from echostep.board.frames import BoardReader, encode
from echostep_app.board.subscription import SUBSCRIBE
from echostep_app.simulation.devices.board import BoardProcess
from echostep_app.simulation.kits import Kit
from echostep_app.simulation.stimulus import EXTENDED_ROW, NO_SYNC, ROW
from places import TWIN
from reliability.campaign import options, report

SETTLED_S = 2.0  # enumeration and start-up take less
TICK_US = 0.5
Figure = tuple[str, str, str, bool | None]  # what, measured, limit, passed (None: no limit)
RIGHT_US = 6123  # the right ranger's time of flight


@dataclass
class RunResult:
    """Messages and losses of one run; `triggers` (per ranger) and `syncs` are time stamps in ticks of 0.5 us."""

    seconds: float = 0.0
    wall_s: float = 0.0
    counts: Counter[str] = field(default_factory=Counter)
    triggers: dict[int, list[int]] = field(default_factory=lambda: {0: [], 1: []})
    syncs: list[int] = field(default_factory=list)
    status: m.Status | None = None
    lost: int = 0
    worst_flight_us: int = 0  # error of the right ranger, which hears its own echo only


def rows() -> np.ndarray:
    """Rows of one second: an echo on both sides, a cross echo at the left, constant rates, SyncOut at 100 Hz."""
    table = np.zeros(1000, ROW)
    table["own_us"], table["cross_us"] = [5831, RIGHT_US], [9000, 0]
    table["thigh"], table["calf"], table["belt"] = 41, -82, 5
    table["bearing"], table["pressure"], table["temperature"] = 900, 405_300, 400
    table["sync_us"] = NO_SYNC
    table["sync_us"][::10] = 333
    return table


def run(seconds: int, schedule: m.Schedule, title: str, kit: Kit) -> tuple[RunResult, list[tuple[int, str]]]:
    """Run the firmware for `seconds`; the messages received, and the trace of the buses as (ns, text)."""
    board, reader, result, second = BoardProcess(TWIN), BoardReader(), RunResult(), rows()
    board.fault(f"kit={kit.value}")
    began = time.perf_counter()
    for k in track(range(seconds), title):
        if k == 1:
            board.send(encode(m.Configure(0xFF, schedule, 200, 10, m.PressureMode.HIGH_SPEED), 0))
            board.send(encode(SUBSCRIBE, 1))
        for t_ns, sent in board.advance(second):
            for message in reader.feed(sent):
                add_message(result, message, t_ns)
    result.wall_s, result.seconds, result.lost = time.perf_counter() - began, float(seconds), reader.counts.lost
    board.close()
    return result, board.trace


def add_message(result: RunResult, message: m.Message, t_ns: int) -> None:
    """Add a message to the result; before SETTLED_S only the status."""
    if isinstance(message, m.Status):
        result.status = message
    if t_ns < SETTLED_S * 1e9:
        return
    result.counts[type(message).__name__] += 1
    if isinstance(message, m.Ping):
        result.triggers[message.ranger].append(message.ticks)
        if message.ranger == m.Ranger.RIGHT:
            result.worst_flight_us = max(result.worst_flight_us, abs(message.time_of_flight_us - RIGHT_US))
    elif isinstance(message, m.Sync):
        result.syncs.append(message.ticks)


def stamp_offsets(stamps: list[int], truth_ns: list[int]) -> NDArray[np.float64]:
    """Each stamp minus the time of the nearest event (us); the board's clock begins after the true one."""
    events = np.array(truth_ns) / 1e3
    stamps_us = np.array(stamps) * TICK_US
    after = np.clip(np.searchsorted(events, stamps_us), 1, len(events) - 1)
    nearest = np.where(stamps_us - events[after - 1] < events[after] - stamps_us, events[after - 1], events[after])
    return np.asarray(stamps_us - nearest, np.float64)


def stamp_errors(offsets: NDArray[np.float64], begin_us: float) -> tuple[float, float]:
    """Largest absolute value and sd (us) of the errors of stamps, by the begin of the board's clock."""
    error = offsets - begin_us
    return float(np.abs(error).max()), float(error.std())


def figures(seconds: int, kit: Kit) -> list[Figure]:
    """Every figure of a belt board."""
    result, trace = run(seconds, m.Schedule.CONCURRENT, "both rangers at once", kit)
    slow, _ = run(min(seconds, 30), m.Schedule.SEQUENTIAL, "in turn, as in the paper", kit)
    span, slow_span = result.seconds - SETTLED_S, slow.seconds - SETTLED_S
    assert result.status is not None
    dropped = {k: v for k, v in result.status._asdict().items() if k.startswith("dropped_") and v}
    pings, gyros = result.counts["Ping"] / span, result.counts["Gyros"] / span
    truth = {side: [t for t, text in trace if text == f"trigger {side}"] for side in ("left", "right")}
    offsets = [stamp_offsets(result.triggers[k], truth[side]) for k, side in enumerate(("left", "right"))]
    syncs = stamp_offsets(result.syncs, [t for t, text in trace if text == "sync"]) if result.syncs else offsets[0]
    begin_us = float(np.median(syncs))  # by what Timer1 captures: SyncOut, or the left echo line
    worst = [stamp_errors(each, begin_us) for each in offsets]
    trigger = max(w for w, _ in worst)
    return [
        ("pings/s, both rangers at once", f"{pings:.1f}", ">= 28", pings >= 28.0),
        (
            "pings/s, in turn",
            f"{slow.counts['Ping'] / slow_span:.1f}",
            "14.3 by design",
            slow.counts["Ping"] / slow_span > 13.5,
        ),
        ("gyro samples/s", f"{gyros:.1f}", "200", abs(gyros - 200.0) < 1.0),
        ("worst trigger stamp", f"{trigger:.1f} us (sd {max(s for _, s in worst):.2f})", *_trigger_limit(trigger, kit)),
        *(_of_the_papers(*stamp_errors(syncs, begin_us)) if kit is Kit.PAPERS else _of_2026(result, span)),
        (f"frames lost in {seconds / 60:.0f} min", str(result.lost), "0", result.lost == 0),
        ("drops by stream", str(dropped or 0), "0", not dropped),
        (
            "static RAM and deepest stack",
            f"{result.status.memory_used} B",
            "< 2200 B",
            result.status.memory_used < 2200,
        ),
        ("speed, with the reader", f"{result.seconds / result.wall_s:.0f} x real time", "", None),
    ]


def _trigger_limit(worst_us: float, kit: Kit) -> tuple[str, bool]:
    limit_us = 20.0 if kit is Kit.PAPERS else 2.0  # pulses are captured by the timers
    return f"<= {limit_us:g} us", worst_us <= limit_us


def _of_the_papers(worst: float, sd: float) -> list[Figure]:
    return [("worst SyncOut stamp", f"{worst:.1f} us (sd {sd:.2f})", "<= 20 us", worst <= 20.0)]


def _of_2026(result: RunResult, span: float) -> list[Figure]:
    """All axes, fields, pressures, and the timing of the pulses."""
    motions, fields, pressures = (result.counts[kind] / span for kind in ("Motion", "Magnetic", "Pressure"))
    flight = result.worst_flight_us
    return [
        ("worst time of flight", f"{flight} us", "<= 2 us", flight <= 2),
        ("samples of all axes/s", f"{motions:.1f}", "200", abs(motions - 200.0) < 1.0),
        ("magnetic fields/s", f"{fields:.1f}", "10", abs(fields - 10.0) < 0.2),
        ("pressures/s", f"{pressures:.1f}", "12.5", abs(pressures - 12.5) < 0.5),
    ]


def foot_rows() -> np.ndarray:
    """Rows of one second of a foot that stands."""
    table = np.zeros(1000, EXTENDED_ROW)
    table["row"]["sync_us"], table["row"]["temperature"] = NO_SYNC, 480
    table["motion"]["force"][:, 0, 2] = 1024
    return table


def foot_figures(seconds: int) -> list[Figure]:
    """Every figure of the foot board."""
    board, reader, result, second = BoardProcess(TWIN), BoardReader(), RunResult(), foot_rows()
    board.fault("kit=foot")
    stamps: list[int] = []
    for k in track(range(seconds), "the foot board"):
        if k == 1:
            board.send(encode(SUBSCRIBE, 0))
        for t_ns, sent in board.advance(second):
            for message in reader.feed(sent):
                add_message(result, message, t_ns)
                if isinstance(message, m.Foot) and t_ns >= SETTLED_S * 1e9:
                    stamps.append(message.ticks)
    board.close()
    assert result.status is not None
    offsets = stamp_offsets(stamps, [t for t, text in board.trace if text == "foot"])
    worst, sd = stamp_errors(
        offsets, float(np.median(offsets))
    )  # a constant error would not be seen: there is no other stamp
    rate, lost, memory = len(stamps) / (seconds - SETTLED_S), reader.counts.lost, result.status.memory_used
    return [
        ("foot samples/s", f"{rate:.1f}", "225 within 1 %", abs(rate / 225.0 - 1.0) < 0.0105),
        ("worst stamp of a sample", f"{worst:.1f} us (sd {sd:.2f})", "<= 20 us", worst <= 20.0),
        (f"frames lost in {seconds / 60:.0f} min", str(lost), "0", lost == 0),
        ("static RAM and deepest stack", f"{memory} B", "< 2200 B", memory < 2200),
    ]


def main() -> int:
    seconds = max(5, round(60 * options(__doc__, minutes=(10.0, "simulated")).minutes))
    tables: dict[str, Callable[[], list[Figure]]] = {
        "parts of the papers": lambda: figures(seconds, Kit.PAPERS),
        "parts of 2026, not built yet": lambda: figures(seconds, Kit.OF_2026),
        "the foot board of 2026, not built yet": lambda: foot_figures(seconds),
    }
    title = "The real firmware in the twin, {} (simulated hardware)"
    return max([report(title.format(parts), measure()) for parts, measure in tables.items()])


if __name__ == "__main__":
    sys.exit(main())
