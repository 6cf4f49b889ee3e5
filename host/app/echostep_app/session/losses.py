# SPDX-License-Identifier: MIT
"""How much of a walk was lost, and why, which ports fell silent, and unused parts of a replayed recording: for the last lines of a run.

In: the tracker's estimates as they are published, its counts, portions, a recording that was read to its end. Out: sentences. Owns the time spent
in each condition, the first and the newest arrival of each port.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping

from echostep.localization import Estimate, TrackStatus
from echostep.particles.limits import PROBABLE
from echostep.path import MeasuredSegment
from echostep.ports.chunks import BOARD, FOOT, LINES, MTX, Portion
from echostep.recording import Recording
from echostep.tracker import Tracker
from echostep.tracker.state import StreamState, TrackerState
from echostep_app.ports.arrival_clock import now_ns

ECHOLESS_S = 5.0  # without a ping for so long there are no echoes: ten pings of each ranger at the slowest
LONGEST_S = 10.0  # between two estimates; a longer gap counts as so long: estimates come twice a second
UNTRACKED_S = 5.0  # without an estimate, which is told: the first stride takes as long; assumed
SILENT = "nothing came from the foot"
UNFITTING = "the echoes did not fit the plan"
UNFITTING_STEPS = "the steps did not fit the plan: are start and heading right?"
ECHOLESS = "there were no echoes"
SPREAD = "several places fitted"
DRIFTED = "without a plan nothing corrects the drift"
NAMES = {BOARD: "the board", MTX: "the MTx", FOOT: "the foot board", LINES: "the foot's lines"}
# Before the end of a run, from which a port has fallen silent: an order more than between two chunks; assumed
SILENT_S = 3.0


class Losses:
    """Watches a tracker from its first estimate on."""

    def __init__(self, tracker: Tracker) -> None:
        self._tracker = tracker
        self._walk_s = 0.0
        self._spent_s: dict[TrackStatus, Counter[str]] = {status: Counter() for status in TrackStatus}
        self._last: Estimate | None = None
        self._ping_s = 0.0  # time of the newest ping
        self._heard = False  # whether there was one
        self._check_ins: dict[int, float] = {}  # number of a check-in: time of the estimate that it gave
        tracker.watchers.append(self._watch)

    def _watch(self, measured: MeasuredSegment | None, e: Estimate) -> None:
        """Add the time since the last estimate to the condition of the new one."""
        last, self._last = self._last, e
        state = self._tracker.state
        if state.check_ins and state.check_ins not in self._check_ins:
            self._check_ins[state.check_ins] = e.t_s
        if measured is not None and len(measured.t_s):
            self._ping_s, self._heard = float(measured.t_s[-1]), True
        if last is None:
            self._ping_s = max(self._ping_s, e.t_s)
            return
        span_s = min(max(e.t_s - last.t_s, 0.0), LONGEST_S)
        self._walk_s += span_s
        self._spent_s[e.status][self._reason(measured, e, state)] += span_s  # type: ignore[assignment]

    def _reason(self, measured: MeasuredSegment | None, e: Estimate, state: TrackerState) -> str:
        """Why an estimate would not be sure."""
        if measured is None:
            return SILENT
        if not self._tracker.plan.is_drawn:
            return DRIFTED
        if state.right < PROBABLE:
            since = [t_s for t_s in self._check_ins.values() if t_s < e.t_s]
            unfitting = UNFITTING if self._heard else UNFITTING_STEPS
            return f"{unfitting} after the position was set by hand at {since[-1]:.0f} s" if since else unfitting
        return ECHOLESS if e.t_s - self._ping_s > ECHOLESS_S else SPREAD

    def describe(self, worn_s: float = 0.0) -> str:
        """The whole walk in a sentence: how long it was lost and uncertain, and the reasons with their times; how much of `worn_s` has estimates."""
        if self._last is None:
            return ""
        lost, uncertain = self._spent_s[TrackStatus.LOST], self._spent_s[TrackStatus.UNCERTAIN]
        walk = f"{self._walk_s:.0f} s"
        untracked_s = worn_s - self._walk_s
        by_hand = _by_hand(self._tracker.state)
        if untracked_s > UNTRACKED_S:
            by_hand += f"; {untracked_s:.0f} s of the {worn_s:.0f} s that were worn have no estimate"
        if lost.total() < 0.5 and uncertain.total() < 0.5:
            return f"never lost in {walk}{by_hand}"
        parts = [f"lost for {lost.total():.0f} s of {walk}", f"uncertain for {uncertain.total():.0f} s"]
        reasons = (lost + uncertain).most_common()
        why = ", ".join(f"{reason} ({seconds:.0f} s)" for reason, seconds in reasons if seconds >= 0.5)
        return f"{', '.join(parts)}: {why}{by_hand}"


def _by_hand(state: TrackerState) -> str:
    """How often a position was set by hand and undone, as the end of a sentence."""
    if not state.check_ins:
        return ""
    undone = f", {state.undone} of them undone" if state.undone else ""
    times = "once" if state.check_ins == 1 else f"{state.check_ins} times"
    return f"; position set by hand {times}{undone}"


def skipped(recording: Recording, streams: StreamState) -> list[str]:
    """One line for each kind of damage; none for a whole recording of undisturbed ports."""
    front_end, damage = streams.front_end, recording.damage()
    counts = {
        "{} arrival times contradict the devices' counters and were not used": front_end.bad_arrivals,
        "the host's clock stepped or stood still {} times": front_end.clock_steps,
        "the barometer's first readings were not air pressure and were not used": front_end.barometer_jumps,
        "{} edges on the SyncOut input were none of the MTx's and were not used": front_end.stray_edges,
        "{} messages had impossible times and were dropped": front_end.bad_times,
        "{} chunks came from unknown ports": front_end.unknown_ports,
        "{} damaged frames of the board were dropped": streams.board.rejected,
        f"{{}} damaged messages of the {streams.foot_name} were dropped": streams.mtx.bad_checksum,
    }
    lines = [*damage, *(text.format(count) for text, count in counts.items() if count)]
    lines = [f"{recording.path}: {line}" for line in lines]
    advice = [
        f"  echostep repair {path} -o OUT makes a whole file of what is readable" for path in recording.to_repair()
    ]
    return [*lines, *advice]


class Arrivals:
    """Notes the arrival times of a run. `urls`: the ports of a live run by name; its end is the host's clock, else the newest chunk is the end."""

    def __init__(self) -> None:
        self.urls: Mapping[str, str] = {}
        self._first_ns, self._newest_ns = math.inf, -math.inf
        self._newest: dict[str, int] = {}

    def note(self, portion: Portion) -> None:
        """Note the chunks of a portion."""
        if not len(portion.t_arrival_ns):
            return
        self._first_ns = min(self._first_ns, int(portion.t_arrival_ns[0]))
        self._newest_ns = max(self._newest_ns, int(portion.t_arrival_ns[-1]))
        for name in set(portion.ports) & NAMES.keys():
            last_ns = portion.t_arrival_ns[portion.port == portion.ports.index(name)]
            if len(last_ns):
                self._newest[name] = int(last_ns[-1])

    @property
    def worn_s(self) -> float:
        """From the first bytes to the end, s; 0 without bytes."""
        return max(self._end_ns - self._first_ns, 0.0) * 1e-9 if self._newest else 0.0

    @property
    def _end_ns(self) -> float:
        return now_ns() if self.urls else self._newest_ns

    def silent(self) -> list[str]:
        """A sentence for each port from which nothing came at the end, or at all."""
        lines = []
        for name, words in NAMES.items():
            if (name not in self.urls and name not in self._newest) or (name == MTX and LINES in self._newest):
                continue
            port = f" ({self.urls[name]})" if name in self.urls else ""
            if name not in self._newest:
                lines.append(f"nothing came from {words}{port} at all")
            elif (silent_s := (self._end_ns - self._newest[name]) * 1e-9) > SILENT_S:
                since_s = (self._newest[name] - self._first_ns) * 1e-9
                lines.append(f"nothing came from {words}{port} since {since_s:.0f} s, for the last {silent_s:.0f} s")
        return lines
