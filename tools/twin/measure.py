# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures of the real firmware in the twin: rates, errors of time stamps, losses, memory; each with its limit and PASS or FAIL.

In: the ELF and the twin (`make measure` builds both). Out: a table for each kit of parts; exit status 1 when a limit is missed. Owns the limits.
The speed has no limit, for it is that of the computer.
"""

from __future__ import annotations

import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from echostep.arrays import Floats
from echostep.board import messages as m
from echostep.board.frames import BoardReader, encode
from echostep.board.reports import SUBSCRIBE as USUAL
from echostep_simulation.devices.board import BoardProcess
from echostep_simulation.kits import Kit
from echostep_simulation.stimulus import EXTENDED_ROW, NO_SYNC, ROW
from places import TWIN
from reliability.campaign import Figure, options, report

SUBSCRIBE = m.Subscribe(USUAL.reports | m.Reports.LOOP)
SETTLED_S = 2.0  # enumeration and start-up take less
TICK_US = 0.5
CYCLES_US = (61_000, 66_000, 70_000)  # of an SRF02: likely; two that its maker names [forum, t=269; data sheet]
LEAST_PINGS = {66_000: 28.0, 70_000: 26.5}  # /s
RIGHT_US = 6123  # the right ranger's time of flight
TRIGGERS = ("trigger left", "trigger right")  # events in the trace, by ranger


@dataclass
class RunResult:
    """Messages, losses and the trace of the buses; `stamps` in ticks, by the event's name in the trace."""

    seconds: int
    wall_s: float = 0.0
    counts: Counter[str] = field(default_factory=Counter)
    stamps: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    trace: list[tuple[int, str]] = field(default_factory=list)  # ns, event
    memory: int = 0
    dropped: dict[str, int] = field(default_factory=dict)
    lost: int = 0
    turn_ms: float = 0.0  # longest of the main loop
    latency_us: float = 0.0  # longest of an interrupt
    worst_flight_us: int = 0  # error of the right ranger, which hears its own echo only

    def add(self, message: m.Message, t_ns: int) -> None:
        """Take a message; before SETTLED_S only the status."""
        if isinstance(message, m.Status):
            self.memory = message.memory_used
            self.dropped = {k: v for k, v in message._asdict().items() if k.startswith("dropped_") and v}
        if t_ns < SETTLED_S * 1e9:
            return
        self.counts[type(message).__name__] += 1
        if isinstance(message, m.Loop):
            self.turn_ms = max(self.turn_ms, 1e-3 * TICK_US * message.longest_turn)
            self.latency_us = max(self.latency_us, TICK_US * message.longest_latency)
        if isinstance(message, m.Ping):
            self.stamps[TRIGGERS[message.ranger]].append(message.ticks)
            if message.ranger == m.Ranger.RIGHT:
                self.worst_flight_us = max(self.worst_flight_us, abs(message.time_of_flight_us - RIGHT_US))
        elif isinstance(message, m.Sync | m.Foot):
            self.stamps[type(message).__name__.lower()].append(message.ticks)

    def rate(self, kind: str) -> float:
        """Messages per second."""
        return self.counts[kind] / (self.seconds - SETTLED_S)

    def offsets(self, event: str) -> Floats:
        """Each stamp minus the time of the nearest event (us); the board's clock begins after the true one."""
        events = np.array([t_ns for t_ns, text in self.trace if text == event]) / 1e3
        stamps_us = np.array(self.stamps[event]) * TICK_US
        after = np.clip(np.searchsorted(events, stamps_us), 1, len(events) - 1)
        nearest = np.where(stamps_us - events[after - 1] < events[after] - stamps_us, events[after - 1], events[after])
        return np.asarray(stamps_us - nearest, np.float64)

    def losses(self) -> list[Figure]:
        """Figures of every board."""
        return [
            Figure(f"frames lost in {self.seconds / 60:.0f} min", str(self.lost), "0", self.lost == 0),
            Figure("longest turn of the loop", f"{self.turn_ms:.1f} ms", "<= 5 ms", self.turn_ms <= 5.0),
            Figure("longest interrupt latency", f"{self.latency_us:.1f} us", "<= 100 us", self.latency_us <= 100.0),
            Figure("drops by stream", str(self.dropped or 0), "0", not self.dropped),
            Figure("static RAM and deepest stack", f"{self.memory} B", "< 2200 B", self.memory < 2200),
            Figure("speed, with the reader", f"{self.seconds / self.wall_s:.0f} x real time", "", None),
        ]


def rows() -> NDArray[np.void]:
    """Rows of one second: an echo on both sides, a cross echo at the left, constant rates, SyncOut at 100 Hz."""
    table = np.zeros(1000, ROW)
    table["own_us"], table["cross_us"] = [5831, RIGHT_US], [9000, 0]
    table["thigh"], table["calf"], table["belt"] = 41, -82, 5
    table["bearing"], table["pressure"], table["temperature"] = 900, 405_300, 400
    table["sync_us"] = NO_SYNC
    table["sync_us"][::10] = 333
    return table


def foot_rows() -> NDArray[np.void]:
    """Rows of one second of a foot that stands."""
    table = np.zeros(1000, EXTENDED_ROW)
    table["row"]["sync_us"], table["row"]["temperature"] = NO_SYNC, 480
    table["motion"]["force"][:, 0, 2] = 1024
    return table


def run(
    seconds: int, title: str, kit: str, second: NDArray[np.void], *asked: m.Message, cycle_us: int = CYCLES_US[0]
) -> RunResult:
    """Run the firmware for `seconds` with the same rows in each; after the first one it is `asked`. `cycle_us`: of an SRF02."""
    board, reader, result = BoardProcess(TWIN), BoardReader(), RunResult(seconds)
    board.fault(f"kit={kit}")
    board.fault(f"srf_cycle={cycle_us}")
    began = time.perf_counter()
    for k in track(range(seconds), title):
        for sequence, message in enumerate(asked if k == 1 else ()):
            board.send(encode(message, sequence))
        for t_ns, sent in board.advance(second):
            for message in reader.feed(sent):
                result.add(message, t_ns)
    result.wall_s, result.lost, result.trace = time.perf_counter() - began, reader.counts.lost, board.trace
    board.close()
    return result


def stamps(what: str, begin_us: float, limit_us: float, *offsets: Floats) -> Figure:
    """Largest error of stamps, by the begin of the board's clock."""
    worst_us = max(float(np.abs(each - begin_us).max()) for each in offsets)
    sd_us = max(float(each.std()) for each in offsets)
    return Figure(f"worst {what}", f"{worst_us:.1f} us (sd {sd_us:.2f})", f"<= {limit_us:g} us", worst_us <= limit_us)


def rate(what: str, per_s: float, expected: float, within: float) -> Figure:
    """A rate with the largest deviation that is allowed."""
    return Figure(f"{what}/s", f"{per_s:.1f}", f"{expected:g}", abs(per_s - expected) < within)


def belt_figures(seconds: int, kit: Kit) -> list[Figure]:
    """Every figure of a belt board."""
    sequential, concurrent = (
        m.Configure(0xFF, schedule, 200, 10, m.PressureMode.HIGH_SPEED)
        for schedule in (m.Schedule.SEQUENTIAL, m.Schedule.CONCURRENT)
    )
    result = run(seconds, "both rangers at once", kit.value, rows(), concurrent, SUBSCRIBE)
    slow = run(min(seconds, 30), "in turn, as in the paper", kit.value, rows(), sequential, SUBSCRIBE).rate("Ping")
    slower = (
        {
            us: run(min(seconds, 30), f"a cycle of {us // 1000} ms", kit.value, rows(), concurrent, cycle_us=us).rate(
                "Ping"
            )
            for us in LEAST_PINGS
        }
        if kit is Kit.PAPERS
        else {}
    )
    captured = "sync" if kit is Kit.PAPERS else TRIGGERS[0]  # by Timer1: SyncOut, or the left echo line
    begin_us = float(np.median(result.offsets(captured)))
    limit_us = 20.0 if kit is Kit.PAPERS else 2.0  # pulses are captured by the timers
    flight_us, pings = result.worst_flight_us, result.rate("Ping")
    of_the_kit = {
        Kit.PAPERS: [stamps("SyncOut stamp", begin_us, 20.0, result.offsets(captured))],
        Kit.OF_2026: [
            Figure("worst time of flight", f"{flight_us} us", "<= 2 us", flight_us <= 2),
            rate("samples of all axes", result.rate("Motion"), 200.0, 1.0),
            rate("magnetic fields", result.rate("Magnetic"), 10.0, 0.2),
            rate("pressures", result.rate("Pressure"), 12.5, 0.5),
        ],
    }
    return [
        Figure("pings/s, both rangers at once", f"{pings:.1f}", ">= 28", pings >= 28.0),
        Figure("pings/s, in turn", f"{slow:.1f}", "14.3 by design", slow > 13.5),
        *(
            Figure(f"the same, cycle of {us // 1000} ms", f"{hz:.1f}", f">= {LEAST_PINGS[us]:g}", hz >= LEAST_PINGS[us])
            for us, hz in slower.items()
        ),
        rate("gyro samples", result.rate("Gyros"), 200.0, 1.0),
        stamps("trigger stamp", begin_us, limit_us, *map(result.offsets, TRIGGERS)),
        *of_the_kit[kit],
        *result.losses(),
    ]


def foot_figures(seconds: int) -> list[Figure]:
    """Every figure of the foot board. A constant error of its stamps would not be seen: there is no other stamp."""
    result = run(seconds, "the foot board", "foot", foot_rows(), SUBSCRIBE)
    offsets, per_s = result.offsets("foot"), result.rate("Foot")
    return [
        Figure("foot samples/s", f"{per_s:.1f}", "225 within 1 %", abs(per_s / 225.0 - 1.0) < 0.0105),
        stamps("stamp of a sample", float(np.median(offsets)), 20.0, offsets),
        *result.losses(),
    ]


def main() -> int:
    seconds = max(5, round(60 * options(__doc__, minutes=(10.0, "simulated")).minutes))
    tables: dict[str, Callable[[], list[Figure]]] = {
        "parts of the papers": lambda: belt_figures(seconds, Kit.PAPERS),
        "parts of 2026, not built yet": lambda: belt_figures(seconds, Kit.OF_2026),
        "the foot board of 2026, not built yet": lambda: foot_figures(seconds),
    }
    title = "The real firmware in the twin, {} (simulated hardware)"
    return max([report(title.format(parts), measure()) for parts, measure in tables.items()])


if __name__ == "__main__":
    sys.exit(main())
